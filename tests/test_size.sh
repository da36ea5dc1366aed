#!/bin/sh
# The smallest library: how large it is, that it needs libc alone, and that a program works with it.
# usage: test_size.sh SOURCE_FOLDER
set -eu

source=$1
most=1500000 # bytes on x86-64, as docs/guide/install.md says
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# quietly COMMAND...: what it says is shown when it fails
quietly() {
    "$@" > "$folder/log" 2>&1 || { cat "$folder/log"; echo "failed: $*"; exit 1; }
}

# The command of the page, in a folder of ours.
setup=$(sed -n 's/^meson setup build \(--buildtype=minsize.*\)/\1/p' "$source/docs/guide/install.md")
[ -n "$setup" ] || { echo "docs/guide/install.md has no command for the smallest library"; exit 1; }
# shellcheck disable=SC2086 # its options are words
quietly meson setup "$folder/build" "$source" $setup
quietly meson compile -C "$folder/build" -j "${JOBS:-2}"
quietly meson install -C "$folder/build" --no-rebuild --strip --destdir "$folder/installed"

library=$(find "$folder/installed" -name 'libsubadmm.so.*.*')
bytes=$(stat -c %s "$library")
echo "the smallest library has $bytes bytes"
if [ "$(uname -m)" = x86_64 ] && [ "$bytes" -gt "$most" ]; then
    echo "that is more than $most"
    exit 1
fi
if readelf -d "$library" | grep NEEDED | grep -v '\[lib[cm][.]so\|\[ld-linux'; then
    echo "it needs more than libc"
    exit 1
fi
headers=$(find "$folder/installed" -type d -path '*/include/subadmm')
version=$(sed -n "s/^    version: '\(.*\)',/\1/p" "$source/meson.build")
${CC:-cc} -I"${headers%/subadmm}" -o "$folder/program" "$source/tests/install_user.c" -L"${library%/*}" -lsubadmm
LD_LIBRARY_PATH=${library%/*} "$folder/program" "$version" || { echo "the program failed"; exit 1; }
