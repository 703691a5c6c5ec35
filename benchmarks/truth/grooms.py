#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Grooms beside exact pictures of their strands (docs/grooms.md).

    benchmarks/truth/grooms.py [--samples N] [--file CURVES] [BIN]

bakes the mohawk of scenes/groom (or another file of strands, in metres), renders it from its boxes
under one light at 0 (behind the eye), 45, 90 and 180 degrees (behind the hair), and prints how far
the pictures are from those of volcomp-truth, as a table. scenes/run.sh groom makes the strands.
"""
import argparse
import json
import math
import os
import tempfile

from programs import ROOT, Programs, add_options, run

EYE, TARGET = (0.56, 0.20, 0.62), (0.0, 0.14, -0.03)  # the hair fills the picture
LIMITS = {"bias": 0.02, "alpha_bias": 0.005, "block_rmse": 0.05}  # those of fur in run.py
NAMES = {"bias": "bias", "alpha_bias": "alpha", "block_rmse": "blocks"}


def scene_text(arguments, degrees):
    way = [t - e for t, e in zip(arguments.target, arguments.eye)]
    turn = math.radians(degrees)
    flat = math.hypot(way[0], way[2])
    direction = (way[0] * math.cos(turn) - way[2] * math.sin(turn), way[1] - flat * math.tan(math.radians(arguments.above)),
                 way[0] * math.sin(turn) + way[2] * math.cos(turn))
    return f"""
[material.hair]
kind = "fibre"
alpha = 1
beta = {arguments.beta}
gamma_degrees = 11
[groom.hair]
curves = "{arguments.file}"
material = "hair"
{"groups = [0]" if not arguments.keys else arguments.keys}
[camera]
eye = {list(arguments.eye)}
target = {list(arguments.target)}
field_of_view_degrees = {arguments.degrees}
[[light]]
direction = {list(direction)}
strength = [2, 2, 2]
[compose]
voxel_pixels = {arguments.voxel_pixels}
[render]
width = {arguments.size}
height = {arguments.size}
samples = 16
shadows = "sweep"
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_options(parser, 64)
    parser.add_argument("--file", default=os.path.join(ROOT, "out", "groom", "hair.hair"))
    parser.add_argument("--keys", default="", help="of the groom, instead of groups = [0]")
    parser.add_argument("--size", type=int, default=320, help="of the pictures, pixels")
    parser.add_argument("--degrees", type=float, default=6, help="field of view")
    parser.add_argument("--above", type=float, default=0, help="how much higher than the eye the light stands, degrees")
    parser.add_argument("--beta", type=float, default=3, help="strength of the highlights")
    parser.add_argument("--voxel-pixels", type=float, default=1)
    parser.add_argument("--eye", type=float, nargs=3, default=EYE)
    parser.add_argument("--target", type=float, nargs=3, default=TARGET)
    arguments = parser.parse_args()
    programs = Programs(arguments)
    lines = ["| light | bias | alpha bias | RMSE | in 4x4 blocks | bake + render, CPU s | exact, CPU s | beyond its limit |",
             "|---|---|---|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as folder:
        scene, boxes, picture, stats = (os.path.join(folder, n) for n in ("s.toml", "boxes", "p.exr", "s.json"))
        baked = None
        for degrees in (0, 45, 90, 180):
            text = scene_text(arguments, degrees)
            with open(scene, "w") as f:
                f.write(text)
            if baked is None:
                baked, _ = run([programs.program("bake"), scene, "-o", boxes])
            rendered, _ = run([programs.program("render"), scene, "--boxes", boxes, "-o", picture])
            exact, traced = programs.exact(scene, text)
            run([programs.program("truth"), scene, "--known", exact, "--compare", picture, "--stats", stats])
            with open(stats) as f:
                e = json.load(f)["error"]
            beyond = ", ".join(NAMES[k] for k, limit in LIMITS.items() if abs(e[k]) > limit)
            lines.append(f"| {degrees} degrees | {100 * e['bias']:+.1f} % | {e['alpha_bias']:+.4f} | {e['rmse']:.3f} | {e['block_rmse']:.3f} | "
                         f"{baked:.1f} + {rendered:.1f} | {traced:.0f} | {beyond} |")
            print(lines[-1], flush=True)
    text = "\n".join(lines)
    print(text)
    if arguments.output:
        with open(arguments.output, "w") as f:
            f.write(text + "\n")


if __name__ == "__main__":
    main()
