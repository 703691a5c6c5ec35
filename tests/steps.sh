# SPDX-License-Identifier: Apache-2.0
# Sourced by .ci/run and tests/full.sh: runs steps one after another, times them and counts.
. "$(dirname "${BASH_SOURCE[0]}")/../scenes/prepare.sh" none
cd "$root"
passed=0 failed=0 skipped=0
table=()
export CCACHE_STATSLOG=$root/build/ccache.log # of these steps alone
rm -f "$CCACHE_STATSLOG"

# Sets cpu to the seconds of all the processes that this shell has waited for. In a $( ) the shell
# would be another one.
count_cpu() {
    times >build/times
    cpu=$(awk 'NR == 2 {gsub(/[ms]/, " "); printf "%.0f", ($1 + $3) * 60 + $2 + $4}' build/times)
}

# step NAME COMMAND...: prints the name, runs the command, and prints how long it took. The next
# step runs after a failure too. Tests count one by one (run_tests), any other step as one.
step() {
    local name=$1 wall=$SECONDS result p f s cpu cpu_before
    shift
    count_cpu
    cpu_before=$cpu
    say "$name"
    rm -f build/counts
    set +e # bash ignores `set -e` inside a condition, so the command must not be in one
    (set -e && "$@")
    result=$?
    set -e
    read -r p f s < <(cat build/counts 2>/dev/null || echo $((result == 0)) $((result != 0)) 0)
    if [ $result -ne 0 ] && [ "$f" -eq 0 ]; then f=1; fi
    passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
    if [ $result -eq 0 ]; then result=passed; else result=FAILED; fi
    count_cpu
    table+=("$(printf '%-30s %s %6d s %7d CPU s' "$name" $result \
        $((SECONDS - wall)) $((cpu - cpu_before)))")
    say "${table[-1]}"
}

# run_tests PRESET [ctest arguments]: runs the tests of a preset's build and counts them for step().
run_tests() {
    local log=build/$1/ctest.log result=0
    ctest --preset "$1" -j "$(nproc)" --no-tests=error "${@:2}" | tee "$log" || result=$?
    awk '/tests passed, .* tests failed out of/ {failed = $4; all = $NF}
         /^[ \t]*[0-9]+ - .* \(Skipped\)$/ {skipped++}
         END {if (all) print all - failed - skipped, failed + 0, skipped + 0}' "$log" >build/counts
    [ -s build/counts ] || rm build/counts
    return $result
}

# The tests of a ThreadSanitizer build, with a TBB that is instrumented too. volcomp-chart starts
# vdb_render, which cannot load that TBB; Embree, in the truth and under skins, is not instrumented.
run_tests_with_tsan() {
    local tbb
    tbb=$(tests/tbb_for_tsan.sh)
    LD_LIBRARY_PATH=$tbb/lib run_tests tsan -E "^(tools\.(chart_program|truth|skin_program|groom_program)|render\.(skin\.|sky\.openness|soft_lights|haze_picture))" "$@"
}

# Prints the table of the steps and the closing line, and exits with 1 if anything failed.
finish() {
    say "all steps"
    printf '%s\n' "${table[@]}"
    if [ -s "$CCACHE_STATSLOG" ]; then ccache --show-log-stats | head -4; fi
    echo "$passed passed, $failed failed, $skipped skipped"
    exit $((failed != 0))
}
