#!/bin/sh
# A parent project gets the smallest library by the lines of docs/guide/install.md: they are taken from the page, and
# what they disable is not there.
# usage: test_subproject.sh SOURCE_FOLDER
set -eu

source=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

mkdir "$folder/subprojects"
ln -s "$source" "$folder/subprojects/subadmm"
cp "$source/tests/install_user.c" "$folder/main.c"
{
    echo "project('parent', 'c')"
    awk '/^```/ { inside = $0 == "```meson"; next } inside' "$source/docs/guide/install.md"
    echo "executable('parent', 'main.c', dependencies: subadmm_dep)"
} > "$folder/meson.build"
grep -q default_options "$folder/meson.build" || { echo "docs/guide/install.md has no lines for a subproject"; exit 1; }

meson setup "$folder/build" "$folder" > "$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
config=$folder/build/subprojects/subadmm/src/config.h
[ -s "$config" ] || { echo "$config was not made"; exit 1; }
if grep -E 'define SADMM_HAVE_(FCL|CUDA|HDF5|OPENMP)' "$config"; then
    echo "is there, although it was disabled"
    exit 1
fi
if ninja -C "$folder/build" -t targets all | grep '_LINKER$' | grep -v '^parent:\|/libsubadmm\|/examples/'; then
    echo "is built, although it was disabled"
    exit 1
fi
