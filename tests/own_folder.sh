#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Checks that in_own_folder.sh, which runs this script as the others, closes what it says:
# tests/own_folder.sh SOURCE BUILD. Exits with 77 (skipped) if the system allows no mount
# namespaces.
set -u
wrong=0
can_write() {
    local file=$1/own_folder.$$
    (: >"$file") 2>/dev/null && rm -f "$file"
}
for folder in "$PWD" "$HOME" "$TMPDIR" "$TEST_TMPDIR" "$2/failed"; do
    can_write "$folder" || { echo "a test cannot write into $folder"; wrong=1; }
done
for variable in HOME TMPDIR TEST_TMPDIR PWD; do
    if [ "${!variable}" != "$2/test_folders/own_folder" ]; then
        echo "$variable is ${!variable}"
        wrong=1
    fi
done
open=()
closed=0
for folder in "$1" "$1/tests" "$2" "$2/bin" /tmp /var/tmp; do
    if can_write "$folder"; then open+=("$folder"); else closed=$((closed + 1)); fi
done
if [ $wrong -eq 0 ] && [ $closed -eq 0 ]; then
    echo "skipped: this system allows no mount namespaces, so that tests could write anywhere"
    exit 77
fi
for folder in ${open[@]+"${open[@]}"}; do
    echo "a test can write into $folder"
    wrong=1
done
exit $wrong
