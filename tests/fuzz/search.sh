#!/bin/sh
# usage: search.sh FUZZER CORPUS RUNS: that many inputs, the same ones every time. What it finds besides failures is not
# kept; an input that fails is, in the folder this is started in, as FUZZER-crash-*. (-entropic=0: weighing the features
# of the whole corpus costs more than these inputs do, and finds no more.)
set -eu
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
mkdir "$scratch/new"
status=0
"$1" -seed=1 -runs="$3" -entropic=0 -max_len=2048 -timeout=60 -rss_limit_mb=2048 -artifact_prefix="$(basename "$1")-" -print_final_stats=1 \
    "$scratch/new" "$2" >"$scratch/log" 2>&1 || status=1 # libFuzzer's own, 77, means to meson that the test was left out
tail -n 60 "$scratch/log"
exit $status
