#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the Debian package into a new Debian without anything else, and makes a small picture of
# a scene with what it holds: tests/package.sh FILE.deb. As root; needs mmdebstrap.
set -euo pipefail
deb=$(realpath "$1")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

fail() {
    echo "package.sh: $*" >&2
    exit 1
}
for field in Version Architecture Depends; do
    printf '%s: %s\n' $field "$(dpkg-deb -f "$deb" $field)"
done
for library in libopenvdb libgmp10 libtbb12 python3-numpy; do
    dpkg-deb -f "$deb" Depends | grep -q "$library" || fail "$library is not among the dependencies"
done
dpkg-deb -c "$deb" >"$work/files"
for file in usr/bin/volcomp{,-bake,-compose,-render,-chart} usr/share/man/man1/volcomp{,-render}.1.gz \
    usr/share/doc/volcomp/{copyright,NOTICE,LICENSE} usr/share/volcomp/scenes/run.sh; do
    grep -q " ./$file\$" "$work/files" || fail "the package has no $file"
done
if grep -E ' ./usr/(include|lib/.*\.a$)' "$work/files"; then fail "these belong to no user"; fi

cp "$deb" "$work/volcomp.deb"
cat >"$work/use.sh" <<'EOF'
set -e
apt-get install -y -qq --no-install-recommends /volcomp.deb >/install.log 2>&1 || {
    tail -20 /install.log
    exit 1
}
cp -r /usr/share/volcomp/scenes /root/scenes
/root/scenes/run.sh hello 32x24
test -s /root/out/hello/hello.png
volcomp-render --version
EOF
mmdebstrap --quiet --variant=apt --format=null \
    --customize-hook="copy-in $work/volcomp.deb $work/use.sh /" \
    --customize-hook='chroot "$1" sh /use.sh' \
    "$(. /etc/os-release && echo "$VERSION_CODENAME")" - http://deb.debian.org/debian
echo "installed, made a picture"
