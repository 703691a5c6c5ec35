#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How far volcomp's pictures are from the exact geometry: one table over furs and plants, each
under five kinds of light.

    benchmarks/truth/run.py [--only WORD] [--samples N] [--keep FOLDER] [--output FILE.md] [BIN]
    benchmarks/truth/run.py [--only WORD] --write FOLDER    writes NAME_LIGHT.toml, runs nothing

BIN is the folder of the programs (build/release/bin). Each scene is baked and composed once, then
rendered under each light with its default voxel, swept light and 16 samples, and compared with
volcomp-truth's picture. Exact pictures are kept in FOLDER (out/truth) under a name that follows
from the scene's text, the samples and the program, so that a second run takes only what volcomp
itself needs. CPU seconds are user and system, of all threads.
"""
import argparse
import json
import os
import sys

from programs import PRIMITIVES, ROOT, Programs, add_options, run

ORCHARD = os.path.join(ROOT, "scenes", "orchard", "trees.toml")

# Directions in which the light travels; the camera looks along -Z and a little down.
LIGHTS = {
    "above": ["[-0.35, -1.0, -0.3]"],
    "low": ["[-1.0, -0.25, -0.3]"],
    "behind": ["[0.15, -0.6, 1.0]"],
    "along": ["[0.0, -1.0, 0.0]"],
    "three": ["[-1.0, -1.0, -0.5]", "[1.0, -0.6, -0.2]", "[0.2, -0.8, 1.0]"],
}

# name: (kind of limits, side of the ground in metres, height of what grows there, pixels, layers)
# A layer is (box, boxes per square metre, further keys).
SCENES = {
    "fur": ("fur", 0.05, 0.03, (112, 84), [("hair", 40000, "")]),
    "combed fur": ("fur", 0.05, 0.025, (112, 84),
                   [("hair", 40000, "comb = [1.0, 0.0, 0.3]\ncomb_degrees = 50")]),
    "thin fur": ("fur", 0.05, 0.03, (112, 84), [("hair", 8000, "")]),
    "wool": ("fur", 0.06, 0.02, (112, 84), [("wool", 12000, "")]),
    "moss": ("plant", 0.2, 0.03, (112, 84), [("moss", 3000, "")]),
    "grass": ("plant", 0.8, 0.25, (128, 72), [("grass", 300, "")]),
    "fern": ("plant", 2.0, 0.5, (128, 72), [("fern", 2.5, "")]),
    "lavender": ("plant", 1.5, 0.5, (128, 72), [("lavender", 8, "")]),
    "daisies": ("plant", 0.8, 0.3, (128, 72), [("daisy", 60, "")]),
    "birch": ("plant", 30.0, 14.0, (128, 96), [("birch", 0.02, "")]),
    "oak": ("plant", 50.0, 9.0, (160, 80), [("oak", 0.012, "")]),
    "spruce": ("plant", 30.0, 14.0, (128, 96), [("spruce", 0.02, "")]),
    "meadow": ("plant", 1.2, 0.35, (128, 72),
               [("grass", 200, ""), ("daisy", 25, ""), ("clover", 30, ""), ("lavender", 3, "")]),
}
# Of triangles: trees that scenes/orchard/make_orchard.py makes into out/orchard, in the boxes of
# that scene.
MESHES = {
    "apples": ("plant", 24.0, 4.6, (160, 80), [("apple_1", 0.02, ""), ("apple_2", 0.02, "")]),
}
SCENES.update(MESHES)
# Limits of the bias of the mean, of the bias of alpha and of the RMSE in blocks.
LIMITS = {"fur": (0.02, 0.005, 0.05), "plant": (0.05, 0.02, 0.15)}


def scene_text(name, light):
    """The scene as TOML, without any ground that is seen."""
    _, side, height, (width, rows), layers = SCENES[name]
    away = 1.7 * side + 1.2 * height
    text = [
        f'include = ["{ORCHARD if name in MESHES else PRIMITIVES + "/all.toml"}"]',
        f"[camera]\neye = [0.0, {0.5 * away + 0.5 * height:.6g}, {away:.6g}]",
        f"target = [0.0, {0.4 * height:.6g}, 0.0]\nfield_of_view_degrees = 36.0",
        f'[render]\nwidth = {width}\nheight = {rows}\nsamples = 16\nshadows = "sweep"',
    ]
    strength = 3.0 / len(LIGHTS[light])
    for direction in LIGHTS[light]:
        text.append(f"[[light]]\ndirection = {direction}\n"
                    f"strength = [{strength}, {strength}, {strength}]")
    text.append(f"[surface.ground]\nground = [{side}, {side}]")
    for box, density, more in layers:
        text.append(f'[[layer]]\nname = "{box}"\nbox = "{box}"\ndensity = {density}\n{more}')
    return "\n".join(text) + "\n"


class Bench(Programs):
    def measure(self, name):
        """Rows of one scene: a dictionary for each light."""
        if name in MESHES:
            run([sys.executable, os.path.join(ROOT, "scenes", "orchard", "make_orchard.py"),
                 os.path.join(ROOT, "out", "orchard")])
        base = os.path.join(self.folder, name.replace(" ", "_"))
        scene, boxes, volume = base + ".toml", base + ".boxes", base + ".vdb"
        with open(scene, "w") as stream:
            stream.write(scene_text(name, "above"))
        used = [word for box, _, _ in SCENES[name][4] for word in ("--box", box)]
        baked, _ = run([self.program("bake"), scene, "-o", boxes, "-q", *used])
        composed, _ = run([self.program("compose"), scene, "--boxes", boxes, "-o", volume, "-q"])
        rows = []
        for light in LIGHTS:
            with open(scene, "w") as stream:
                stream.write(scene_text(name, light))
            picture, stats = base + ".exr", base + ".json"
            rendered, _ = run([self.program("render"), scene, "--volume", volume, "-o", picture,
                               "-q"])
            exact, traced = self.exact(scene, scene_text(name, light))
            run([self.program("truth"), scene, "--known", exact, "--compare", picture, "-q",
                 "--stats", stats])
            with open(stats) as stream:
                row = json.load(stream)["error"]
            row.update(scene=name, light=light, bake=baked, compose=composed, render=rendered,
                       truth=traced)
            rows.append(row)
        return rows


def misses(row):
    """What of a row is beyond its limits."""
    bias, alpha, blocks = LIMITS[SCENES[row["scene"]][0]]
    found = []
    if abs(row["bias"]) > bias:
        found.append("bias")
    if abs(row["alpha_bias"]) > alpha:
        found.append("alpha")
    if abs(row["block_rmse"]) > blocks:
        found.append("blocks")
    return found


def table(rows):
    text = ["| scene | light | bias | alpha bias | RMSE | in 4x4 blocks | bake + compose + render, "
            "CPU s | beyond its limit |", "|---|---|---|---|---|---|---|---|"]
    for r in rows:
        text.append(
            f"| {r['scene']} | {r['light']} | {100 * r['bias']:+.1f} % | {r['alpha_bias']:+.4f} | "
            f"{r['rmse']:.3f} | {r['block_rmse']:.3f} | {r['bake']:.1f} + {r['compose']:.1f} + "
            f"{r['render']:.1f} | {', '.join(misses(r))} |")
    missed = sum(bool(misses(r)) for r in rows)
    text.append(f"\n{len(rows) - missed} of {len(rows)} within their limits.")
    return "\n".join(text) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser, samples=256)
    parser.add_argument("--write", help="only write the scenes into this folder")
    arguments = parser.parse_args()
    if arguments.write:
        os.makedirs(arguments.write, exist_ok=True)
        for name in SCENES:
            for light in LIGHTS if arguments.only in name else ():
                file = f"{name.replace(' ', '_')}_{light}.toml"
                with open(os.path.join(arguments.write, file), "w") as stream:
                    stream.write(scene_text(name, light))
        return
    bench = Bench(arguments)
    rows = []
    for name in SCENES:
        if arguments.only in name:
            rows += bench.measure(name)
            print(table(rows[-len(LIGHTS):]).splitlines()[-3], flush=True)
    text = table(rows)
    print(text)
    if arguments.output:
        with open(arguments.output, "w") as stream:
            stream.write(text)


if __name__ == "__main__":
    main()
