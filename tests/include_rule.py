#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Holds the includes of libvolcomp/ and tools/ to the rule: include_rule.py SOURCE.

The rule is the table of rooms in docs/ARCHITECTURE.md, which this script reads. Prints one line for
each include against it and exits with 1 if there are any. Before that it checks itself on small
made-up trees."""
import pathlib
import re
import sys
import tempfile

ANY_TOOL = "shared"  # the room of tools/ that every other room there may include
ALL_TOOLS = "volcomp"  # the program that is all the others in one, whose room may include theirs
INCLUDE = re.compile(r'^\s*#\s*include\s*(["<])([^">]+)[">]')


def read_rule(page):
    """The rooms that the files of each room may include besides their own, from the table of rooms
    in the text of docs/ARCHITECTURE.md. Folders inside a room (`render/tree`) are that room."""
    rule = {}
    for room, others in re.findall(r"^\| `(\w+)` \| ([^|]*)\|", page, re.MULTILINE):
        rule[room] = list(rule) if others.strip() == "all above" else re.findall(r"`(\w+)`", others)
    unknown = {other for others in rule.values() for other in others} - set(rule)
    assert not unknown, f"docs/ARCHITECTURE.md has no row for {', '.join(sorted(unknown))}"
    return rule


def included(file):
    """The includes of a file as (line number, opening mark, name)."""
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
        found = INCLUDE.match(line)
        if found:
            yield number, found[1], found[2]


def sources(folder):
    return sorted(file for file in folder.rglob("*") if file.suffix in (".h", ".cpp"))


def complaint(rule, tree, room, mark, name):
    """What is wrong if a file of tree/room includes name, or None."""
    if name.startswith("volcomp/"):
        to_room = name.split("/")[1]
        if tree == "tools" or to_room == room:
            return None
        if to_room not in rule:
            return f"{to_room} is no room of libvolcomp"
        if to_room not in rule[room]:
            return f"{room} may include only {', '.join(rule[room]) or 'itself'}"
    elif name.startswith(("tools/", "tests/", "benchmarks/")):
        if tree == "libvolcomp":
            return "the library includes only itself"
        if room == ALL_TOOLS and name.startswith("tools/"):
            return None
        if name.split("/")[:2] not in (["tools", room], ["tools", ANY_TOOL]):
            return f"tools/{room} may include only itself and tools/{ANY_TOOL}"
    elif mark == '"' and ("/" not in name or name.startswith(".")):
        return 'write "volcomp/ROOM/NAME.h" or "tools/ROOM/NAME.h"'
    return None


def breaches(source, rule):
    found = []
    for tree in ("libvolcomp", "tools"):
        for file in sources(source / tree):
            room = file.relative_to(source / tree).parts[0]
            if tree == "libvolcomp" and room not in rule:
                found.append(f"{file.relative_to(source)}: {room} is no room of libvolcomp")
                continue
            for number, mark, name in included(file):
                wrong = complaint(rule, tree, room, mark, name)
                if wrong:
                    place = f"{file.relative_to(source)}:{number}"
                    found.append(f"{place}: includes {name}, but {wrong}")
    return found


def check_itself():
    rule = read_rule("""
| room | may include | what is in it |
|---|---|---|
| `base` | | vectors |
| `view` | `base` | `Camera` |
| `surface` | `base` | |
| `place` | `surface` `view` `base` | |
| `compose` | `place` `base` | |
| `render` | `surface` `view` `base` | |
| `render/tree` | | |
| `scene` | all above | |
| `inspect` | all above | |
""")
    assert rule["base"] == [] and rule["view"] == ["base"], rule
    assert rule["inspect"] == [*rule][:-1] and len(rule) == 8, rule
    cases = [  # file, its line, whether it is against the rule
        ("libvolcomp/base/a.h", "#include <vector>", False),
        ("libvolcomp/base/a.h", '#include "volcomp/base/b.h"', False),
        ("libvolcomp/base/a.h", '#include "volcomp/scene/b.h"', True),
        ("libvolcomp/base/a.h", "#include <volcomp/scene/b.h>", True),
        ("libvolcomp/base/a.h", '  #  include "volcomp/view/b.h" // why', True),
        ("libvolcomp/base/a.h", '// #include "volcomp/view/b.h"', False),
        ("libvolcomp/base/a.h", '#include "b.h"', True),
        ("libvolcomp/base/a.h", '#include "../view/b.h"', True),
        ("libvolcomp/base/a.cpp", '#include "hwy/foreach_target.h"', False),
        ("libvolcomp/render/tree/a.cpp", '#include "volcomp/render/march/b.h"', False),
        ("libvolcomp/render/tree/a.cpp", '#include "volcomp/surface/b.h"', False),
        ("libvolcomp/render/tree/a.cpp", '#include "volcomp/place/b.h"', True),
        ("libvolcomp/render/a.cpp", '#include "volcomp/compose/b.h"', True),
        ("libvolcomp/place/a.cpp", '#include "volcomp/render/b.h"', True),
        ("libvolcomp/place/a.cpp", '#include "volcomp/scene/b.h"', True),
        ("libvolcomp/scene/a.cpp", '#include "volcomp/inspect/b.h"', True),
        ("libvolcomp/inspect/a.cpp", '#include "volcomp/scene/b.h"', False),
        ("libvolcomp/scene/a.cpp", '#include "tools/shared/b.h"', True),
        ("libvolcomp/attic/a.cpp", "", True),
        ("tools/bake/a.cpp", '#include "volcomp/scene/b.h"', False),
        ("tools/bake/a.cpp", '#include "tools/shared/b.h"', False),
        ("tools/bake/a.cpp", '#include "tools/render/b.h"', True),
        ("tools/shared/a.cpp", '#include "tools/bake/b.h"', True),
        ("tools/volcomp/a.cpp", '#include "tools/bake/b.h"', False),
        ("tools/volcomp/a.cpp", '#include "tests/bake/b.h"', True),
        ("tools/bake/a.cpp", '#include "tools/volcomp/b.h"', True),
    ]
    for name, line, expected in cases:
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, name)
            file.parent.mkdir(parents=True)
            file.write_text(line + "\n", encoding="utf-8")
            found = breaches(pathlib.Path(folder), rule)
            assert len(found) == expected, f"{name} with {line!r}: {found}"


def main():
    check_itself()
    source = pathlib.Path(sys.argv[1])
    files = sum(len(sources(source / tree)) for tree in ("libvolcomp", "tools"))
    assert files > 50, f"{source}: only {files} sources; is this volcomp's folder?"
    rule = read_rule((source / "docs/ARCHITECTURE.md").read_text(encoding="utf-8"))
    rooms = {folder.name for folder in (source / "libvolcomp").iterdir() if folder.is_dir()}
    assert rooms == set(rule), f"docs/ARCHITECTURE.md has other rooms: {rooms ^ set(rule)}"
    found = breaches(source, rule)
    print("\n".join(found + [f"{files} files, {len(found)} includes against the rule"]))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
