#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Writes the pictures of this folder anew: tests/pictures/renew.sh [BUILD] [NAME...]
# with the programs of the build folder BUILD (build/release if it is not given); all pictures if
# there is no NAME. Look at the failed test's pictures first, and commit the new ones alone.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=${1:-$here/../../build/release}
shift || true
exec /usr/bin/python3 "$here/pictures.py" renew "$build/bin" "$@"
