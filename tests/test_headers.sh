#!/bin/sh
# Every public header compiles alone, as strict C11 and as C++17, without a warning; and every header in the folder is
# in the list that gets installed.
# usage: test_headers.sh INCLUDE_FOLDER INSTALLED_HEADER...
set -eu

include=$1
shift
failed=0

for header in "$include"/subadmm/*.h; do
    name=${header##*/}
    case " $* " in
        *"/$name "*) ;;
        *) echo "$name: not in include/subadmm/meson.build, so it would not be installed"; failed=1 ;;
    esac
    # Twice: the include guard is part of it.
    printf '#include "subadmm/%s"\n#include "subadmm/%s"\n' "$name" "$name" >"${TMPDIR:-/tmp}/header_$$.txt"
    for language in 'c -std=c11 -Wstrict-prototypes' 'c++ -std=c++17'; do
        case $language in
            c++*) compiler=${CXX:-c++} ;;
            *) compiler=${CC:-cc} ;;
        esac
        # shellcheck disable=SC2086 # compiler and language are lists of words
        if ! $compiler -x $language -Wall -Wextra -Wpedantic -Werror -fsyntax-only -I"$include" \
            "${TMPDIR:-/tmp}/header_$$.txt"; then
            echo "$name: not clean as $language"
            failed=1
        fi
    done
    rm -f "${TMPDIR:-/tmp}/header_$$.txt"
done
exit $failed
