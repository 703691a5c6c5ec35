#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs a test in a folder of its own: tests/in_own_folder.sh BUILD NAME COMMAND...
#
# The folder is BUILD/test_folders/NAME. It is the test's working directory, its HOME and its TMPDIR,
# and is removed if the test passes. All else is read-only to the test (the sources, BUILD, the home,
# /tmp and /var/tmp), except BUILD/failed, where a test leaves what a person should look at. That
# needs mount namespaces. If the system does not allow them, the test runs without them; the test
# called own_folder says whether it does. If VOLCOMP_OPEN_BUILD is set, BUILD is open too: programs
# built with --coverage write what they count there.
set -euo pipefail
build=$1 name=$2
shift 2
source=$(cd "$(dirname "$0")/.." && pwd)
folder=$build/test_folders/$name
rm -rf "$folder"
mkdir -p "$folder" "$build/failed"
# In this order, since a folder hides what was mounted inside it before.
export CLOSED_FOLDERS="${HOME:-/root} /tmp /var/tmp $source $build"
export OPEN_FOLDERS="${VOLCOMP_OPEN_BUILD:+$build} $build/failed $folder"
export HOME=$folder TMPDIR=$folder TEST_TMPDIR=$folder PYTHONDONTWRITEBYTECODE=1
cd "$folder"

inside='
set -e
for path in $CLOSED_FOLDERS; do
    [ -d "$path" ] || continue
    mount --bind "$path" "$path"
    mount -o remount,bind,ro "$path"
done
for path in $OPEN_FOLDERS; do
    mount --bind "$path" "$path"
    mount -o remount,bind,rw "$path"
done
unset CLOSED_FOLDERS OPEN_FOLDERS
cd "$HOME"
exec "$@"'
namespace=(unshare --mount)
if [ "$(id -u)" -ne 0 ]; then namespace+=(--map-root-user); fi
result=0
if "${namespace[@]}" mount --bind "$folder" "$folder" 2>/dev/null; then
    "${namespace[@]}" bash -c "$inside" in_own_folder "$@" || result=$?
else
    "$@" || result=$?
fi
if [ $result -eq 0 ]; then
    cd "$build"
    rm -rf "$folder"
fi
exit $result
