#!/bin/sh
# Regenerate the tables of docs/convergence.md, docs/convergence.csv and, where Python has matplotlib, the pictures.
#
#     bench/convergence.sh BUILD [options of subadmm-bench convergence]
#
# BUILD is a build folder with bench/subadmm-bench. The document's text stays: only what stands between its two marks is
# replaced. PYTHON names the interpreter (default python3).
set -eu

build=${1:?usage: bench/convergence.sh BUILD [options of subadmm-bench convergence]}
shift
docs=$(dirname "$0")/../docs
tables=$(mktemp)
page=$(mktemp)
trap 'rm -f "$tables" "$page"' EXIT

"$build/bench/subadmm-bench" convergence --csv "$docs/convergence.csv" "$@" >"$tables"
awk -v tables="$tables" '
    /^<!-- tables: end/ { inside = 0 }
    !inside { print }
    /^<!-- tables: begin/ { inside = 1; print ""; while ((getline line < tables) > 0) print line }
' "$docs/convergence.md" >"$page"
cat "$page" >"$docs/convergence.md"
"${PYTHON:-python3}" "$(dirname "$0")/plot_convergence.py" "$docs/convergence.csv" "$docs/convergence" ||
    echo "convergence.sh: no pictures" >&2
