#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs every test of the release build: tests/run.sh [ctest arguments], for example -L quick.
# Installs and builds what is missing first.
set -euo pipefail
. "$(dirname "$0")/../scenes/prepare.sh" all
say "testing"
exec ctest --test-dir "$root/build/release" --output-on-failure -j "$(nproc)" "$@"
