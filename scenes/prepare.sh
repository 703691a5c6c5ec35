# SPDX-License-Identifier: Apache-2.0
# Sourced by scenes/run.sh and the scripts in tests/: installs what is missing (apt) and builds.
# Quick if there is nothing to do. Sets $root and $bin. Its argument is the target of the release
# preset to build, or `none`. In a copy of scenes/ without the sources around it, the installed
# programs are used.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
bin=$root/build/release/bin

say() { printf '== %s\n' "$*"; }

# install_packages [PACKAGE...]: those of packages.txt and the arguments.
install_packages() {
    local wanted missing sudo=()
    mapfile -t wanted < <(
        sed -e 's/#.*//' -e 's/[[:space:]]*$//' -e '/^$/d' "$root/packages.txt"
        if [ $# -gt 0 ]; then printf '%s\n' "$@"; fi)
    mapfile -t missing < <(
        comm -23 <(printf '%s\n' "${wanted[@]}" | sort -u) \
                 <(dpkg-query -W -f='${db:Status-Abbrev} ${Package}\n' 2>/dev/null |
                   awk '$1 == "ii" {print $2}' | sort -u))
    if [ ${#missing[@]} -eq 0 ]; then return; fi
    say "installing ${missing[*]}"
    if [ "$(id -u)" -ne 0 ]; then
        if ! command -v sudo >/dev/null; then
            echo "prepare.sh: these packages are missing and there is no sudo to install them with;" \
                "as root: apt-get install ${missing[*]}" >&2
            return 1
        fi
        sudo=(sudo)
    fi
    "${sudo[@]}" apt-get update -qq
    "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends "${missing[@]}" >"$root/build/apt.log" 2>&1 || {
        tail -20 "$root/build/apt.log" >&2
        return 1
    }
}

# build PRESET [TARGET...]: configures if that was not done before, and builds.
build() {
    local preset=$1 log=$root/build/configure_$1.log
    shift
    if [ ! -f "$root/build/$preset/build.ninja" ]; then
        (cd "$root" && cmake --preset "$preset" -Wno-dev >"$log" 2>&1) || {
            cat "$log" >&2
            return 1
        }
    fi
    cmake --build "$root/build/$preset" --target "${@:-all}" -- --quiet
}

if [ -f "$root/CMakeLists.txt" ]; then
    mkdir -p "$root/build"
    install_packages
    if [ "${1:-all}" != none ]; then
        say "building (build/release)"
        build release "${1:-all}"
    fi
elif bin=$(command -v volcomp-bake); then
    bin=$(dirname "$bin")
else
    echo "prepare.sh: expected volcomp's sources around $root/scenes or volcomp-bake on the PATH," \
        "found neither; install the package" >&2
    exit 1
fi
