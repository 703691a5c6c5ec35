#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Holds the scenes to the JSON Schema that volcomp prints, with taplo: schema.sh SOURCE VOLCOMP.
# Exits with 77 if taplo is not there and cannot be had. Works in the current folder.
set -euo pipefail
source=$1 volcomp=$2

fail() {
    echo "schema.sh: $*" >&2
    exit 1
}

taplo=$(command -v taplo || true)
if [ -z "$taplo" ]; then
    { /usr/bin/python3 -m venv taplo &&
        taplo/bin/pip --quiet --disable-pip-version-check --retries 1 --timeout 20 install taplo==0.9.3; } \
        >pip.log 2>&1 || {
        tail -3 pip.log
        echo "schema.sh: taplo could not be had"
        exit 77
    }
    taplo=$PWD/taplo/bin/taplo
fi
"$volcomp" --schema >schema.json
check() { "$taplo" check --no-auto-config --schema "file://$PWD/schema.json" "$@" >check.log 2>&1; }

mapfile -t scenes < <(find "$source/scenes" -name '*.toml')
[ ${#scenes[@]} -gt 20 ] || fail "expected more scenes than ${#scenes[@]} in $source/scenes"
check "${scenes[@]}" || {
    cat check.log
    fail "a scene is against the schema"
}
# refused FROM TO: hello.toml with this change is refused.
refused() {
    sed "s/$1/$2/" "$source/scenes/hello.toml" >wrong.toml
    ! cmp -s wrong.toml "$source/scenes/hello.toml" || fail "nothing of hello.toml is '$1'"
    if check wrong.toml; then fail "'$2' instead of '$1' passes"; fi
}
refused 'density =' 'densty ='
refused 'samples = 4' 'samples = 0'
refused 'shadows = "sweep"' 'shadows = "swept"'
refused 'zenith = \[0.45, 0.53, 0.65\]' 'zenith = [0.45, 0.53]'
echo "${#scenes[@]} scenes are as the schema says"
