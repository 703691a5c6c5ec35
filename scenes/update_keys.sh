#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Puts the parser's list of keys into scenes/README.md; tests/scene/scene_test.cpp checks that it
# stands there.
set -euo pipefail
cd "$(dirname "$0")"
keys=$(mktemp)
trap 'rm -f "$keys"' EXIT
"${1:-../build/release}/bin/volcomp-bake" --scene-keys >"$keys"
sed -i -e "/^<!-- keys:/r $keys" -e '/^<!-- keys:/,/^<!-- end of keys/{/^<!--/!d}' README.md
