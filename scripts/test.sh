#!/usr/bin/env bash
# Everything that must hold before a change goes in.
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

steps=(plain python docs asan tsan clang minimal cuda)
slow_steps=(fuzz wheel aarch64) # with --slow
more_steps=(gpu)  # only when asked for

usage() {
    cat <<TXT
usage: scripts/test.sh [--slow] [--only STEP]... [--help]

Installs what is missing (Debian and Ubuntu, as root or by sudo without a password; else says what to install), then:
    plain    every feature but CUDA, warnings are errors, the whole suite; on the emulated CUDA device only with --slow
    python   the Python package: pip install into an environment of its own, and its tests
    docs     the documents as web pages, with the reference made from headers and docstrings: warnings are errors; left out
             where Doxygen or Sphinx cannot be installed
    asan     address and undefined-behaviour sanitizers, the whole suite; on the emulated CUDA device (single precision) only
             with --slow
    tsan     thread sanitizer, the tests of suite 'threads'
    clang    by clang with LLVM's OpenMP, test_threads only
    minimal  by clang, no optional feature, no instruction set beyond the compiler's default, the whole suite without the
             emulated CUDA device, with a quarter of the random cases. clang writes a lane of a vector by storing the whole
             vector, which makes a race where threads share one
    cuda     when nvcc is found: the CUDA backend compiles; its tests run where there is a GPU, and are counted as skipped
             where there is none. There it is compiled to PTX, and no further, since nothing runs it
with --slow:
    fuzz     by clang: libFuzzer on each of tests/fuzz, a fixed number of inputs, the same ones every time
    wheel    scripts/wheel.sh: the source package, and from it a wheel, which is tried without a compiler; left out where
             what builds wheels cannot be installed
    aarch64  the library by a cross compiler, and a few test programs on an emulator; left out where these, or Check for that
             machine, cannot be installed
and, when asked for by --only, on a machine with a GPU:
    gpu      the tests of suite 'gpu' under compute-sanitizer: memcheck, initcheck, synccheck, racecheck
The last line sums up the checks of all steps. Exit status 0: nothing failed.

--slow       run the tests of suite 'slow' and those on the emulated CUDA device in both precisions (in step plain), and the
             steps above; compile CUDA for all architectures
--only STEP  this step only; may be given more than once
JOBS=n       compile and test with n jobs instead of all cores

Build folders are build-STEP/; they are kept, so that a second run is quick.
TXT
}

slow=false
only=()
while (($#)); do
    case $1 in
        --slow) slow=true ;;
        --only)
            [[ " ${steps[*]} ${slow_steps[*]} ${more_steps[*]} " == *" ${2:-} "* ]] || fail "--only ${2:-}: must be one of ${steps[*]} ${slow_steps[*]} ${more_steps[*]}"
            only+=("$2")
            shift
            ;;
        --help | -h) usage; exit ;;
        *) usage >&2; fail "unknown argument $1" ;;
    esac
    shift
done
$slow && steps+=("${slow_steps[@]}")
((${#only[@]})) && steps=("${only[@]}")

install_packages "${packages_to_test[@]}"
install_packages_if_offered "${packages_to_test_if_offered[@]}"

# Features are demanded, not hoped for: a missing package must not pass for a shorter suite.
features=(-Dwerror=true -Dfcl=enabled -Dqhull=enabled -Dopenmp=enabled -Dhdf5=enabled -Dcli=enabled -Dbench=enabled -Dtests=enabled)
package_installed libsiconos-numerics-dev && features+=(-Dsiconos=enabled)

logs=()        # testlog.json of each step that ran
broken=()      # steps that did not build
left_out=()    # steps that could not run here
passed=()      # steps that passed and have no log

# build STEP OPTION...
build() {
    local step=$1
    shift
    configure "$project/build-$step" "$@" && ninja -C "$project/build-$step" -j "$jobs" --quiet
}

# run_tests STEP ARGUMENT...: the tests' results go into `logs`
run_tests() {
    local step=$1 folder=$project/build-$1
    shift
    rm -f "$folder/meson-logs/testlog.json"
    "${launcher[@]}" meson test -C "$folder" "${rebuild[@]}" --timeout-multiplier 4 --num-processes "$jobs" \
        --print-errorlogs --quiet "$@" || true
    logs+=("$folder/meson-logs/testlog.json")
}

# Sanitizers of older compilers cannot place their shadow memory when a kernel randomises addresses with 32 bits: their
# tests are started without randomisation. (As meson's --wrapper this would rename the log.)
launcher=()
rebuild=(--no-rebuild)
unrandomised=()
if setarch "$(uname -m)" -R true 2>/dev/null; then
    unrandomised=(setarch "$(uname -m)" -R)
fi

step_plain() {
    say "plain: every feature but CUDA, warnings are errors"
    # Compiling the device's sources as C++ takes half of this step.
    local emulated=disabled
    $slow && emulated=enabled
    build plain "${features[@]}" -Dcuda=disabled -Demulated_cuda=$emulated || return 1
    if $slow; then run_tests plain; else run_tests plain --no-suite slow; fi
}

step_python() {
    local folder=$project/build-python
    say "python: the package, installed into an environment of its own"
    rm -rf "$folder/environment" "$folder/meson-logs"
    mkdir -p "$folder/meson-logs" # where every step has its log
    python3 -m venv "$folder/environment" || return 1
    # One instruction set, no CUDA: the steps beside this one have the others. The command is built to compare with:
    # another instruction set rounds otherwise.
    "$folder/environment/bin/pip" install --quiet --disable-pip-version-check "${project}[test,import,usd,decompose,view,video,gym]" \
        -Csetup-args=-Dcuda=disabled -Csetup-args=-Dcpu_isas=avx2 -Csetup-args=-Dwerror=true \
        -Csetup-args=-Dcli=enabled \
        -Cbuild-dir="$folder/build" || return 1
    # For its model of an arm, which an example moves; not for its code, nor for what that needs.
    "$folder/environment/bin/pip" install --quiet --disable-pip-version-check --no-deps gymnasium-robotics || return 1
    # Away from the sources, so that what was installed is what is tested.
    (cd "$folder" && SUBADMM=$folder/build/src/subadmm environment/bin/python -m pytest -q --junitxml=meson-logs/pytest.xml "$project/python/tests") || true
    logs+=("$folder/meson-logs/pytest.xml")
}

step_docs() {
    local status=0
    say "docs: guide, internals and reference as web pages"
    "$project/scripts/docs.sh" || status=$?
    if ((status == 0)); then passed+=(docs); fi
    ((status == 77)) || return "$status"
    echo "Doxygen or Sphinx cannot be installed here"
    left_out+=(docs)
}

step_asan() {
    say "asan: address and undefined-behaviour sanitizers"
    # Only what the tests need is built. The emulated device takes half of this step.
    local emulated=disabled
    $slow && emulated=enabled
    configure "$project/build-asan" --native-file "$project/presets/asan.ini" "${features[@]}" -Dcpu_isas=avx2 \
        -Demulated_cuda=$emulated || return 1
    local launcher=("${unrandomised[@]}") rebuild=()
    run_tests asan --no-suite slow
}

step_tsan() {
    say "tsan: thread sanitizer"
    # Only what the tests of this suite need is built.
    configure "$project/build-tsan" --native-file "$project/presets/tsan.ini" "${features[@]}" -Dcpu_isas=avx2 || return 1
    local launcher=("${unrandomised[@]}") rebuild=()
    if ! "${launcher[@]}" meson test -C "$project/build-tsan" --quiet no_race >/dev/null; then
        # The program itself says which it is.
        local output
        output=$("${launcher[@]}" "$project/build-tsan/tests/race" 2>&1 || true)
        if [[ $output == *'unexpected memory mapping'* || $output == *ADDR_NO_RANDOMIZE* ]]; then
            echo "the thread sanitizer cannot start here: the kernel randomises addresses too much for it and forbids to turn" \
                "that off (run as root: sysctl vm.mmap_rnd_bits=28)"
            left_out+=(tsan)
            return
        fi
    fi
    run_tests tsan --suite threads
}

step_clang() {
    say "clang: by clang with LLVM's OpenMP"
    # Only what this test needs is built.
    CC=clang CXX=clang++ configure "$project/build-clang" -Dwerror=true -Dtests=enabled -Dopenmp=enabled -Dcpu_isas=avx2 -Dcli=disabled \
        -Dbench=disabled -Dfcl=disabled -Dcuda=disabled -Dhdf5=disabled -Dsiconos=disabled -Demulated_cuda=disabled || return 1
    local rebuild=()
    run_tests clang threads
}

step_minimal() {
    say "minimal: by clang, no FCL, qhull, CUDA, HDF5 or OpenMP, no instruction set beyond the compiler's default"
    CC=clang CXX=clang++ configure "$project/build-minimal" -Dwerror=true -Dtests=enabled -Dcli=enabled -Dbench=enabled -Dfcl=disabled -Dqhull=disabled \
        -Dcuda=disabled -Dhdf5=disabled -Dopenmp=disabled -Dsiconos=disabled -Dcpu_isas=baseline -Demulated_cuda=disabled || return 1
    # All random cases are those of step plain.
    local rebuild=()
    SADMM_TEST_SHORT=1 run_tests minimal --no-suite slow
}

step_cuda() {
    if ! command -v nvcc >/dev/null && [[ ! -x /usr/local/cuda/bin/nvcc ]]; then
        say "cuda: left out, nvcc was not found"
        left_out+=(cuda)
        return
    fi
    say "cuda: the CUDA backend"
    if command -v nvidia-smi >/dev/null && nvidia-smi -L 2>/dev/null | grep -q GPU; then
        build cuda "${features[@]}" -Dcuda=enabled || return 1
        run_tests cuda --no-suite slow
        return
    fi
    # It compiles and links, and its tests say what is missing; what all steps before this one test is left out.
    local archs=ptx90 rebuild=()
    $slow && archs=80,90
    echo "no GPU here: compiled for $archs, and the tests of suite 'gpu' are skipped"
    configure "$project/build-cuda-compile" -Dwerror=true -Dcuda=enabled -Dgpu_archs="$archs" -Dcpu_isas=baseline \
        -Demulated_cuda=disabled -Dfcl=disabled -Dhdf5=disabled -Dsiconos=disabled -Dcli=disabled -Dbench=disabled \
        -Dtests=enabled || return 1
    # What is not run need not be fast: most of the time is the assembler's.
    NVCC_APPEND_FLAGS="-Xptxas=-O0 ${NVCC_APPEND_FLAGS:-}" ninja -C "$project/build-cuda-compile" -j "$jobs" --quiet \
        src/libsubadmm.a || return 1
    run_tests cuda-compile --suite gpu
}

step_fuzz() {
    say "fuzz: libFuzzer"
    # Only what the tests of this suite need is built.
    configure "$project/build-fuzz" --native-file "$project/presets/fuzz.ini" -Dtests=enabled -Dwerror=true || return 1
    local launcher=("${unrandomised[@]}") rebuild=()
    run_tests fuzz --suite fuzz
}

step_wheel() {
    local status=0
    say "wheel: the source package, and from it a wheel"
    "$project/scripts/wheel.sh" --out "$project/build-wheel/tested" || status=$?
    if ((status == 0)); then passed+=(wheel); fi
    ((status == 77)) || return "$status"
    echo "what builds wheels cannot be installed here"
    left_out+=(wheel)
}

# Check for aarch64, unpacked into a folder: this machine's own packages stay what they are. False: there is none.
unpack_check() {
    local folder=$1 apt=(apt-get -qq)
    [[ -e $folder/root/usr/include/check.h ]] && return
    mkdir -p "$folder/lists/partial" "$folder/root"
    apt+=(-o APT::Architecture=arm64 -o APT::Architectures=arm64 -o Dir::State::Lists="$folder/lists"
          -o Dir::Cache::pkgcache= -o Dir::Cache::srcpkgcache= -o APT::Sandbox::User=root)
    (cd "$folder" && "${apt[@]}" update && "${apt[@]}" download check libsubunit-dev) || return 1
    for package in "$folder"/*.deb; do dpkg -x "$package" "$folder/root"; done
}

step_aarch64() {
    local folder=$project/build-aarch64
    say "aarch64: by a cross compiler, some tests on an emulator"
    if [[ $(uname -m) == aarch64 ]] || ! install_packages_if_offered "${packages_for_aarch64[@]}" ||
        ! command -v aarch64-linux-gnu-g++ >/dev/null || ! command -v qemu-aarch64-static >/dev/null ||
        ! unpack_check "$folder/check"; then
        echo "this is such a machine, or the compiler, the emulator or Check for it cannot be installed"
        left_out+=(aarch64)
        return
    fi
    local root=$folder/check/root rebuild=()
    cat >"$folder/check.ini" <<TXT
[properties]
sys_root = '$root'
pkg_config_libdir = '$root/usr/lib/aarch64-linux-gnu/pkgconfig'
TXT
    # Warnings stay warnings: which variables may be unset is another question for each machine's optimizer.
    configure "$folder/build" --cross-file "$project/presets/aarch64.ini" --cross-file "$folder/check.ini" \
        -Dauto_features=disabled -Dtests=enabled -Dscenes=enabled -Dopenmp=enabled || return 1
    SADMM_TEST_SHORT=1 run_tests aarch64/build certificate mesh query_ray rows
}

step_gpu() {
    local tool sanitizer
    sanitizer=$(command -v compute-sanitizer || echo /usr/local/cuda/bin/compute-sanitizer)
    [[ -x $sanitizer ]] || { echo "compute-sanitizer was not found"; return 1; }
    build cuda "${features[@]}" -Dcuda=enabled || return 1
    for tool in memcheck initcheck synccheck racecheck; do
        say "gpu: $tool"
        meson test -C "$project/build-cuda" --no-rebuild --suite gpu --no-suite slow --num-processes 4 --timeout-multiplier 20 \
            --logbase "gpu-$tool" --print-errorlogs --quiet --wrap "$sanitizer --tool $tool --error-exitcode 9" || true
        logs+=("$project/build-cuda/meson-logs/gpu-$tool-compute-sanitizer.json") # meson adds the wrapper
    done
}

for step in "${steps[@]}"; do
    started=$SECONDS
    if ! "step_$step"; then
        broken+=("$step")
        echo "step $step did not build"
    fi
    echo "step $step took $((SECONDS - started)) s"
done

say "Sum"
exec python3 "$project/scripts/sum_tests.py" --broken "${broken[*]}" --left-out "${left_out[*]}" --passed "${passed[*]}" "${logs[@]}"
