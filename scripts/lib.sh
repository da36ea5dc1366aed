# shellcheck shell=bash
# What the scripts of this folder share: the project's folder, its packages, building and testing one configuration.

# shellcheck disable=SC2034 # used by the scripts that source this
project=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
jobs=${JOBS:-$(nproc)}

# Debian's and Ubuntu's names. "package=command": having the command is enough.
packages_to_run=(gcc=cc 'g++=c++' meson=meson ninja-build=ninja pkgconf=pkg-config libfcl-dev libqhull-dev libjansson-dev)
packages_to_test=("${packages_to_run[@]}" git=git libhdf5-dev check clang=clang libclang-rt-dev libomp-dev util-linux=setarch
                  python3-dev python3-venv)
packages_to_package=(gcc=cc 'g++=c++' pkgconf=pkg-config git=git binutils=size libqhull-dev libjansson-dev python3-dev
                     python3-venv)
packages_for_aarch64=(gcc-aarch64-linux-gnu g++-aarch64-linux-gnu qemu-user-static)
# Used where the release offers it.
packages_to_test_if_offered=(cmake=cmake libsiconos-numerics-dev python3-jsonschema chromium-headless-shell)

say() { printf '\n==> %s\n' "$*"; }
fail() { printf 'error: %s\n' "$*" >&2; exit 1; }

package_installed() { [[ $(dpkg-query -W -f='${Status}' "$1" 2>/dev/null) == 'install ok installed' ]]; }

# missing_packages ENTRY...: those that are not there, into the array `missing`
missing_packages() {
    local entry package command
    missing=()
    for entry in "$@"; do
        package=${entry%%=*} command=${entry#*=}
        if [[ $entry == *=* ]] && command -v "$command" >/dev/null; then continue; fi
        package_installed "$package" || missing+=("$package")
    done
}

# How to become root, into the array `as_root`; false if there is no way
become_root() {
    as_root=()
    ((EUID == 0)) && return
    as_root=(sudo -n)
    command -v sudo >/dev/null && sudo -n true 2>/dev/null
}

update_package_lists() {
    ${package_lists_updated:-false} && return
    "${as_root[@]}" apt-get update -qq
    package_lists_updated=true
}

# install_packages ENTRY...: install what is missing as root or by sudo without a password, or say what to install
install_packages() {
    local missing as_root
    if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
        echo "not Debian or Ubuntu: nothing is installed, these packages or their like must be there: ${*%%=*}"
        return
    fi
    missing_packages "$@"
    ((${#missing[@]})) || return 0
    become_root || fail "packages are missing, and this is neither root nor can it use sudo without a password. Run this as root, then try again:
    apt-get install ${missing[*]}"
    say "Installing ${missing[*]}"
    update_package_lists
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

# install_packages_if_offered ENTRY...: the same for those this release has; the others are named
install_packages_if_offered() {
    local package missing as_root
    command -v apt-cache >/dev/null || return 0
    missing_packages "$@"
    for package in "${missing[@]}"; do
        if become_root; then update_package_lists; fi
        if apt-cache show "$package" >/dev/null 2>&1; then
            install_packages "$package"
        else
            echo "this release has no package $package: what needs it is skipped"
        fi
    done
}

# configure FOLDER OPTION...: meson setup, or the same again in a folder that exists; quiet unless it fails
configure() {
    local folder=$1 output again=()
    shift
    [[ -f $folder/build.ninja ]] && again=(--reconfigure)
    output=$(meson setup "${again[@]}" "$folder" "$project" "$@" 2>&1) || { printf '%s\n' "$output"; return 1; }
}
