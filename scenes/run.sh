#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes the picture of one scene, or what of it is out of date: scenes/run.sh NAME [OPTION...]
# makes out/NAME/NAME.exr and .png from scenes/NAME.toml; if NAME is in a folder (tutorial/2_comb),
# the picture has its last part (out/tutorial/2_comb/2_comb.exr). Installs and builds what is missing
# first, and makes the scene's surfaces and maps. The options are those of volcomp, such as
# --size 320x240; a size may stand alone.
set -euo pipefail
scenes=$(cd "$(dirname "$0")" && pwd)

known() { (cd "$scenes" && ls ./*.toml tutorial/*.toml | sed -e 's|^\./||' -e 's|\.toml$||' | tr '\n' ' '); }
if [ $# -lt 1 ] || [ ! -f "$scenes/$1.toml" ]; then
    echo "usage: scenes/run.sh NAME [OPTION...]; scenes: $(known)" >&2
    exit 2
fi
name=$1
shift
case ${1:-} in [0-9]*x[0-9]*) set -- --size "$@" ;; esac

. "$scenes/prepare.sh" programs
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
"$bin/volcomp" "scenes/$name.toml" -o "out/$name" "$@"
