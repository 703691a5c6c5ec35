#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""How far volcomp's light that is scattered more than once is from paths through the exact geometry:
one table over furs, wool and plants of four greys, each under several kinds of light.

    benchmarks/truth/scattering.py [--only WORD] [--samples N] [--keep FOLDER] [--output FILE] [BIN]

BIN is the folder of the programs (build/release/bin). Wants numpy and OpenImageIO. All that grows in
a scene has one body colour and alpha 1, and a picture's red, green and blue are three of the four
greys, as paths do not depend on colour. Exact pictures are kept in FOLDER (out/truth) as by run.py.
Errors are those of the pixels' 4x4 blocks that the exact picture covers, relative to its mean there.
"""
import argparse
import os
import re
import sys
import tempfile

import numpy
import OpenImageIO

from programs import PRIMITIVES, ROOT, Programs, add_options, run

sys.path.insert(0, os.path.join(ROOT, "scenes"))
from making import write_ball  # noqa: E402

# Directions in which the light travels; "front" is the camera's own.
LIGHTS = {
    "front": None,
    "side": (1.0, -0.3, 0.0),
    "behind": (0.3, -0.5, 1.0),
    "above": (0.0, -1.0, 0.0),
    "slanting": (-1.0, -1.0, -0.5),
    "low": (-1.0, -0.25, -0.3),
}
PLANT_LIGHTS = ("front", "side", "behind")
GREYS = ((0.3, 0.6, 0.9), (0.95, 0.95, 0.95))

# name: (box, boxes per square metre, side of the ground in metres or 0 for the ball, height of what
# grows there, materials that let light through)
SCENES = {
    "fur, thin": ("hair", 5000, 0.05, 0.03, ()),
    "fur": ("hair", 40000, 0.05, 0.03, ()),
    "fur, dense": ("hair", 400000, 0.04, 0.03, ()),
    "ball": ("hair", 40000, 0, 0, ()),
    "wool": ("wool", 12000, 0.06, 0.02, ()),
    "grass": ("grass", 300, 0.8, 0.25, ()),
    "grass, transmission": ("grass", 300, 0.8, 0.25, ("blade",)),
    "oaks": ("oak", 0.012, 50.0, 9.0, ()),
    "oaks, transmission": ("oak", 0.012, 50.0, 9.0, ("leaf",)),
}
WIDTH, HEIGHT, BLOCK = 96, 72, 4


def plain(box, grey, through):
    """A primitive as one text of TOML, in one body colour; a share of 0.4 of what the materials
    `through` scatter goes through."""
    with open(os.path.join(PRIMITIVES, box + ".toml")) as stream:
        text = stream.read()
    colour = f"[{grey[0]}, {grey[1]}, {grey[2]}]"
    text = re.sub(r'(colour_(?:root|tip)) = .*', rf"\1 = {colour}", text)
    text = re.sub(r"colour_variation = .*\n", "", text)
    text = re.sub(r"\nalpha = .*", "", text)

    def light(table):
        if table[1] not in through:
            return table[0] + "\nalpha = 1.0"
        return table[0] + "\nalpha = 0.6\ntransmission = [0.4, 0.4, 0.4]"
    return re.sub(r"\[material\.(\w+)\]", light, text)


def scene_text(name, light, grey, scattering, ball):
    box, density, side, height, through = SCENES[name]
    if side:
        away = 1.7 * side + 1.2 * height
        eye, target = (0.0, 0.5 * away + 0.5 * height, away), (0.0, 0.4 * height, 0.0)
        surface = f"[surface.ground]\nground = [{side}, {side}]\n"
    else:
        eye, target = (0.0, 0.12, 0.4), (0.0, 0.0, 0.0)
        surface = f'[surface.ground]\nmesh = "{ball}"\n'
    way = LIGHTS[light] or tuple(t - e for e, t in zip(eye, target))
    return (f"[camera]\neye = {list(eye)}\ntarget = {list(target)}\nfield_of_view_degrees = 36.0\n"
            f"[render]\nwidth = {WIDTH}\nheight = {HEIGHT}\nsamples = 16\nshadows = \"sweep\"\n"
            f"scattering = \"{scattering}\"\n[[light]]\ndirection = {list(way)}\n"
            f"strength = [1.0, 1.0, 1.0]\n{plain(box, grey, through)}\n{surface}"
            f'[[layer]]\nbox = "{box}"\nsurface = "ground"\ndensity = {density}\n')


def blocks(values):
    """Means of blocks."""
    rows, columns = values.shape[0] // BLOCK, values.shape[1] // BLOCK
    return values[:rows * BLOCK, :columns * BLOCK].reshape(
        rows, BLOCK, columns, BLOCK, -1).mean(axis=(1, 3))


def read(file):
    """The pixels of a picture. Not by ImageBuf, whose cache takes a file that was written twice
    within a second for the old one."""
    image = OpenImageIO.ImageInput.open(file)
    pixels = image.read_image(OpenImageIO.FLOAT)
    image.close()
    return pixels.astype(float)


def errors(picture, exact):
    """Bias of the mean and RMSE in blocks, over the mean, by channel; the exact picture's noise left
    out, as pictureError() does it."""
    x = blocks(read(picture)[..., :3])
    known = blocks(read(exact))
    covered = known[..., 3] > 0
    x, a, whole = x[covered], known[covered][:, 4:7], known[covered][:, :3]
    mean = whole.mean(axis=0)
    square = ((x - a) * (x - (2 * whole - a))).mean(axis=0)
    return x.mean(axis=0) / mean - 1, numpy.sqrt(numpy.maximum(0, square)) / mean


class Bench(Programs):
    def __init__(self, arguments):
        super().__init__(arguments)
        self.ball = os.path.join(self.folder, "ball.obj")
        if not os.path.exists(self.ball):
            write_ball(self.ball, 0.06, "a ball of 6 cm; metres")

    def write(self, file, *what):
        text = scene_text(*what, self.ball)
        with open(file, "w") as stream:
            stream.write(text)
        return text

    def measure(self, name):
        """Rows of one scene: a dictionary for each light."""
        # Its own folder, so that two runs at once share nothing but what is kept.
        with tempfile.TemporaryDirectory() as folder:
            return self.measure_in(folder, name)

    def measure_in(self, folder, name):
        base = os.path.join(folder, "scene")
        scene, boxes, volume, picture = (base + end for end in (".toml", ".boxes", ".vdb", ".exr"))
        lights = LIGHTS if name.startswith(("fur", "ball", "wool")) else PLANT_LIGHTS
        rows = {light: {"scene": name, "light": light, "bias": [], "blocks": []}
                for light in lights}
        for grey in GREYS:
            self.write(scene, name, "front", grey, "multiple")
            run([self.program("bake"), scene, "-o", boxes, "-q"])
            run([self.program("compose"), scene, "--boxes", boxes, "-o", volume, "-q"])
            for light, row in rows.items():
                colours = 3 if grey[0] != grey[1] else 1
                for scattering in ("single", "multiple") if colours == 3 else ("multiple",):
                    text = self.write(scene, name, light, grey, scattering)
                    row[scattering], _ = run(
                        [self.program("render"), scene, "--volume", volume, "-o", picture, "-q"])
                    exact, _ = self.exact(scene, text)
                    bias, rmse = errors(picture, exact)
                    if scattering == "single":
                        row["own"] = bias.mean()
                    else:
                        row["bias"] += list(bias[:colours])
                        row["blocks"] += list(rmse[:colours])
                        row["time"] = row.get("time", row["multiple"] / row["single"])
        return list(rows.values())


def table(rows):
    greys = [str(g) for grey in GREYS for g in sorted(set(grey))]
    text = [f"| scene | light | bias of the mean at {', '.join(greys)} | RMSE in 4x4 blocks | bias of "
            "`single` against one bounce | time over `single` |", "|---|---|---|---|---|---|"]
    for r in rows:
        text.append(f"| {r['scene']} | {r['light']} | "
                    + " ".join(f"{100 * b:+.1f}" for b in r["bias"]) + " % | "
                    + " ".join(f"{b:.3f}" for b in r["blocks"])
                    + f" | {100 * r['own']:+.1f} % | {r['time']:.2f} |")
    ratio = sum(r["multiple"] for r in rows) / sum(r["single"] for r in rows)
    text.append(f"\nTime over that of `single`, all rows together: {ratio:.2f}.")
    return "\n".join(text) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser, samples=16)
    arguments = parser.parse_args()
    bench = Bench(arguments)
    rows = []
    for name in SCENES:
        if arguments.only in name:
            found = bench.measure(name)
            rows += found
            print("\n".join(table(found).splitlines()[2:-2]), flush=True)
    text = table(rows)
    print(text)
    if arguments.output:
        with open(arguments.output, "w") as stream:
            stream.write(text)


if __name__ == "__main__":
    main()
