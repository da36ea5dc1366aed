#!/bin/sh
# Regenerate the tables of docs/convergence.md, docs/convergence.csv and, where Python has matplotlib, the pictures.
#
#     bench/convergence.sh BUILD [options of subadmm-bench convergence]
#
# BUILD is a build folder with bench/subadmm-bench. The document's text stays: only what stands between its marks is
# replaced. With `--backend cuda` as the first option the rows go to docs/convergence_cuda.csv, and the tables between the
# marks of that backend. The pictures show all that was measured. PYTHON names the interpreter (default python3).
set -eu

build=${1:?usage: bench/convergence.sh BUILD [options of subadmm-bench convergence]}
shift
docs=$(dirname "$0")/../docs
name=convergence
[ "${1:-} ${2:-}" != "--backend cuda" ] || name=convergence_cuda
tables=$(mktemp)
page=$(mktemp)
trap 'rm -f "$tables" "$page"' EXIT

"$build/bench/subadmm-bench" convergence --csv "$docs/$name.csv" "$@" >"$tables"
awk -v tables="$tables" -v name="$name" '
    /^<!-- / && /: end/ { inside = 0 }
    !inside { print }
    $0 ~ "^<!-- " name ": begin" { inside = 1; print ""; while ((getline line < tables) > 0) print line }
' "$docs/convergence.md" >"$page"
cat "$page" >"$docs/convergence.md"
set -- "$docs/convergence.csv"
[ ! -f "$docs/convergence_cuda.csv" ] || set -- "$@" "$docs/convergence_cuda.csv"
"${PYTHON:-python3}" "$(dirname "$0")/plot_convergence.py" "$@" "$docs/convergence" ||
    echo "convergence.sh: no pictures" >&2
