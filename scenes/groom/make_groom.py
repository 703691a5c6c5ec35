#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes a head and its hair: a mohawk of curly strands, and stubble beside it.

    make_groom.py DIR

writes
    DIR/head.obj        head and neck, as of a tailor's dummy
    DIR/hair.hair       strands in Cem Yuksel's format, with a width and a colour for each point
    DIR/hair.hair.json  what that format has no place for: group 0 is the mohawk, 1 the stubble
Units are metres, +y is up, the face looks along +z, and the origin lies between the ears. The files
are the same in every run.
"""
import json
import os
import struct
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from making import random, smoothstep  # noqa: E402

ACROSS, UP = 320, 240          # faces of the head
STRANDS, POINTS = 16000, 36    # of the mohawk
STUBBLE, STUBBLE_POINTS = 26000, 5
CLUMPS = 150


def length(v):
    return np.sqrt((v * v).sum(-1))


def unit(v):
    return v / np.maximum(length(v), 1e-12)[..., None]


def ellipsoid(p, centre, radii):
    q = (p - np.array(centre)) / np.array(radii)
    k = length(q)
    return k * (k - 1) / np.maximum(length(q / np.array(radii)), 1e-9)


def capsule(p, a, b, r, end=None):
    a, b = np.array(a), np.array(b)
    t = np.clip(((p - a) @ (b - a)) / ((b - a) @ (b - a)), 0, 1)
    return length(p - a - t[..., None] * (b - a)) - (r + ((r if end is None else end) - r) * t)


def join(a, b, k):
    """The union of two bodies, rounded over a distance k."""
    h = np.clip(0.5 + 0.5 * (b - a) / k, 0, 1)
    return b + (a - b) * h - k * h * (1 - h)


def cut(a, b, k):
    """What of a is not in b."""
    return -join(-a, b, k)


def distance(p):
    """Returns about the distance from the head's surface, negative inside."""
    p = np.stack([np.abs(p[..., 0]), p[..., 1], p[..., 2]], -1)
    d = ellipsoid(p, (0, 0.045, -0.012), (0.076, 0.083, 0.097))                    # cranium
    d = join(d, ellipsoid(p, (0, -0.030, 0.028), (0.058, 0.085, 0.062)), 0.040)    # face
    d = join(d, ellipsoid(p, (0, -0.090, 0.050), (0.034, 0.026, 0.034)), 0.030)    # chin
    d = join(d, capsule(p, (0.020, 0.017, 0.083), (0.042, 0.012, 0.070), 0.008), 0.016)  # brow
    d = join(d, ellipsoid(p, (0.040, -0.030, 0.060), (0.022, 0.020, 0.022)), 0.022)      # cheek
    d = cut(d, ellipsoid(p, (0.031, -0.008, 0.096), (0.020, 0.012, 0.016)), 0.022)       # socket
    d = join(d, capsule(p, (0, 0.006, 0.090), (0, -0.034, 0.110), 0.007, 0.010), 0.012)  # nose
    d = join(d, ellipsoid(p, (0.010, -0.038, 0.100), (0.008, 0.007, 0.010)), 0.006)      # its wings
    d = join(d, ellipsoid(p, (0, -0.0625, 0.089), (0.022, 0.0055, 0.012)), 0.006)        # lips
    d = join(d, ellipsoid(p, (0, -0.0725, 0.088), (0.018, 0.0060, 0.012)), 0.005)
    d = join(d, ellipsoid(p, (0.072, -0.002, -0.012), (0.013, 0.029, 0.018)), 0.016)      # ear
    d = join(d, capsule(p, (0, -0.03, -0.030), (0, -0.30, -0.045), 0.054, 0.066), 0.030)  # neck
    return cut(d, p[..., 1] + 0.210, 0.020)


def on_surface(directions):
    """Returns the surface's points in the directions from the origin: the outermost ones."""
    near, far = np.zeros(directions.shape[:-1]), np.full(directions.shape[:-1], 0.40)
    for t in np.linspace(0.40, 0.02, 160):
        outside = distance(directions * t) > 0
        open_ = near == 0
        far = np.where(open_ & outside, t, far)
        near = np.where(open_ & ~outside, t, near)
    for _ in range(30):
        middle = (near + far) / 2
        inside = distance(directions * middle[..., None]) < 0
        near, far = np.where(inside, middle, near), np.where(inside, far, middle)
    return directions * near[..., None]


def normals(p):
    e = 5e-4 * np.eye(3)
    return unit(np.stack([distance(p + e[a]) - distance(p - e[a]) for a in range(3)], -1))


def write_head(path):
    turn, rise = np.meshgrid(2 * np.pi * np.arange(ACROSS) / ACROSS, np.pi * (np.arange(1, UP) / UP - 0.5))
    directions = np.stack([np.sin(turn) * np.cos(rise), np.sin(rise), np.cos(turn) * np.cos(rise)], -1)
    points = on_surface(directions).reshape(-1, 3)
    poles = on_surface(np.array([[0.0, -1, 0], [0, 1, 0]]))
    with open(path, "w") as f:
        f.write("# metres\n")
        f.writelines("v %.6f %.6f %.6f\n" % tuple(p) for p in np.concatenate([poles, points]))
        f.writelines("vn %.4f %.4f %.4f\n" % tuple(n) for n in normals(np.concatenate([poles, points])))
        ring = lambda j, i: 3 + (j - 1) * ACROSS + i % ACROSS  # noqa: E731
        face = lambda *c: f.write("f " + " ".join(f"{k}//{k}" for k in c) + "\n")  # noqa: E731
        for i in range(ACROSS):
            face(1, ring(1, i + 1), ring(1, i))
            for j in range(1, UP - 1):
                face(ring(j, i), ring(j, i + 1), ring(j + 1, i + 1), ring(j + 1, i))
            face(2, ring(UP - 1, i), ring(UP - 1, i + 1))


def mohawk():
    """Returns points (strands, POINTS, 3), widths and colours of the mohawk."""
    n = np.arange(STRANDS)
    key = lambda k, of=n: random(of, np.zeros_like(of), k)  # noqa: E731
    # Roots in a strip over the head, from the forehead to the nape; each belongs to a clump.
    clump = (key(1) * CLUMPS).astype(int)
    along = (clump + 0.5 + 2.2 * (key(2) - 0.5)) / CLUMPS
    side = 0.016 * (2 * key(3, clump) - 1) + 0.010 * (key(4) - 0.5)

    def root_of(along, side):
        angle = np.radians(52 - 150 * along)           # from straight up towards the face
        return on_surface(unit(np.stack([side / 0.12, np.cos(angle), np.sin(angle)], -1)))

    roots = root_of(along, side)
    out = normals(roots)
    middles = root_of((clump + 0.5) / CLUMPS, 0.016 * (2 * key(3, clump) - 1))
    middle_out = normals(middles)
    size = (0.135 - 0.065 * np.abs(along - 0.30) ** 1.0) * (0.80 + 0.35 * key(5, clump)) * (0.85 + 0.3 * key(6))
    # A clump leans back and to its side; the ends bow over.
    s = np.linspace(0, 1, POINTS)[None, :, None]
    lean = unit(np.stack([0.55 * (2 * key(7, clump) - 1), 0.25 + 0.0 * along, -0.75 + 0.5 * (key(8, clump) - 0.5)], -1))
    def path(root, out_, size_):
        rise = unit(out_ + 0.10 * lean)[:, None]
        return root[:, None] + size_[:, None, None] * (rise * (s - 0.22 * s ** 3) + lean[:, None] * 0.42 * s ** 2.4 - np.array([0, 0.16, 0]) * s ** 4)
    own = path(roots, out, size)
    together = path(middles, middle_out, size * 0.3 + 0.7 * (0.135 - 0.065 * np.abs((clump + 0.5) / CLUMPS - 0.30)) * (0.80 + 0.35 * key(5, clump)))
    gather = 0.72 * smoothstep(0.05, 0.75, s)
    line = own * (1 - gather) + together * gather
    # Curls: helices, of which a clump has one phase and each strand a little of its own.
    phase = 2 * np.pi * (key(9, clump) + 0.10 * (key(10) - 0.5))[:, None]
    turns = (3.0 + 1.6 * key(11, clump) + 0.25 * (key(12) - 0.5))[:, None]
    radius = 0.0075 * (0.7 + 0.6 * key(13, clump))[:, None] * smoothstep(0.08, 0.7, s[..., 0]) + 0.0010 * (key(14)[:, None] - 0.5)
    across = unit(np.cross(out, np.array([0.3, 0.1, 1.0])))
    other = unit(np.cross(out, across))
    angle = phase + 2 * np.pi * turns * s[..., 0]
    line = line + (radius * np.cos(angle))[..., None] * across[:, None] + (radius * np.sin(angle))[..., None] * other[:, None]
    line += 0.0035 * s * (np.stack([key(k) for k in (15, 16, 17)], -1) - 0.5)[:, None]      # stray ends
    line = line - 0.001 * out[:, None]
    width = 0.00013 * (1 - 0.70 * s[..., 0] ** 2) * (0.8 + 0.4 * key(18))[:, None]
    dark, copper, gold = np.array([0.055, 0.014, 0.008]), np.array([0.50, 0.125, 0.030]), np.array([0.92, 0.52, 0.17])
    f, g = smoothstep(0.02, 0.55, s), smoothstep(0.50, 1.0, s)
    colour = (dark * (1 - f) + copper * f) * (1 - g) + gold * g
    return line, width, colour * (0.75 + 0.5 * key(19, clump) * key(20))[:, None, None]


def stubble():
    """Returns the same of short hairs on the rest of the scalp."""
    n = np.arange(4 * STUBBLE)
    key = lambda k: random(n, np.zeros_like(n), k)  # noqa: E731
    y, turn = 2 * key(31) - 1, 2 * np.pi * key(32)
    flat = np.sqrt(1 - y * y)
    roots = on_surface(np.stack([flat * np.sin(turn), y, flat * np.cos(turn)], -1))
    x, y, z = roots.T
    hairline = 0.058 - 0.9 * np.maximum(0, 0.062 - z) * (z > -0.01) + 0.10 * np.minimum(0, z + 0.01)
    scalp = (y > hairline - 0.045 * (z < 0.02) + 0.006 * key(33)) & (z < 0.066 + 0.004 * key(34)) & (y > np.where(z > -0.062, 0.030, -0.055) + 0.010 * key(36)) & (np.abs(x) > 0.012)
    ear = (np.abs(x) > 0.066) & (y < 0.040) & (z > -0.045)
    roots = roots[scalp & ~ear][:STUBBLE]
    out = normals(roots)
    key2 = lambda k: random(np.arange(len(roots)), np.ones(len(roots), int), k)  # noqa: E731
    size = 0.0045 * (0.6 + 0.6 * key2(37))
    s = np.linspace(0, 1, STUBBLE_POINTS)[None, :, None]
    lean = np.array([0, -0.5, -0.6]) + 0.6 * (np.stack([key2(k) for k in (38, 39, 40)], -1) - 0.5)
    line = roots[:, None] + size[:, None, None] * (unit(out + 0.5 * lean)[:, None] * s + 0.35 * lean[:, None] * s ** 2) - 0.0006 * out[:, None]
    width = 0.00012 * (1 - 0.6 * s[..., 0]) * np.ones(len(roots))[:, None]
    colour = np.array([0.050, 0.016, 0.009]) * (0.7 + 0.6 * key2(41))[:, None, None] * np.ones((1, STUBBLE_POINTS, 1))
    return line, width, colour


def write_hair(path, groups):
    """Writes groups of (points, widths, colours) as a HAIR file and its sidecar."""
    counts = np.concatenate([np.full(len(p), p.shape[1]) for p, _, _ in groups])
    flat = lambda k, size: np.concatenate([g[k].reshape(-1, size) for g in groups]).astype("<f4").tobytes()  # noqa: E731
    segments, points, thickness, colours = 1, 2, 4, 16
    header = struct.pack("<4s4I5f", b"HAIR", len(counts), counts.sum(), segments | points | thickness | colours, 0, 0.0002, 0.0, 0.5, 0.5, 0.5)
    with open(path, "wb") as f:
        f.write(header.ljust(128, b"\0") + (counts - 1).astype("<u2").tobytes() + flat(0, 3) + flat(1, 1) + flat(2, 3))
    with open(path + ".json", "w") as f:
        json.dump({"unit": 1.0, "up": "y", "groups": [k for k, g in enumerate(groups) for _ in range(len(g[0]))]}, f)


def main():
    folder = sys.argv[1]
    write_head(os.path.join(folder, "head.obj"))
    write_hair(os.path.join(folder, "hair.hair"), [mohawk(), stubble()])


if __name__ == "__main__":
    main()
