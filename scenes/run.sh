#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Bakes the boxes of one scene and renders it from them: scenes/run.sh NAME [SIZE]
# makes out/NAME/NAME.exr and .png from scenes/NAME.toml; if NAME is in a folder (tutorial/2_comb),
# the picture has its last part (out/tutorial/2_comb/2_comb.exr). Installs and builds what is missing
# first. SIZE (WIDTHxHEIGHT) overrides the scene's picture size.
set -euo pipefail
scenes=$(cd "$(dirname "$0")" && pwd)

known() { (cd "$scenes" && ls ./*.toml tutorial/*.toml | sed -e 's|^\./||' -e 's|\.toml$||' | tr '\n' ' '); }
if [ $# -lt 1 ] || [ ! -f "$scenes/$1.toml" ]; then
    echo "usage: scenes/run.sh NAME [WIDTHxHEIGHT]; scenes: $(known)" >&2
    exit 2
fi
name=$1
picture=out/$name/$(basename "$name")
size=${2:+--size $2}

. "$scenes/prepare.sh" programs
out=$root/out/$name
mkdir -p "$out"
cd "$root"
maker=$name
case $name in tutorial/*) maker=hello ;; esac # which stands on the same ball
for script in "$scenes/$maker"/make_*.py; do
    [ -e "$script" ] || continue
    made=$root/out/$maker
    mkdir -p "$made"
    stamp=$made/.$(basename "$script").done
    if [ ! "$stamp" -nt "$script" ] || [ ! "$stamp" -nt "$scenes/making.py" ]; then
        say "making surfaces and maps ($(basename "$script"))"
        PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 "$script" "$made"
        touch "$stamp"
    fi
done
say "baking"
"$bin/volcomp-bake" "scenes/$name.toml" -o "out/$name/boxes" --stats "out/$name/bake.json"
say "rendering"
# shellcheck disable=SC2086
"$bin/volcomp-render" "scenes/$name.toml" --boxes "out/$name/boxes" $size -o "$picture.exr" -o "$picture.png" --stats "out/$name/render.json"
say "$picture.png and .exr are ready"
