#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the fur coat's surfaces and maps: a garment with sleeves, a shawl collar and an open
front, on a tailor's dummy.

    make_coat.py DIR

writes the surfaces
    DIR/coat.obj     body and sleeves
    DIR/lining.obj, DIR/collar.obj
    DIR/dummy.obj    the dummy, which is covered with linen
    DIR/wood.obj     its neck and its pole
    DIR/wall.obj     the wall behind it
and the maps
    DIR/wall.png     the wall's colour, which becomes darker towards the edges
    DIR/spots.png    the coat's colour: a leopard's rosettes on a ground that becomes paler towards
                     the hem and the front edges
    DIR/cuffs.png    second density: 1 on the cuffs and the hem, 0 elsewhere
    DIR/body.png     second density: 1 on the rest
The last three lie in the body's texture space, which is in metres divided by the size of the sheet,
so that nothing is stretched.
Units are metres, the hem is at y = 0 and the front looks along +z. The files are the same in every
run.
"""
import math
import os
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from making import (add, grid, lathe, mul, noise, normal, random, sleeve, smoothstep, spline, superellipse, to_bytes, tube,  # noqa: E402
                    write_obj, write_png)

SHEET = (2.3, 1.4)     # size of the texture sheet, metres
TORSO_WIDTH = 1.68     # its part for the torso; the sleeves lie above each other beside it
PIXEL = 0.002          # metres a pixel of the maps

# height, half width (x), half depth (z), exponent of the superellipse, half width of the opening in
# front
PROFILE = [
    (0.00, 0.350, 0.285, 2.0, 0.105),
    (0.30, 0.318, 0.250, 2.0, 0.080),
    (0.58, 0.278, 0.210, 2.0, 0.055),
    (0.84, 0.282, 0.205, 2.2, 0.048),
    (1.00, 0.270, 0.180, 2.4, 0.050),
    (1.09, 0.215, 0.140, 2.3, 0.055),
    (1.16, 0.135, 0.105, 2.0, 0.060),
    (1.22, 0.092, 0.090, 2.0, 0.060),
]
SLEEVE = [  # x, y, z of the axis, radius
    (0.130, 1.055, -0.010, 0.070),
    (0.222, 0.998, -0.010, 0.095),
    (0.298, 0.885, -0.015, 0.092),
    (0.340, 0.735, 0.000, 0.086),
    (0.364, 0.590, 0.040, 0.082),
    (0.378, 0.465, 0.085, 0.084),
]
DUMMY = [  # height, half width, half depth
    (0.52, 0.150, 0.115), (0.64, 0.190, 0.140), (0.82, 0.165, 0.125), (0.98, 0.200, 0.140), (1.07, 0.160, 0.105), (1.13, 0.095, 0.080),
    (1.18, 0.064, 0.068), (1.31, 0.058, 0.062),
]
NECK = [  # radius, height
    (0.058, 1.300), (0.072, 1.306), (0.074, 1.322), (0.050, 1.336), (0.020, 1.350), (0.027, 1.372), (0.022, 1.390), (0.001, 1.396)]
WALL = (-2.0, -0.75, 1.5, 1.95)  # x and y of its lower left corner and of its upper right one
WALL_Z = -0.75


def torso(s, h):
    """Returns a point of the torso; s in [0, 1] from the right front edge around the back to the left
    one, h in [0, 1] from the hem to the neck."""
    y, a, b, n, gap = spline(PROFILE, h * (len(PROFILE) - 1))
    start = gap / a                                    # angle of the opening's edge, measured from the front
    angle = start + s * (2 * math.pi - 2 * start)
    fold = 1 + 0.035 * (1 - min(h / 0.55, 1)) * math.sin(9 * angle + 1.3) + 0.02 * (1 - min(h / 0.4, 1)) * math.sin(5 * angle)
    c, d = math.sin(angle), math.cos(angle)
    r = superellipse(c, d, n)
    return (a * r * c * fold, y, b * r * d * fold)


def lining(s, h):
    """Returns a point of the lining, which lies below the roots of leaning tufts."""
    h = 0.006 + 0.980 * h
    return add(torso(s, h), mul(normal(torso, s, h), -0.016))


def dummy(s, h):
    y, a, b = spline(DUMMY, h * (len(DUMMY) - 1))
    c, d = math.sin(2 * math.pi * s), math.cos(2 * math.pi * s)
    r = superellipse(c, d, 2.2)
    return (a * r * c, y, b * r * d)


def wall(s, h):
    return (WALL[0] + s * (WALL[2] - WALL[0]), WALL[1] + h * (WALL[3] - WALL[1]), WALL_Z)


def sleeve_point(side, s, h):
    """Returns a point of a sleeve; s in [0, 1] around it, h in [0, 1] from the shoulder to the cuff;
    side is 1 or -1."""
    wrinkle = 1 + 0.03 * math.exp(-((h - 0.55) / 0.12) ** 2) * math.sin(70 * h + 2 * math.cos(2 * math.pi * s))
    return sleeve(SLEEVE, side, s, h, 0.92, lambda r: r * wrinkle)


def collar(t, w):
    """Returns a point of the shawl collar; t in [0, 1] along it, from the right chest around the neck
    to the left chest, w in [0, 1] outwards."""
    e = abs(2 * t - 1)                                 # 1 at the chest, 0 behind the neck
    side = -1 if t > 0.5 else 1
    rise = 0.47 + 0.50 * min(1.0, (1 - e) / 0.62)      # height along the front edge, then along the neck
    around = max(0.0, ((1 - e) - 0.5) / 0.5)           # 0 on the front edge, 1 behind the neck
    smooth = around * around * (3 - 2 * around)
    width = 0.115 * smoothstep(-0.12, 0.34, 1 - e) * (1 - 0.10 * smooth)
    s = 0.5 * smooth + (1 - smooth) * 0.005
    # outwards: along the body on the front edge, down the back behind the neck
    ds = (1 - smooth) * width * w / 1.5
    dh = -smooth * width * w / 1.05 * 0.8
    h = min(rise, 0.985) + dh
    s = s + ds * (1 + 0.8 * h)
    if side < 0:
        s = 1 - s
    bulge = 0.016 + 0.042 * math.sin(math.pi * min(1.0, w * 0.85 + 0.12)) * (0.6 + 0.4 * smooth)
    p = add(torso(s, h), mul(normal(torso, s, h), bulge))
    lift = 0.035 * smooth * (1 - w)
    return (p[0], p[1] + lift, p[2])


SPACING = 0.066  # metres between rosettes


def rosettes(x, y):
    """Returns the leopard's pattern at (x, y) metres: how much of the place is a ring, and how much is
    inside one."""
    i, j = np.floor(x / SPACING).astype(np.int64), np.floor(y / SPACING).astype(np.int64)
    ring, inside = np.zeros_like(x), np.zeros_like(x)
    ragged = 0.12 * (noise(x / 0.011, y / 0.011, 9) - 0.5)
    for b in (-1, 0, 1):
        for a in (-1, 0, 1):
            ci, cj = i + a, j + b
            cx = (ci + 0.25 + 0.5 * (cj & 1) + 0.42 * (random(ci, cj, 1) - 0.5)) * SPACING
            cy = (cj + 0.5 + 0.42 * (random(ci, cj, 2) - 0.5)) * SPACING
            dx, dy = x - cx, y - cy
            angle, k = np.arctan2(dy, dx), random(ci, cj, 4) * 6.283
            size = SPACING * (0.30 + 0.14 * random(ci, cj, 3))
            size = size * (1 + 0.10 * np.sin(2 * angle + k) + 0.07 * np.sin(3 * angle + 2 * k) + ragged)
            r = np.hypot(dx, dy) / size
            gaps = np.where(random(ci, cj, 5) < 0.75, 0.5 + 0.5 * np.sin(3 * angle + 3 * k), 1.0)
            width = 0.10 + 0.20 * np.minimum(1, 1.6 * gaps)
            ring = np.maximum(ring, np.clip((width - abs(r - 0.80)) / 0.10, 0, 1) * np.clip(gaps * 4 - 0.35, 0, 1))
            inside = np.maximum(inside, np.clip((0.80 - r) / 0.1, 0, 1))
    return ring, inside


def maps(out):
    width, height = int(SHEET[0] / PIXEL), int(SHEET[1] / PIXEL)
    x, y = np.meshgrid((np.arange(width) + 0.5) * PIXEL,
                       SHEET[1] - (np.arange(height) + 0.5) * PIXEL)  # v = 0 is the bottom row
    rag = noise(x / 0.02, y / 0.02, 3) - 0.5
    along = (y % 0.7) / 0.7                            # on a sleeve: 0 at the shoulder, 1 at the cuff
    torso_part = x < TORSO_WIDTH
    trim = np.where(torso_part, 1 - smoothstep(0.050, 0.062, y + 0.006 * rag), smoothstep(0.855, 0.870, along + 0.01 * rag))
    pale = np.where(torso_part, 0.55 * (1 - smoothstep(0, 0.30, np.minimum(x, TORSO_WIDTH - x))), 0.25 * along)
    ring, inside = rosettes(x, y)
    mix = lambda a, b, t: a + (np.asarray(b) - a) * t[..., None]
    ground = np.broadcast_to(np.array([0.80, 0.56, 0.30]), x.shape + (3,))
    colour = mix(ground, (0.93, 0.82, 0.62), pale) * (0.90 + 0.2 * noise(x / 0.05, y / 0.05, 7))[..., None]
    colour = mix(mix(colour, (0.55, 0.32, 0.14), 0.45 * inside), (0.085, 0.055, 0.04), ring)
    write_png(os.path.join(out, "spots.png"), to_bytes(colour))
    write_png(os.path.join(out, "cuffs.png"), to_bytes(trim))
    write_png(os.path.join(out, "body.png"), 255 - to_bytes(trim))
    s, t = np.meshgrid(np.linspace(-1, 1, 175), np.linspace(1, -1, 135))
    write_png(os.path.join(out, "wall.png"), to_bytes(1 - 0.55 * smoothstep(0.15, 1.15, np.hypot(s - 0.05, 0.8 * (t - 0.15)))))


def main():
    out = sys.argv[1]
    os.makedirs(out, exist_ok=True)
    w, h = SHEET
    patches = [("torso", grid(torso, lambda s, t: (s * TORSO_WIDTH / w, torso(s, t)[1] / h), 160, 120))]
    for side, base in ((1, 0.0), (-1, 0.7)):
        patches.append((f"sleeve{side}", grid(lambda s, t, side=side: sleeve_point(side, s, t),
                                              lambda s, t, base=base: ((TORSO_WIDTH + 0.02 + s * 0.56) / w, (base + t * 0.699) / h),
                                              64, 72, flip=side > 0)))
    plain = lambda s, t: (s, t)
    write_obj(os.path.join(out, "coat.obj"), patches)
    write_obj(os.path.join(out, "lining.obj"), [("lining", grid(lining, plain, 160, 120))])
    write_obj(os.path.join(out, "collar.obj"), [("collar", grid(collar, plain, 160, 24, flip=True))])
    write_obj(os.path.join(out, "dummy.obj"), [("dummy", grid(dummy, plain, 48, 64))])
    write_obj(os.path.join(out, "wood.obj"), [("neck", grid(lathe(NECK, 0, 0), plain, 40, 40)),
                                              ("pole", grid(tube([(0, -1.0, 0), (0, 0.55, 0)], 0.017), plain, 24, 4))])
    write_obj(os.path.join(out, "wall.obj"), [("wall", grid(wall, plain, 1, 1))])
    maps(out)


if __name__ == "__main__":
    main()
