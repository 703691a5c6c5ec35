#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Fuzzes the readers of files, with Clang's libFuzzer and sanitizers (the preset `asan`):
#
#     tests/fuzz.sh SECONDS [NAME...]    each fuzzer of tests/fuzz/, or those named, that long
#     tests/fuzz.sh runs                 each with a fixed number of runs, the same ones every time:
#                                        about 20 seconds
#
# A fuzzer begins with its corpus and, if it is given seconds, with what earlier runs have found
# (build/fuzz/found/NAME). An input that crashes, takes more than 10 seconds or more than 2.5 GB is
# kept as build/fuzz/failed/NAME-*, and the exit status is 1.
set -euo pipefail
. "$(dirname "$0")/../scenes/prepare.sh" none
cd "$root"
declare -A runs=([checkpoint]=50000 [curves]=30000 [image]=8000 [mesh]=200000 [places]=60000 [scene]=60000 [vdb]=15000)

how=${1:-runs}
shift || true
build asan fuzzers
scratch=${TMPDIR:-/tmp} # in memory if possible: each run writes a file
if [ -w /dev/shm ]; then scratch=/dev/shm; fi
mkdir -p build/fuzz/failed
if [ $# -eq 0 ]; then set -- "${!runs[@]}"; fi
result=0
for name in "$@"; do
    # libFuzzer writes what it finds into the first folder that it is given.
    found=build/fuzz/found/$name
    options=(-max_total_time="$how")
    if [ "$how" = runs ]; then
        found=build/fuzz/once/$name
        rm -rf "$found"
        options=(-runs="${runs[$name]}" -seed=1)
    fi
    mkdir -p "$found"
    say "fuzz: $name"
    log=build/fuzz/$name.log
    TMPDIR=$scratch ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1 \
        "build/asan/bin/${name}_fuzzer" "${options[@]}" "$found" "tests/fuzz/${name}_corpus" \
        -timeout=10 -rss_limit_mb=2560 -print_final_stats=1 \
        -artifact_prefix="build/fuzz/failed/$name-" >"$log" 2>&1 || {
        result=1
        echo "$name failed:"
        grep -m 3 -E "ERROR|SUMMARY|Test unit written" "$log" || tail -5 "$log"
    }
    grep -E "^stat::(number_of_executed_units|peak_rss_mb)" "$log" || true
done
exit $result
