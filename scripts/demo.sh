#!/usr/bin/env bash
# The first run: build the library and the command, then drop stacks of cubes for 5 s and certify every step.
set -euo pipefail
# shellcheck source=scripts/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

usage() {
    cat <<TXT
usage: scripts/demo.sh [--help] [ARGUMENT...]

Installs what is missing (Debian and Ubuntu, as root or by sudo without a password; else says what to install), builds into
build/ and runs
    subadmm run vertical_stacks --certify
for 5 s of simulated time, by the default method. Arguments are added to that command (--method paper: by the paper's
iteration; see: build/src/subadmm run --help).

JOBS=n  compile with n jobs instead of all cores
TXT
}
if [[ ${1:-} == --help || ${1:-} == -h ]]; then
    usage
    exit
fi

install_packages "${packages_to_run[@]}"

say "Building into build/"
configure "$project/build" -Dcli=enabled
ninja -C "$project/build" -j "$jobs" --quiet src/subadmm

say "subadmm run vertical_stacks --certify $*"
exec "$project/build/src/subadmm" run vertical_stacks --certify "$@"
