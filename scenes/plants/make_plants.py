#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the ground of the scene plants, and coarse maps that say where each plant grows.

    make_plants.py DIR

writes the surfaces
    DIR/ground.obj   the uneven ground that the camera sees
    DIR/garden.obj   a screen behind the plants
and the maps
    DIR/garden.png   what is painted on the screen: the rest of the garden, out of focus
    DIR/shrubs.png, ferns.png, broad.png, daisies.png, poppies.png, lupins.png, grass.png
                     second densities of 96 x 96 pixels over the square from (-1.5, -2.2) to
                     (1.5, 0.8) in x and z
Units are metres, y is up and the camera stands at +z. The files are the same in every run.
"""
import math
import os
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from making import grid, noise, random, smoothstep, to_bytes, write_obj, write_png  # noqa: E402

LOW, SIZE = (-1.5, -2.2), 3.0
FRONT, BACK = 0.62, -1.75          # z of the ground's edges
EYE_Z, HALF_ANGLE = 1.55, 26.0     # the ground is a wedge that the camera sees, with a margin


def height(x, z):
    return (0.035 * np.sin(2.1 * x + 0.6) * np.cos(1.7 * z) + 0.015 * np.sin(5.3 * x + 1.1) * np.sin(4.7 * z + 0.4)
            + 0.055 * np.clip(-z - 0.4, 0, 2))


def write_ground(path, across=90, along=110):
    with open(path, "w") as f:
        f.write("# made by make_plants.py; metres\n")
        for j in range(along + 1):
            z = FRONT + (BACK - FRONT) * j / along
            half = math.tan(math.radians(HALF_ANGLE)) * (EYE_Z - z) + 0.08
            for i in range(across + 1):
                x = half * (2 * i / across - 1)
                f.write("v %.5f %.5f %.5f\nvt %.5f %.5f\n" % (x, height(x, z), z, (x - LOW[0]) / SIZE, (z - LOW[1]) / SIZE))
        for j in range(along):
            for i in range(across):
                a = j * (across + 1) + i + 1
                f.write("f " + " ".join(f"{k}/{k}" for k in (a, a + 1, a + across + 2, a + across + 1)) + "\n")


def screen(s, t):
    return (3.6 * (s - 0.5), -0.2 + 1.9 * t, -2.1)


def garden(width=360, height=190):
    """Returns foliage and the light between its leaves, out of focus: soft discs over a ground that
    becomes brighter upwards."""
    x, y = np.meshgrid(np.linspace(0, 3.6, width), np.linspace(1.9, 0, height))
    high = smoothstep(0.5, 1.7, y + 0.5 * (noise(x / 0.6, y / 0.6, 1) - 0.5))[..., None]
    colour = np.array([0.13, 0.22, 0.10]) * (1 - high) + np.array([0.40, 0.52, 0.26]) * high
    for k in range(260):
        cx, cy, size, warm = (float(random(k, m, 2)) for m in range(4))
        cx, cy, r = 3.6 * cx, 0.5 + 1.4 * cy ** 0.8, 0.05 + 0.09 * size
        light = np.array([0.62, 0.72, 0.30]) * (1 - warm ** 4) + np.array([0.92, 0.86, 0.60]) * warm ** 4
        disc = smoothstep(r, 0.80 * r, np.hypot(x - cx, y - cy))[..., None] * (0.08 + 0.30 * float(random(k, 4, 2)) ** 2)
        colour = colour + (light - colour) * disc
    return colour


# Strokes of the brush: x, z, radius.
STROKES = {
    "shrubs": [(-1.1, -1.45, 0.45), (-0.3, -1.65, 0.4), (0.5, -1.65, 0.45), (1.25, -1.45, 0.45)],
    "ferns": [(-0.72, -0.30, 0.20), (-0.95, -0.78, 0.34), (-0.45, -1.15, 0.40), (0.45, -1.15, 0.42), (1.02, -0.85, 0.36), (0.0, -1.3, 0.3)],
    "broad": [(0.40, 0.02, 0.24), (0.70, -0.30, 0.32), (0.10, -0.80, 0.24), (0.72, 0.16, 0.2)],
    "daisies": [(-0.28, 0.10, 0.30), (-0.05, -0.28, 0.24), (-0.50, 0.30, 0.2), (0.12, 0.36, 0.16)],
    "poppies": [(0.12, -0.34, 0.24), (0.02, 0.05, 0.16), (-0.40, -0.50, 0.22), (0.42, -0.55, 0.18)],
    "lupins": [(-0.55, -0.75, 0.24), (0.28, -0.82, 0.24), (-0.15, -0.95, 0.24), (0.72, -0.75, 0.16)],
}


def main():
    out = sys.argv[1]
    os.makedirs(out, exist_ok=True)
    write_ground(os.path.join(out, "ground.obj"))
    write_obj(os.path.join(out, "garden.obj"), [("garden", grid(screen, lambda s, t: (s, t), 1, 1))])
    write_png(os.path.join(out, "garden.png"), to_bytes(garden()))
    n = 96
    x, z = np.meshgrid(LOW[0] + SIZE * (np.arange(n) + 0.5) / n, LOW[1] + SIZE * (np.arange(n) + 0.5) / n)
    covered = np.zeros((n, n))
    for name, strokes in STROKES.items():
        value = np.zeros((n, n))
        for cx, cz, r in strokes:
            value = np.maximum(value, np.clip(1.6 * (1 - np.hypot(x - cx, z - cz) / r), 0, 1))
        write_png(os.path.join(out, name + ".png"), to_bytes(value[::-1]))
        if name not in ("poppies", "lupins"):
            covered = np.maximum(covered, value)
    write_png(os.path.join(out, "grass.png"), to_bytes(1 - 0.7 * covered)[::-1])


if __name__ == "__main__":
    main()
