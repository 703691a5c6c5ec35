#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Fuzzes the readers of files: tests/fuzz.sh [SECONDS [NAME...]]. Builds the preset `fuzz`, then
# runs each fuzzer of tests/fuzz/ (or those named) for that many seconds (20 without it), from its
# corpus and from what earlier runs have found (build/fuzz/found/NAME). An input that crashes, takes
# more than 10 seconds or more than 2 GB is kept as build/fuzz/failed/NAME-*, and the exit status is
# 1. With RUNS=N in the environment each makes N runs with seed 1 instead, the same every time.
set -euo pipefail
. "$(dirname "$0")/../scenes/prepare.sh" none
cd "$root"
seconds=${1:-20}
shift || true
build fuzz fuzzers
mkdir -p build/fuzz/failed
if [ $# -eq 0 ]; then
    for source in tests/fuzz/*_fuzzer.cpp; do set -- "$@" "$(basename "$source" _fuzzer.cpp)"; done
fi
result=0
for name in "$@"; do
    mkdir -p "build/fuzz/found/$name"
    limit=(-max_total_time="$seconds")
    if [ -n "${RUNS:-}" ]; then limit=(-runs="$RUNS" -max_total_time="$((2 * seconds))"); fi
    say "fuzz: $name"
    log=build/fuzz/$name.log
    TMPDIR=${FUZZ_FOLDER:-/dev/shm} ASAN_OPTIONS=allocator_may_return_null=0:detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1 \
        "build/fuzz/bin/${name}_fuzzer" "build/fuzz/found/$name" "tests/fuzz/${name}_corpus" \
        -seed=1 "${limit[@]}" -timeout=10 -rss_limit_mb=2560 -print_final_stats=1 \
        -artifact_prefix="build/fuzz/failed/$name-" >"$log" 2>&1 || {
        result=1
        echo "$name failed:"
        grep -m 3 -E "ERROR|SUMMARY|Test unit written" "$log" || tail -5 "$log"
    }
    grep -E "^stat::(number_of_executed_units|peak_rss_mb)" "$log" || true
done
exit $result
