#!/bin/sh
# CMake finds an installed library, which may have been moved, and links its shared and its static form; and it builds
# the library as a part of another project, by the lines of docs/guide/install.md, or alone.
# usage: test_cmake.sh installed BUILD_FOLDER SOURCE_FOLDER | test_cmake.sh part SOURCE_FOLDER
# Exit status 77: there is no CMake here.
set -eu

command -v cmake >/dev/null || { echo "there is no CMake here"; exit 77; }
mode=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# The compilers are lists of words that Meson chose, with a cache in front: CMake has a variable for that.
launcher=
for word in ${CC:-cc}; do
    case $word in
        *ccache) launcher=$word ;;
        *) break ;;
    esac
done
CC=${CC:-cc}
CC=${CC#"$launcher "}
export CC
CXX=${CXX:-c++}
CXX=${CXX#"$launcher "}
export CXX
[ -z "$launcher" ] || export CMAKE_C_COMPILER_LAUNCHER="$launcher"

# quietly COMMAND...: what it says is shown when it fails
quietly() {
    "$@" > "$folder/log" 2>&1 || { cat "$folder/log"; echo "failed: $*"; exit 1; }
}

# The lines of the guide that have a text in them.
lines_with() {
    awk -v wanted="$1" '/^```/ { if (inside && index(block, wanted)) printf "%s", block
                                 inside = $0 == "```cmake"; block = ""; next }
                        inside { block = block $0 "\n" }' "$source/docs/guide/install.md"
}

# refuse FILE PATTERN
refuse() {
    if grep -n "$2" "$1"; then echo "$1 should not have this"; exit 1; fi
}

if [ "$mode" = installed ]; then
    build=$2
    source=$3
    meson install -C "$build" --no-rebuild --quiet --destdir "$folder/first"
    config=$(find "$folder/first" -name subadmm-config.cmake)
    [ -n "$config" ] || { echo "subadmm-config.cmake was not installed"; exit 1; }
    refuse "$config" "$folder"
    mv "$folder/first" "$folder/moved"
    config=$(find "$folder/moved" -name subadmm-config.cmake)
    libraries=${config%/cmake/subadmm/subadmm-config.cmake}
    version=$(PKG_CONFIG_PATH=$libraries/pkgconfig pkg-config --modversion subadmm)

    mkdir "$folder/user"
    cp "$source/tests/install_user.c" "$folder/user/main.c"
    cp "$source/tests/install_user.c" "$folder/user/main.cpp"
    {
        echo 'cmake_minimum_required(VERSION 3.16)'
        echo 'project(user C CXX)'
        echo 'add_executable(program main.c)'
        lines_with find_package
        echo 'add_executable(program_cpp main.cpp)'
        echo 'target_link_libraries(program_cpp PRIVATE subadmm::subadmm)'
        echo 'add_executable(program_static main.c)'
        echo 'target_link_libraries(program_static PRIVATE subadmm::static)'
    } > "$folder/user/CMakeLists.txt"
    grep -q find_package "$folder/user/CMakeLists.txt" || { echo "docs/guide/install.md has no find_package"; exit 1; }
    quietly cmake -S "$folder/user" -B "$folder/user/build" -Dsubadmm_DIR="${config%/*}"
    quietly cmake --build "$folder/user/build"
    for program in program program_cpp program_static; do
        "$folder/user/build/$program" "$version" || { echo "$program failed"; exit 1; }
        echo "$program: works"
    done
    if ldd "$folder/user/build/program_static" | grep -q libsubadmm; then
        echo "the static program needs the shared library"
        exit 1
    fi
    # A later version than this one is not here, and no other major version is.
    for wanted in 0.99 1.0; do
        sed "s/(subadmm 0[.]1 /(subadmm $wanted /" "$folder/user/CMakeLists.txt" > "$folder/CMakeLists.txt"
        if cmake -S "$folder" -B "$folder/other" -Dsubadmm_DIR="${config%/*}" > "$folder/log" 2>&1; then
            echo "version $wanted was found"
            exit 1
        fi
        grep -q "requested version \"$wanted\"" "$folder/log" || { cat "$folder/log"; exit 1; }
    done
    exit 0
fi

source=$2
version=$(sed -n "s/^    version: '\(.*\)',/\1/p" "$source/meson.build")
mkdir "$folder/user"
cp "$source/tests/install_user.c" "$folder/user/main.c"
{
    echo 'cmake_minimum_required(VERSION 3.16)'
    echo 'project(user C)'
    echo 'add_executable(program main.c)'
    lines_with FetchContent
} > "$folder/user/CMakeLists.txt"
grep -q FetchContent_Declare "$folder/user/CMakeLists.txt" || { echo "docs/guide/install.md has no FetchContent"; exit 1; }
# Without the optimizer: nothing here takes long to run.
quietly cmake -S "$folder/user" -B "$folder/user/build" -DFETCHCONTENT_SOURCE_DIR_SUBADMM="$source" \
    -DSUBADMM_CPU_ISAS=baseline -DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_FLAGS=-O0
quietly cmake --build "$folder/user/build" --parallel "${JOBS:-2}"
"$folder/user/build/program" "$version" || { echo "the program failed"; exit 1; }
echo "part of a project: works"

# Alone, shared, installed, and found.
quietly cmake -S "$source" -B "$folder/build" -DSUBADMM_CPU_ISAS=baseline -DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_FLAGS=-O0 \
    -DBUILD_SHARED_LIBS=ON -DCMAKE_INSTALL_PREFIX="$folder/installed"
quietly cmake --build "$folder/build" --parallel "${JOBS:-2}"
quietly cmake --install "$folder/build"
foreign=$(nm -D --defined-only "$(find "$folder/installed" -name libsubadmm.so)" |
    awk '$2 ~ /[TDBRVW]/ { print $3 }' | grep -v '^sadmm_' || true)
[ -z "$foreign" ] || { echo "the shared library exports what is not ours: $foreign"; exit 1; }
{
    echo 'cmake_minimum_required(VERSION 3.16)'
    echo 'project(user C)'
    echo 'add_executable(program main.c)'
    lines_with find_package
} > "$folder/user/CMakeLists.txt"
quietly cmake -S "$folder/user" -B "$folder/user/found" -DCMAKE_PREFIX_PATH="$folder/installed"
quietly cmake --build "$folder/user/found"
"$folder/user/found/program" "$version" || { echo "the program with the installed library failed"; exit 1; }
echo "installed by CMake: works"
