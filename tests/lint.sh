#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Holds the sources to .clang-format and .clang-tidy: tests/lint.sh [SOURCE...]; without arguments,
# all of them. Ten minutes on two cores the first time; then it looks only at what has changed.
set -euo pipefail
. "$(dirname "$0")/../scenes/prepare.sh" none
cd "$root"
say "clang-format"
result=0
git ls-files -z '*.h' '*.cpp' | xargs -0 clang-format --dry-run --Werror || result=1
say "clang-tidy"
# Without the precompiled header, which would make every source include all of OpenVDB.
cmake -G Ninja -S . -B build/tidy -Wno-dev -DCMAKE_CXX_COMPILER=clang++ \
    -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON \
    -DVOLCOMP_TESTS=OFF -DVOLCOMP_BENCHMARKS=OFF >build/tidy.log
if [ $# -eq 0 ]; then set -- $(git ls-files "libvolcomp/*.cpp" "tools/*.cpp"); fi
tests/clang_tidy.py build/tidy "$@" || result=1
exit $result
