#!/bin/sh
# Measures convergence: docs/convergence.csv, the tables on standard output and, where Python has matplotlib, the
# pictures.
#
#     bench/convergence.sh BUILD [options of subadmm-bench convergence]
#
# BUILD is a build folder with bench/subadmm-bench. With `--backend cuda` as the first option the rows
# go to docs/convergence_cuda.csv. The pictures show all that was measured. PYTHON names the interpreter (default
# python3).
set -eu

build=${1:?usage: bench/convergence.sh BUILD [options of subadmm-bench convergence]}
shift
docs=$(dirname "$0")/../docs
name=convergence
[ "${1:-} ${2:-}" != "--backend cuda" ] || name=convergence_cuda

"$build/bench/subadmm-bench" convergence --csv "$docs/$name.csv" "$@"
set -- "$docs/convergence.csv"
[ ! -f "$docs/convergence_cuda.csv" ] || set -- "$@" "$docs/convergence_cuda.csv"
"${PYTHON:-python3}" "$(dirname "$0")/plot_convergence.py" "$@" "$docs/convergence" ||
    echo "convergence.sh: no pictures" >&2
