#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the ground of the scene plants, and coarse maps that say where each plant grows.

    make_plants.py DIR

writes the surfaces
    DIR/ground.obj   the uneven ground that the camera sees
and the maps
    DIR/garden.png   the rest of the garden, out of focus, and the sky: a lat-long image for the dome
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
from making import directions, noise, random, smoothstep, to_bytes, write_png  # noqa: E402

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


def garden(width=1440):
    """Returns the rest of the garden and the light between its leaves, out of focus: soft discs over
    foliage that becomes brighter upwards and opens to the sky."""
    dx, dy, dz = directions(width)
    turn, rise = np.arctan2(dx, -dz), np.arcsin(dy)
    patch = noise(3 * dx + 9, 3 * dz + 9, 1) + noise(5 * dy + 9, 3 * dx + 4, 5) - 1
    mix = lambda a, b, t: np.array(a) * (1 - t[..., None]) + np.array(b) * t[..., None]
    colour = mix([0.06, 0.05, 0.03], [0.10, 0.19, 0.08], smoothstep(-0.5, -0.05, rise))
    colour = colour + (mix([0.24, 0.36, 0.16], [0.45, 0.56, 0.30], smoothstep(0.1, 0.6, rise)) - colour) \
        * smoothstep(-0.15, 0.30, rise + 0.15 * patch)[..., None]
    colour = colour + (np.array([0.80, 0.90, 1.0]) - colour) * smoothstep(0.55, 0.85, rise + 0.3 * patch)[..., None]
    for k in range(1400):
        at, high, size, warm = (float(random(k, m, 2)) for m in range(4))
        at, high, r = 2 * math.pi * (at - 0.5), -0.10 + 0.75 * high ** 1.2, 0.012 + 0.022 * size
        rows = np.flatnonzero(np.abs(rise[:, 0] - high) < r)
        columns = np.flatnonzero(np.abs(turn[0] - at) < 2 * r)
        if len(rows) == 0 or len(columns) == 0:
            continue
        window = np.ix_(rows, columns)
        away = np.hypot((turn[window] - at) * math.cos(high), rise[window] - high)
        light = np.array([0.62, 0.72, 0.30]) * (1 - warm ** 4) + np.array([0.95, 0.90, 0.66]) * warm ** 4
        disc = smoothstep(r, 0.82 * r, away)[..., None] * (0.08 + 0.30 * float(random(k, 4, 2)) ** 2)
        colour[window] += (light - colour[window]) * disc
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
