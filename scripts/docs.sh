#!/usr/bin/env bash
# The documents as web pages: the guide, the internals, and the reference made from the headers and the docstrings.
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

usage() {
    cat <<TXT
usage: scripts/docs.sh [--python PROGRAM] [--help]

Writes build-docs/html/index.html. Warnings are errors. Needs Doxygen (installed where that is possible, as by
scripts/test.sh) and Sphinx, Breathe and MyST, which go into an environment of its own, build-docs/environment. Exit status
77: these cannot be installed here.

--python PROGRAM  a Python with the package installed, whose docstrings are taken (default: build-python's, which
                  scripts/test.sh --only python makes; without one the Python reference is left out)
TXT
}

python=$project/build-python/environment/bin/python
while (($#)); do
    case $1 in
        --python) python=${2:?--python needs a program}; shift ;;
        --help | -h) usage; exit ;;
        *) usage >&2; fail "unknown argument $1" ;;
    esac
    shift
done

(install_packages doxygen=doxygen python3-venv) && command -v doxygen >/dev/null || exit 77
out=$project/build-docs
source=$out/source
mkdir -p "$out"
if [[ ! -x $out/environment/bin/sphinx-build ]]; then
    python3 -m venv "$out/environment"
    "$out/environment/bin/pip" install --quiet --disable-pip-version-check sphinx breathe myst-parser || {
        rm -rf "$out/environment"
        exit 77
    }
fi

say "Doxygen: the public headers"
rm -rf "$source" "$out/doxygen"
mkdir -p "$source/reference"
doxygen - <<TXT
PROJECT_NAME = subadmm
INPUT = $project/include/subadmm
FILE_PATTERNS = *.h
INPUT_FILTER = "python3 $project/docs/reference/filter.py"
OUTPUT_DIRECTORY = $out/doxygen
GENERATE_HTML = NO
GENERATE_LATEX = NO
GENERATE_XML = YES
XML_PROGRAMLISTING = NO
OPTIMIZE_OUTPUT_FOR_C = YES
EXTRACT_ALL = YES
EXTRACT_STATIC = YES
MARKDOWN_SUPPORT = NO
AUTOLINK_SUPPORT = NO
MACRO_EXPANSION = YES
EXPAND_ONLY_PREDEF = YES
PREDEFINED = SADMM_API=
QUIET = YES
WARN_AS_ERROR = YES
TXT

say "Sphinx: the pages"
cp "$project/docs/reference/conf.py" "$source/"
cp -r "$project/docs/." "$source/"
headers=()
for header in "$project"/include/subadmm/*.h; do
    name=$(basename "$header" .h)
    headers+=("$name")
    printf '# %s.h\n\n```{doxygenfile} %s.h\n```\n' "$name" "$name" >"$source/reference/$name.md"
done
with_python=false
if [[ -x $python ]] && (cd / && "$python" -c 'import subadmm') 2>/dev/null; then
    with_python=true
    printf '# Python\n\n```{automodule} subadmm\n:members:\n:undoc-members:\n:imported-members:\n```\n' >"$source/reference/python.md"
fi
{
    printf '# subadmm\n\n```{toctree}\n:maxdepth: 2\n:caption: Guide\n'
    (cd "$source" && ls guide/index.md guide/*.md | awk '!seen[$0]++ {sub(/\.md$/, ""); print}')
    printf '```\n\n```{toctree}\n:maxdepth: 1\n:caption: Reference\n'
    printf 'reference/%s\n' "${headers[@]}"
    $with_python && printf 'reference/python\n'
    printf '```\n\n```{toctree}\n:maxdepth: 1\n:caption: Internals\n'
    (cd "$source" && ls internals/*.md 2>/dev/null | sed 's/\.md$//' || true)
    printf '```\n'
} >"$source/index.md"
runner=("$out/environment/bin/python")
path=
if $with_python; then path=$(cd / && "$python" -c 'import os, subadmm; print(os.path.dirname(os.path.dirname(subadmm.__file__)))'); fi
SUBADMM_DOXYGEN_XML=$out/doxygen/xml PYTHONPATH=$path "${runner[@]}" -m sphinx -W --keep-going -q -b html "$source" "$out/html"
$with_python || echo "no Python with the package was found: the Python reference is left out"
say "build-docs/html/index.html"
