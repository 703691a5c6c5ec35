#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the bathrobe's surfaces and maps. It hangs on a hanger and is wrapped in front; it has
wide sleeves, a shawl collar and a belt that is tied in a bow.

    make_robe.py DIR

writes the surfaces
    DIR/robe.obj      body and sleeves
    DIR/trim.obj      collar and turned-up cuffs
    DIR/belt.obj
    DIR/wood.obj      hanger and peg
    DIR/hook.obj, DIR/wall.obj
and the maps
    DIR/pattern.png   colour of the robe: woven stripes, and a border of lozenges at the hem and at
                      the ends of the sleeves; its texture space is in metres divided by the size of
                      the sheet
    DIR/ribs.png      factor on the size of loops: the ribs of collar, cuffs and belt, one period
                      across
    DIR/wall.png      colour of the wall: tiles that become darker towards its edges
Units are metres, the hem is at y = 0 and the front looks along +z. The files are the same in every
run.
"""
import math
import os
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from making import (add, cross, grid, lathe, mul, random, sleeve, smoothstep, spline, sub, superellipse, to_bytes, tube, unit,  # noqa: E402
                    write_obj, write_png)

SHEET = (3.0, 1.2)     # size of the texture sheet, metres
TORSO_WIDTH = 1.90     # its part for the body; the sleeves lie above each other beside it
PIXEL = 0.001          # metres a pixel of the pattern
BELT = 0.505           # height of the belt's middle

# height, half width (x), half depth (z), exponent of the superellipse, x of the upper front edge,
# which crosses over below the chest
PROFILE = [
    (0.00, 0.315, 0.250, 2.0, -0.150),
    (0.22, 0.295, 0.230, 2.0, -0.140),
    (0.40, 0.255, 0.190, 2.1, -0.120),
    (0.505, 0.215, 0.158, 2.2, -0.105),
    (0.60, 0.248, 0.180, 2.3, -0.080),
    (0.74, 0.272, 0.195, 2.4, -0.030),
    (0.86, 0.268, 0.175, 2.5, 0.018),
    (0.95, 0.205, 0.138, 2.3, 0.045),
    (1.01, 0.130, 0.105, 2.0, 0.058),
    (1.06, 0.092, 0.090, 2.0, 0.060),
]
SLEEVE = [  # x, y, z of the axis, radius
    (0.125, 0.895, -0.010, 0.075),
    (0.222, 0.835, -0.010, 0.103),
    (0.302, 0.730, -0.010, 0.106),
    (0.352, 0.600, 0.000, 0.108),
    (0.388, 0.480, 0.025, 0.114),
    (0.412, 0.385, 0.055, 0.120),
]


def smooth(a, b, x):
    t = min(max((x - a) / (b - a), 0.0), 1.0)
    return t * t * (3 - 2 * t)


def profile(y):
    """Returns the profile's row at a height."""
    i = max(k for k in range(len(PROFILE) - 1) if PROFILE[k][0] <= max(y, 0.0) or k == 0)
    y0, y1 = PROFILE[i][0], PROFILE[i + 1][0]
    return (y,) + spline(PROFILE, i + min(max((y - y0) / (y1 - y0), 0.0), 1.0))[1:]


def torso(s, y):
    """Returns a point of the body; s in [0, 1] from the upper front edge around the wearer's left side
    and the back to the lower front edge."""
    _, a, b, n, edge = profile(y)
    start = edge / a                                   # angle from the front; below 0 it has crossed over
    angle = start + s * (2 * math.pi - 2 * start)
    below = smooth(BELT - 0.03, BELT - 0.30, y)
    gather = math.exp(-((y - BELT) / 0.10) ** 2)
    fold = 1 + below * (0.040 * math.sin(8 * angle + 1.0) + 0.022 * math.sin(5 * angle + 2.2)) + 0.020 * gather * math.sin(23 * angle + 3 * math.sin(3 * angle))
    fold += 0.012 * smooth(0.55, 0.66, y) * smooth(0.95, 0.8, y) * math.sin(6 * angle + 9 * y)
    c, d = math.sin(angle), math.cos(angle)
    r = superellipse(c, d, n) * fold
    over = 0.020 * (1 - smooth(0, 0.5, angle - start)) * smooth(0.93, 0.80, y)  # upper front
    under = 0.006 * smooth(2 * math.pi - 0.6, 2 * math.pi, angle) * smooth(0.93, 0.80, y)
    return (a * r * c, y, (b + over - under) * r * d)


def torso_normal(s, y):
    e = 1e-3
    return unit(cross(sub(torso(min(s + e, 1), y), torso(max(s - e, 0), y)), sub(torso(s, y + e), torso(s, y - e))))


def sleeve_point(side, s, h, grow=0.0):
    """Returns a point of a sleeve; s in [0, 1] around it, h in [0, 1] from the shoulder to its end;
    side is 1 or -1."""
    angle = 2 * math.pi * s
    wrinkle = 1 + 0.045 * math.exp(-((h - 0.5) / 0.2) ** 2) * math.sin(34 * h + 2 * math.cos(angle + 0.4)) + 0.04 * h * math.sin(3 * angle + 0.7)
    return sleeve(SLEEVE, side, s, h, 0.80, lambda r: (r + grow) * wrinkle)


def cuff(side, s, w):
    """Returns a point of a turned-up cuff; w in [0, 1] from its upper edge over its end inwards."""
    h = min(0.80 + 0.235 * w, 1.0)
    grow = 0.017 * math.sqrt(max(0.0, 1 - max(0.0, (w - 0.85) / 0.15) ** 2)) * smooth(-0.02, 0.05, w)
    return sleeve_point(side, s, h, grow)


def collar(t, w):
    """Returns a point of the shawl collar; t in [0, 1] along it, from the wearer's left waist around
    the neck to the right one, w in [0, 1] outwards."""
    e = abs(2 * t - 1)                                 # 1 at the waist, 0 behind the neck
    y = (BELT - 0.03) + (1.035 - BELT + 0.03) * min(1.0, (1 - e) / 0.68)
    around = smooth(0.55, 1.0, 1 - e)                  # 0 on the front edge, 1 behind the neck
    width = 0.088 * (0.62 + 0.38 * smooth(0, 0.5, 1 - e)) * (1 + 0.12 * math.exp(-((e - 0.45) / 0.2) ** 2))
    s = 0.5 * around
    s += (1 - around) * width * w / 1.45 * (1 + 0.8 * smooth(0.85, 1.05, y))
    y -= around * width * w * 0.95
    if t > 0.5:
        s = 1 - s
    upper = 0.010 if t < 0.5 else 0.0
    bulge = 0.012 + upper * (1 - around) + 0.026 * math.sin(math.pi * min(1.0, w * 0.9 + 0.08)) * (0.6 + 0.4 * around)
    bulge *= 0.45 + 0.55 * smooth(0.0, 0.14, 1 - e)          # flat where the belt holds it
    p = add(torso(s, y), mul(torso_normal(s, y), bulge))
    return (p[0], p[1] + 0.030 * around * (1 - w), p[2])


def band(path, width, thick, normal, tapered, power=3.0):
    """Returns the function, for grid(), of a padded band along path(t). Its cross-section is rounded,
    `width` across and `thick` along normal(t). If `tapered`, its ends are drawn together."""
    def point(s, t):
        e = 1e-3
        tangent = unit(sub(path(min(t + e, 1.0)), path(max(t - e, 0.0))))
        n = normal(t)
        n = unit(sub(n, mul(tangent, sum(x * y for x, y in zip(n, tangent)))))
        b = cross(tangent, n)
        angle = 2 * math.pi * s
        c, d = math.cos(angle), math.sin(angle)
        r = superellipse(c, d, power)
        cap = 1
        if tapered:  # not to a point, so that faces keep an area
            cap = math.sqrt(max(0.01, 1 - max(0.0, abs(2 * t - 1) - 0.97) ** 2 / 0.03 ** 2))
        return add(path(t), add(mul(b, width / 2 * r * c * cap), mul(n, thick / 2 * r * d * cap)))
    return point


def belt_parts():
    """Returns the loops of the bow, the band around the waist, the knot and the two hanging ends, each
    as (point, length in metres, quads along it)."""
    def waist(t):
        angle = 2 * math.pi * t
        _, a, b, n, _ = profile(BELT)
        c, d = math.sin(angle), math.cos(angle)
        r = superellipse(c, d, n)
        return ((a + 0.020) * r * c, BELT + 0.006 * math.cos(angle) + 0.004 * math.sin(3 * angle), (b + 0.040) * r * d)

    def outward(t):
        p = waist(t)
        return unit((p[0], 0.0, p[2] * 1.6))

    knot_x, knot_z = -0.030, 0.209
    def knot(t):  # a turn around the band, which leans
        angle = 2 * math.pi * t
        return (knot_x + 0.014 * math.sin(angle), BELT + 0.002 + 0.046 * math.cos(angle), knot_z + 0.016 + 0.034 * math.sin(angle))

    def knot_out(t):
        angle = 2 * math.pi * t
        return (0.25, math.cos(angle), math.sin(angle) + 0.01)

    def end(dx, length, z, sway):
        rows = [(knot_x + 0.1 * dx, BELT + 0.012, knot_z + 0.002), (knot_x + 0.45 * dx, BELT - 0.022, knot_z + 0.022 + z),
                (knot_x + 0.85 * dx, BELT - 0.30 * length, knot_z + 0.026 + z), (knot_x + dx + sway, BELT - 0.68 * length, knot_z + 0.046 + z),
                (knot_x + 1.1 * dx, BELT - length, knot_z + 0.072 + z)]
        return lambda t: spline(rows, t * 4)

    def bow(dx, drop):  # goes out in front and comes back behind
        rows = [(0.0, 0.006, 0.030), (0.45 * dx, 0.022, 0.052), (0.88 * dx, -0.3 * drop, 0.048), (dx, -drop, 0.022),
                (0.85 * dx, -drop, 0.004), (0.40 * dx, -0.3 * drop, 0.008), (0.0, 0.0, 0.010)]
        return lambda t: add((knot_x, BELT, knot_z), spline(rows, t * 6))

    def loop(path, lean):
        e = 1e-3
        return band(path, 0.050, 0.020, lambda t: cross(sub(path(min(t + e, 1.0)), path(max(t - e, 0.0))), (lean, 1.0, 0.0)), False)

    return [(loop(bow(-0.135, 0.050), -0.35), 0.30, 70), (loop(bow(0.140, 0.040), 0.30), 0.30, 70),
            (band(waist, 0.056, 0.024, outward, False), 1.35, 220), (band(knot, 0.066, 0.028, knot_out, False), 0.26, 48),
            (band(end(-0.075, 0.30, 0.0, 0.008), 0.050, 0.018, lambda t: (-0.15, 0.25, 1.0), True), 0.32, 70),
            (band(end(0.060, 0.36, 0.003, -0.010), 0.050, 0.018, lambda t: (0.20, 0.25, 1.0), True), 0.38, 70)]


BLUE, WHITE, RUST = np.array([[0.20, 0.42, 0.55], [0.93, 0.89, 0.80], [0.72, 0.30, 0.13]])


def pattern():
    """Returns vertical stripes, with a border of lozenges from 0.05 to 0.21 m above the hem and at the
    end of each sleeve."""
    width, height = int(SHEET[0] / PIXEL), int(SHEET[1] / PIXEL)
    x, y = np.meshgrid((np.arange(width) + 0.5) * PIXEL,
                       SHEET[1] - (np.arange(height) + 0.5) * PIXEL)  # v = 0 is the bottom row
    body = x < TORSO_WIDTH
    period = 0.105
    f = (x % period) / period
    colour = np.broadcast_to(BLUE, x.shape + (3,)).copy()
    colour[(f > 0.06) & (f < 0.40)] = WHITE
    colour[(f > 0.18) & (f < 0.28)] = RUST
    along = np.where(body, y, (1 - (y % 0.6) / 0.6) * 0.62)       # from the hem, or from the sleeve's end
    low, high = np.where(body, 0.05, 0.13), np.where(body, 0.21, 0.25)
    inside = (along > low) & (along < high)
    t = (along - low) / (high - low)
    lozenge = np.abs((x % period) / period - 0.5) * 2 + np.abs(t - 0.5) * 2
    border = np.broadcast_to(WHITE, x.shape + (3,)).copy()
    border[lozenge < 0.78] = BLUE
    border[lozenge < 0.45] = RUST
    border[lozenge < 0.20] = WHITE
    border[(t < 0.08) | (t > 0.92)] = RUST
    colour[inside] = border[inside]
    return colour


HANGER = [(-0.185, 0.905), (-0.12, 0.95), (-0.04, 0.992), (0.0, 1.0), (0.04, 0.992), (0.12, 0.95), (0.185, 0.905)]  # x, y of its middle
HOOK = [(0.0, 0.99), (0.0, 1.09), (-0.012, 1.145), (-0.031, 1.178), (-0.035, 1.203), (-0.024, 1.229), (0.0, 1.238),
        (0.024, 1.229), (0.035, 1.203), (0.028, 1.180)]
HANGER_Z = -0.01
PEG = [(0.013, -0.40), (0.013, 0.005), (0.024, 0.012), (0.026, 0.024), (0.018, 0.036), (0.001, 0.040)]  # radius, z
PEG_Y = 1.218
WALL = (-1.4, -0.5, 1.1, 1.6)  # x and y of its lower left corner and of its upper right one
WALL_Z = -0.36
TILE, JOINT = 0.150, 0.004     # metres


def peg(s, h):
    x, z, y = lathe(PEG, 0, 0)(s, h)
    return (x, PEG_Y + y, z)


def wall(s, h):
    return (WALL[0] + s * (WALL[2] - WALL[0]), WALL[1] + h * (WALL[3] - WALL[1]), WALL_Z)


def tiles():
    x, y = np.meshgrid(np.arange(WALL[0], WALL[2], 0.002), np.arange(WALL[3], WALL[1], -0.002))
    i, j = np.floor(x / TILE), np.floor(y / TILE)
    edge = np.minimum(np.minimum(x - i * TILE, (i + 1) * TILE - x), np.minimum(y - j * TILE, (j + 1) * TILE - y))
    glaze = np.array([0.88, 0.88, 0.85]) * (0.92 + 0.10 * random(i.astype(np.int64) + 99, j.astype(np.int64) + 99, 1))[..., None]
    glaze = glaze * (1 - 0.12 * smoothstep(0.012, 0.003, edge))[..., None]
    colour = np.where((edge < JOINT / 2 + 0.0005)[..., None], np.array([0.70, 0.70, 0.68]), glaze)
    return colour * (1 - 0.38 * smoothstep(0.30, 1.25, np.hypot(x - 0.05, 1.1 * (y - 0.68))))[..., None]


def ribs():
    v = 0.80 + 0.20 * np.cos(2 * np.pi * (np.arange(16) + 0.5) / 16)
    return np.broadcast_to(v[None, :, None], (2, 16, 3))


def main():
    out = sys.argv[1]
    os.makedirs(out, exist_ok=True)
    w, h = SHEET
    robe = [("body", grid(lambda s, t: torso(s, t * 1.05), lambda s, t: (s * TORSO_WIDTH / w, t * 1.05 / h), 240, 150))]
    trim = [("collar", grid(collar, lambda t, u: (u * 0.09, t * 1.6), 200, 24, flip=True))]
    for side, base in ((1, 0.0), (-1, 0.6)):
        robe.append((f"sleeve{side}", grid(lambda s, t, side=side: sleeve_point(side, s, t),
                                           lambda s, t, base=base: ((TORSO_WIDTH + 0.02 + s * 0.735) / w, (base + t * 0.599) / h),
                                           72, 72, flip=side > 0)))
        trim.append((f"cuff{side}", grid(lambda s, t, side=side: cuff(side, s, t), lambda s, t: (t * 0.13, s * 0.74), 72, 24, flip=side > 0)))
    write_obj(os.path.join(out, "robe.obj"), robe)
    write_obj(os.path.join(out, "trim.obj"), trim)
    write_obj(os.path.join(out, "belt.obj"), [(f"belt{k}", grid(p, lambda s, t, length=length: (s * 0.14, t * length), 28, along, flip=True))
                                              for k, (p, length, along) in enumerate(belt_parts())])
    plain = lambda s, t: (s, t)
    write_obj(os.path.join(out, "wood.obj"), [("hanger", grid(tube([(x, y, HANGER_Z) for x, y in HANGER], 0.013), plain, 24, 48)),
                                              ("peg", grid(peg, plain, 32, 40, flip=True))])
    write_obj(os.path.join(out, "hook.obj"), [("hook", grid(tube([(x, y, HANGER_Z) for x, y in HOOK], 0.0045), plain, 16, 90))])
    write_obj(os.path.join(out, "wall.obj"), [("wall", grid(wall, plain, 1, 1))])
    write_png(os.path.join(out, "wall.png"), to_bytes(tiles()))
    write_png(os.path.join(out, "pattern.png"), to_bytes(pattern()))
    write_png(os.path.join(out, "ribs.png"), to_bytes(ribs()))


if __name__ == "__main__":
    main()
