#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds oneTBB with ThreadSanitizer's instrumentation and prints the folder that it is installed
# in: tests/tbb_for_tsan.sh. ThreadSanitizer cannot see the synchronisation inside a TBB that is not
# instrumented, and reports races that do not exist.
#
# The sources are those of the installed package, libtbb-dev, from Debian's source package. The
# result is kept in ~/.cache/volcomp (or below XDG_CACHE_HOME), one folder for each version.
set -euo pipefail
version=$(dpkg-query -W -f '${source:Version}' libtbb-dev)
package=$(dpkg-query -W -f '${source:Package}' libtbb-dev)
cache=${XDG_CACHE_HOME:-$HOME/.cache}/volcomp
installed=$cache/tbb-tsan-${version//[^0-9A-Za-z.+-]/_}
if [ -f "$installed/complete" ]; then
    echo "$installed"
    exit
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
{
    # The machine's own lists of packages often lack the sources, so these are lists for this build
    # alone.
    . /etc/os-release
    mkdir -p lists/partial parts archives/partial
    cat >parts/sources.sources <<EOF
Types: deb-src
URIs: http://deb.debian.org/debian
Suites: $VERSION_CODENAME $VERSION_CODENAME-updates
Components: main
Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg
EOF
    options=(-q -o Dir::Etc::SourceList=/dev/null -o "Dir::Etc::SourceParts=$work/parts"
             -o "Dir::State::Lists=$work/lists" -o "Dir::Cache=$work" -o APT::Sandbox::User=root)
    apt-get "${options[@]}" update
    apt-get "${options[@]}" source "$package=$version"
    cmake -G Ninja -S "$package"-*/ -B build -DTBB_SANITIZE=thread -DTBB_TEST=OFF \
        -DTBB_STRICT=OFF -DTBBMALLOC_BUILD=OFF -DCMAKE_BUILD_TYPE=RelWithDebInfo \
        -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O2 -g1" -DCMAKE_INSTALL_PREFIX="$work/prefix"
    cmake --build build
    cmake --install build
    touch prefix/complete
} >"$work/log" 2>&1 || {
    tail -30 "$work/log" >&2
    echo "tbb_for_tsan.sh: $package $version could not be built" >&2
    exit 1
}
mkdir -p "$cache"
rm -rf "$installed"
mv "$work/prefix" "$installed"
echo "$installed"
