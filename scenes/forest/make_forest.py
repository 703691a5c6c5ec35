#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the land of the scene forest, and coarse maps that say where each plant grows.

    make_forest.py DIR

writes the surfaces
    DIR/land.obj    a height field as far as the camera sees
    DIR/roots.obj   the same with every normal upright, because trees grow upright on a slope
and the maps
    DIR/sky.png     the sky and its clouds, a lat-long image for the dome
    DIR/ground.png  the ground's colours: soil, moss and grass
    DIR/autumn.png  what the season does to the colour of each broadleaf tree
    DIR/meadow.png, oak.png, birch.png, spruce.png, dead.png, bush.png
                    second densities of 256 x 256 pixels, in strokes that a brush could have
                    painted; they cover x from -160 to 160 and z from -340 to -20
Units are metres, y is up; the camera stands on a hill 45 m behind the origin and looks along -z. The
files are the same in every run.
"""
import math
import os
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from making import directions, noise, random, smoothstep, to_bytes, write_png  # noqa: E402

LOW, SIZE = (-160.0, -340.0), 320.0
NEAR, FAR = 22.0, 340.0
HALF_ANGLE = 20.5      # degrees; of the wedge of land that is made
BACK = 45.0            # distance from the camera to the origin
MAP = 256


TREES = [  # those in the meadow: kind, x, distance, radius
    ("bush", -15, 48, 4), ("bush", 14, 56, 5), ("oak", -20, 66, 4.5), ("birch", 21, 56, 3.5), ("oak", 27, 80, 5), ("birch", 9, 90, 5),
    ("birch", -6, 98, 4), ("spruce", -27, 82, 5), ("dead", -29, 74, 3.0), ("dead", 33, 84, 3.0), ("spruce", 24, 66, 3.0)]


def height(x, z):
    d = -z
    h = 30 * smoothstep(95, 250, d) + 16 * smoothstep(230, 340, d)
    h = h + (8 * np.sin(x / 37 + 0.9) + 4 * np.sin(x / 17 + d / 50)) * smoothstep(90, 200, d)
    h = h + 4 * np.sin(d / 26 + x / 56 + 2.2) * smoothstep(100, 160, d)
    # A summit on the left, then the sides of the valley.
    h = h + 20 * np.exp(-(((x + 62) / 48) ** 2 + ((d - 300) / 60) ** 2))
    h = h + 8 * smoothstep(0.14, 0.5, np.abs(x + 0.05 * d) / (d + 10)) * smoothstep(40, 90, d)
    return h + 0.35 * np.sin(x / 4.3 + d / 9) * np.sin(d / 5.1 + 1) - 1.2 * np.exp(-((x - 6 * np.sin(d / 22)) / 7) ** 2) * smoothstep(130, 60, d)


def write_land(path, upright, across=150, along=260):
    with open(path, "w") as f:
        f.write("# made by make_forest.py; metres\n")
        if upright:
            f.write("vn 0 1 0\n")
        for j in range(along + 1):
            d = NEAR + (FAR - NEAR) * (j / along) ** 1.4       # finer near the camera
            x = (math.tan(math.radians(HALF_ANGLE)) * (d + BACK) + 4) * np.linspace(-1, 1, across + 1)
            y = height(x, np.full_like(x, -d))
            f.writelines("v %.4f %.4f %.4f\nvt %.6f %.6f\n" % (px, py, -d, (px - LOW[0]) / SIZE, (-d - LOW[1]) / SIZE) for px, py in zip(x, y))
        corner = "{0}/{0}/1" if upright else "{0}/{0}"
        for j in range(along):
            for i in range(across):
                a = j * (across + 1) + i + 1
                f.write("f " + " ".join(corner.format(k) for k in (a, a + 1, a + across + 2, a + across + 1)) + "\n")


def clouds(x, y):
    return sum(noise(x * 2 ** k, y * 2 ** k, 20 + k) * 0.5 ** (k + 1) for k in range(6))


def sky(width=2048):
    """Returns the sky from the pale horizon to blue, with fair-weather clouds in perspective, over a
    ground of the land's colour."""
    dx, dy, dz = directions(width)
    rise = np.maximum(dy - 0.05, 0)
    x, y = dx / (rise + 0.10) * 2.2 + 7, -0.85 * dz / (rise + 0.10)
    here, sunwards = clouds(x, y * 1.6), clouds(x - 0.16, y * 1.6 - 0.10)
    cover = smoothstep(0.50, 0.64, here)[..., None]
    shade = np.clip(0.90 + 1.6 * (here - sunwards), 0.74, 1.0)[..., None]
    fade = smoothstep(0.0, 0.5, rise)[..., None]
    blue = np.array([0.80, 0.87, 0.93]) * (1 - fade) + np.array([0.26, 0.46, 0.78]) * fade
    white = np.array([0.98, 0.97, 0.95]) * shade + np.array([0.0, 0.01, 0.04]) * (1 - shade)
    colour = blue + (white - blue) * cover * smoothstep(0.0, 0.04, rise)[..., None]
    below = smoothstep(0.0, -0.04, dy)[..., None]
    return colour + (np.array([0.36, 0.38, 0.24]) - colour) * below


def main():
    out = sys.argv[1]
    os.makedirs(out, exist_ok=True)
    write_land(os.path.join(out, "land.obj"), False)
    write_land(os.path.join(out, "roots.obj"), True)

    x, z = np.meshgrid(LOW[0] + SIZE * (np.arange(MAP) + 0.5) / MAP, LOW[1] + SIZE * (np.arange(MAP) + 0.5) / MAP)
    d = -z
    rough = noise(x / 17, z / 17, 1) - 0.5
    side = np.abs(x + 0.05 * d + 5 * np.sin(d / 25))
    # The meadow before the forest, then clearings on the slope.
    glade = smoothstep(0.22 * d + 13, 0.22 * d + 3, side + 10 * rough) \
        * smoothstep(112, 94, d + 22 * rough)
    glade = np.maximum(glade, smoothstep(52, 46, d + 6 * rough))
    for cx, cd, r in ((48, 178, 15), (-30, 226, 17), (30, 282, 14)):
        glade = np.maximum(glade, smoothstep(r + 4, r - 5, np.hypot(x - cx, (d - cd) * 0.7) + 8 * rough))
    wood = 1 - glade
    high = smoothstep(105, 240, d + 80 * (noise(x / 60, z / 60, 2) - 0.5))  # where conifers grow
    patch = smoothstep(0.35, 0.65, noise(x / 34, z / 34, 3))
    edge = glade * smoothstep(0.02, 0.4, 1 - glade) * 1.0
    maps = {
        "meadow": glade,
        "spruce": wood * np.clip(0.12 + 0.95 * high, 0, 1) * (0.45 + 0.55 * smoothstep(0.3, 0.6, noise(x / 26, z / 26, 4))),
        "oak": wood * (1 - 0.86 * high) * patch,
        "birch": wood * (1 - 0.70 * high) * (1 - 0.85 * patch),
        "bush": np.clip(edge * 1.2 + 0.10 * glade * smoothstep(0.55, 0.75, noise(x / 9, z / 9, 5)) + 0.35 * wood * smoothstep(140, 60, d), 0, 1),
        "dead": np.clip(wood * 0.09 * high, 0, 1),
    }
    for name, cx, cd, r in TREES:
        maps[name] = np.maximum(maps[name], smoothstep(r, r - 2, np.hypot(x - cx, d - cd)))
    for name, value in maps.items():
        write_png(os.path.join(out, name + ".png"), to_bytes(value[::-1]))

    soil, moss, grass = (np.array(c)[None, None, :] for c in ((0.40, 0.31, 0.22), (0.30, 0.36, 0.13), (0.45, 0.50, 0.20)))
    damp = smoothstep(0.35, 0.7, noise(x / 6, z / 6, 6))[..., None]
    bare = smoothstep(0.62, 0.74, noise(x / 11, z / 11, 7))[..., None]
    floor = soil + (moss - soil) * damp
    open_land = grass + (soil - grass) * bare * 0.7
    write_png(os.path.join(out, "ground.png"), to_bytes(floor + (open_land - floor) * glade[..., None])[::-1])
    # How far each tree has turned, and the factors on the colours of its leaves.
    turned = 0.7 * smoothstep(0.40, 0.75, noise(x / 45, z / 45, 8)) \
        + 0.5 * random(*np.indices(x.shape), 9) ** 2
    green, gold = np.array([0.60, 0.60, 0.60]), np.array([1.45, 0.80, 0.45])
    autumn = green + (gold - green) * turned[..., None]
    write_png(os.path.join(out, "autumn.png"), to_bytes((autumn / 1.5) ** (1 / 2.2))[::-1])
    write_png(os.path.join(out, "sky.png"), to_bytes(sky()))


if __name__ == "__main__":
    main()
