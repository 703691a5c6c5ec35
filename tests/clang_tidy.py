#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs clang-tidy on sources and remembers which ones were clean: clang_tidy.py BUILD SOURCE...

BUILD holds a compile_commands.json. A source is not looked at again as long as it, the project's
files that it includes, its compiler's command line, .clang-tidy, clang-tidy and the Debian packages
of packages.txt are the same as when it was clean. The memory is in ~/.cache/volcomp/clang-tidy (or
below XDG_CACHE_HOME) and serves every checkout. Exits with 1 if a source is not clean."""
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
CACHE = pathlib.Path(os.environ.get("XDG_CACHE_HOME", pathlib.Path.home() / ".cache"))
MEMORY = CACHE / "volcomp/clang-tidy"
INCLUDE = re.compile(rb'^\s*#\s*include\s*["<]([^">]+)[">]', re.MULTILINE)
KEPT_SECONDS = 60 * 24 * 3600


def output(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout


def project_files(source):
    """The source and all of the project's files that it includes, in any depth."""
    found, waiting = {}, [source]
    while waiting:
        file = waiting.pop()
        if file in found:
            continue
        found[file] = file.read_bytes()
        for name in INCLUDE.findall(found[file]):
            name = name.decode()
            name = re.sub("^volcomp/", "libvolcomp/", name)
            if (ROOT / name).is_file():
                waiting.append(ROOT / name)
    return found


def common_state():
    """What all sources depend on."""
    packages = [line.split("#")[0].strip() for line in open(ROOT / "packages.txt")]
    versions = output("dpkg-query", "-W", *filter(None, packages), "clang-tidy")
    return output("clang-tidy", "--version") + (ROOT / ".clang-tidy").read_bytes() + versions


def key(source, command, common):
    digest = hashlib.sha256(common + command.replace(str(ROOT), "").encode())
    for file, content in sorted(project_files(source).items()):
        digest.update(f"\n{file.relative_to(ROOT)} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def check(build, source):
    """Runs clang-tidy; returns whether the source is clean, and what was said."""
    done = subprocess.run(["clang-tidy", "--quiet", "-p", build, source], text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    said = [line for line in done.stderr.splitlines() if "warnings generated" not in line]
    return done.returncode == 0, done.stdout + "\n".join(said)


def main():
    build, sources = sys.argv[1], [pathlib.Path(name).resolve() for name in sys.argv[2:]]
    MEMORY.mkdir(parents=True, exist_ok=True)
    for stamp in MEMORY.iterdir():
        if time.time() - stamp.stat().st_mtime > KEPT_SECONDS:
            stamp.unlink(missing_ok=True)
    with open(pathlib.Path(build, "compile_commands.json"), encoding="utf-8") as stream:
        commands = {pathlib.Path(entry["file"]): entry["command"] for entry in json.load(stream)}
    common = common_state()
    stamps = {source: MEMORY / key(source, commands[source], common) for source in sources}
    changed = [source for source in sources if not stamps[source].exists()]
    dirty = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for source, (clean, said) in zip(changed, pool.map(lambda s: check(build, s), changed)):
            if said.strip():
                print(said.strip(), flush=True)
            if clean:
                stamps[source].touch()
            else:
                dirty += 1
    for source in set(sources) - set(changed):
        stamps[source].touch()
    print(f"clang-tidy: {len(sources)} sources, {len(changed)} looked at, {dirty} not clean")
    return 1 if dirty else 0


if __name__ == "__main__":
    sys.exit(main())
