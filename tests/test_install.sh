#!/bin/sh
# The installed tree works for a user: pkg-config finds it, a program links with the shared and with the static library,
# in C and in C++, with its headers and with those of a later version, and runs; the shared library exports sadmm_
# symbols only and stays loaded.
# usage: test_install.sh BUILD_FOLDER PROGRAM.c
set -eu

build=$1
program=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

meson install -C "$build" --no-rebuild --quiet --destdir "$folder"

pc=$(find "$folder" -name subadmm.pc)
[ -n "$pc" ] || { echo "subadmm.pc was not installed"; exit 1; }
PKG_CONFIG_PATH=${pc%/*}
export PKG_CONFIG_PATH
version=$(pkg-config --modversion subadmm)
library=$(pkg-config --variable=libdir subadmm)

# link NAME COMPILER FLAGS...: compile the user's program and run it
link() {
    name=$1
    shift
    "$@" -o "$folder/$name"
    LD_LIBRARY_PATH=$library "$folder/$name" "$version" || { echo "the $name program failed"; exit 1; }
    echo "$name: works"
}

# The compilers and pkg-config's answers are lists of words.
# shellcheck disable=SC2046,SC2086
{
    flags="-Wall -Wextra -Werror $(pkg-config --cflags subadmm)"
    link shared_c ${CC:-cc} $flags -std=c11 "$program" $(pkg-config --libs subadmm)
    link shared_c++ ${CXX:-c++} $flags -std=c++17 -x c++ "$program" -x none $(pkg-config --libs subadmm)
    # Headers of a later version, with a member more in every struct that may grow (subadmm/status.h).
    cp -r "$(pkg-config --variable=includedir subadmm)" "$folder/later"
    for struct in settings world_def body_def shape_def joint_coordinate joint_def coupling_def gear_def hull_def \
        mesh_def heightfield_def mesh_file_def query_filter backend_info solve_report step_report mesh_file_info; do
        sed -i "s/^} sadmm_$struct;/    double later;\n&/" "$folder"/later/subadmm/*.h
        grep -q "^} sadmm_$struct;" "$folder"/later/subadmm/*.h || { echo "no header has sadmm_$struct"; exit 1; }
    done
    link later_c ${CC:-cc} -Wall -Wextra -Werror -I"$folder/later" -std=c11 "$program" $(pkg-config --libs subadmm)
    # As docs/guide/install.md says, with both libraries in one folder.
    link static_c ${CC:-cc} $flags -std=c11 "$program" \
        $(pkg-config --static --libs subadmm | sed 's/-lsubadmm/-l:libsubadmm.a/')
}
if ! readelf -d "$library/libsubadmm.so" | grep -q NODELETE; then
    echo "the shared library could be unloaded under its threads"
    exit 1
fi
if ldd "$folder/static_c" | grep -q libsubadmm; then
    echo "the static program needs the shared library"
    exit 1
fi
if ! nm "$folder/static_c" | grep -q ' [Tt] sadmm_problem_create$'; then
    echo "the static library is not in the program"
    exit 1
fi

foreign=$(nm -D --defined-only "$library/libsubadmm.so" | awk '$2 ~ /[TDBRVW]/ { print $3 }' | sed 's/@.*//' |
    grep -v '^sadmm_' || true)
if [ -n "$foreign" ]; then
    echo "the shared library exports what is not ours:"
    echo "$foreign" | head -20
    exit 1
fi
