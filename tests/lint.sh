#!/usr/bin/env bash
# Holds the sources to .clang-format and .clang-tidy: tests/lint.sh [FILE...]; without files, all of them. Ten minutes on two cores.
set -euo pipefail
. "$(dirname "$0")/../scenes/prepare.sh" programs
cd "$root"
install_packages clang-tidy
say "clang-format"
git ls-files -z '*.h' '*.cpp' | xargs -0 clang-format --dry-run --Werror
say "clang-tidy"
# Clang cannot read the build's precompiled headers.
cmake -G Ninja -S . -B build/tidy -Wno-dev -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DVOLCOMP_TESTS=OFF \
    -DVOLCOMP_BENCHMARKS=OFF >build/tidy.log
if [ $# -eq 0 ]; then set -- $(git ls-files "libvolcomp/*.cpp" "tools/*.cpp"); fi
printf '%s\0' "$@" | xargs -0 -n 1 -P "$(nproc)" clang-tidy --quiet -p build/tidy 2> >(grep -v 'warnings generated' >&2)
say "clean"
