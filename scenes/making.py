# SPDX-License-Identifier: Apache-2.0
"""What the scenes' generators share: parametric patches, OBJ and PNG files, and noise.

Noise and random numbers depend on their key alone, so that a generator writes the same files
whenever it runs.
"""
import math
import struct
import zlib

import numpy as np


def spline(rows, t):
    """Returns the Catmull-Rom spline at t, which passes rows[i] at t = i; t is clamped."""
    t = min(max(t, 0.0), len(rows) - 1.0)
    i = min(int(t), len(rows) - 2)
    f = t - i
    p0, p1, p2, p3 = (rows[min(max(i + k, 0), len(rows) - 1)] for k in (-1, 0, 1, 2))
    return tuple(0.5 * (2 * b + (c - a) * f + (2 * a - 5 * b + 4 * c - d) * f * f + (3 * b - a - 3 * c + d) * f ** 3)
                 for a, b, c, d in zip(p0, p1, p2, p3))


def add(a, b): return tuple(x + y for x, y in zip(a, b))
def sub(a, b): return tuple(x - y for x, y in zip(a, b))
def mul(a, s): return tuple(x * s for x in a)
def cross(a, b): return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(sum(x * x for x in a))
    return mul(a, 1 / length)


def grid(point, uv, nu, nv, flip=False):
    """Returns vertices, texture coordinates and faces of a parametric patch of nu x nv quads."""
    vertices, coordinates, faces = [], [], []
    for j in range(nv + 1):
        for i in range(nu + 1):
            vertices.append(point(i / nu, j / nv))
            coordinates.append(uv(i / nu, j / nv))
    for j in range(nv):
        for i in range(nu):
            a = j * (nu + 1) + i
            quad = (a, a + 1, a + nu + 2, a + nu + 1)
            faces.append(quad[::-1] if flip else quad)
    return vertices, coordinates, faces


def normal(point, s, h):
    """Returns the unit normal of a parametric patch over the unit square: that of grid()'s faces."""
    e = 1e-3
    return unit(cross(sub(point(min(s + e, 1), h), point(max(s - e, 0), h)), sub(point(s, min(h + e, 1)), point(s, max(h - e, 0)))))


def superellipse(c, d, power):
    """Returns the distance from the origin to |x|^power + |y|^power = 1 in the direction (c, d)."""
    return (abs(c) ** power + abs(d) ** power) ** (-1 / power)


def sleeve(rows, side, s, h, flat, swell):
    """Returns a point of a garment's sleeve.

    rows   x, y, z of its axis and its radius, from the left shoulder to the end
    side   1 for the left sleeve, -1 for the right one
    s      in [0, 1] around it, from the seam on the inside
    h      in [0, 1] along it, from the shoulder
    flat   its depth divided by its width
    swell  swell(r) is the radius there instead of r
    """
    t = h * (len(rows) - 1)
    x, y, z, r = spline(rows, t)
    ax, ay, az, _ = sub(spline(rows, t + 0.01), spline(rows, t - 0.01))
    axis = unit((ax, ay, az))
    inner = unit(cross(axis, (0, 0, 1)))
    front = cross(inner, axis)
    angle, r = 2 * math.pi * s, swell(r)
    p = add((x, y, z), add(mul(inner, r * math.cos(angle)), mul(front, r * math.sin(angle) * flat)))
    return (side * p[0], p[1], p[2])


def lathe(rows, x, z):
    """Returns the function, for grid(), of a body of revolution about the upright line at (x, z).
    rows: radius and height, from the bottom to the top."""
    def point(s, h):
        r, y = spline(rows, h * (len(rows) - 1))
        return (x + r * math.sin(2 * math.pi * s), y, z + r * math.cos(2 * math.pi * s))
    return point


def tube(rows, radius):
    """Returns the function, for grid(), of a round tube through rows of (x, y, z). It must not run
    along +z."""
    def point(s, h):
        t = h * (len(rows) - 1)
        axis = unit(sub(spline(rows, t + 0.01), spline(rows, t - 0.01)))
        side = unit(cross(axis, (0, 0, 1)))
        angle = 2 * math.pi * s
        return add(spline(rows, t), add(mul(side, radius * math.cos(angle)), mul(cross(side, axis), radius * math.sin(angle))))
    return point


def write_ball(path, radius, comment, across=96, up=48):
    """Writes a sphere around the origin as an OBJ file, with `across` faces around its axis and `up`
    from pole to pole."""
    with open(path, "w") as f:
        f.write(f"# {comment}\nv 0 {-radius} 0\nv 0 {radius} 0\n")
        for j in range(1, up):
            for i in range(across):
                a, b = 2 * math.pi * i / across, math.pi * (j / up - 0.5)
                f.write("v %.6f %.6f %.6f\n" % (radius * math.cos(b) * math.sin(a), radius * math.sin(b), radius * math.cos(b) * math.cos(a)))
        ring = lambda j, i: 3 + (j - 1) * across + i % across
        for i in range(across):
            f.write("f 1 %d %d\n" % (ring(1, i + 1), ring(1, i)))
            for j in range(1, up - 1):
                f.write("f %d %d %d %d\n" % (ring(j, i), ring(j, i + 1), ring(j + 1, i + 1), ring(j + 1, i)))
            f.write("f 2 %d %d\n" % (ring(up - 1, i), ring(up - 1, i + 1)))


def write_obj(path, patches):
    """Writes [(name, grid(...))] as an OBJ file with texture coordinates."""
    with open(path, "w") as f:
        f.write("# metres\n")
        base = 1
        for name, (vertices, coordinates, faces) in patches:
            f.write(f"o {name}\n")
            f.writelines("v %.6f %.6f %.6f\n" % v for v in vertices)
            f.writelines("vt %.6f %.6f\n" % t for t in coordinates)
            f.writelines("f " + " ".join(f"{base + k}/{base + k}" for k in q) + "\n" for q in faces)
            base += len(vertices)


def write_png(path, pixels):
    """Writes 8-bit pixels of shape (height, width), (height, width, 3) or, with alpha, (..., 4)."""
    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))
    height, width = pixels.shape[:2]
    raw = b"".join(b"\0" + row.tobytes() for row in pixels)
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, {1: 0, 3: 2, 4: 6}[pixels.shape[2] if pixels.ndim == 3 else 1], 0, 0, 0))
                + chunk(b"IDAT", zlib.compress(raw, 6)) + chunk(b"IEND", b""))


def directions(width):
    """Returns the directions (x, y, z) of the pixels of a lat-long image of width x width / 2, as the
    dome of a scene looks at it: its middle looks along -z, its right half towards +x."""
    turn = 2 * math.pi * ((np.arange(width) + 0.5) / width - 0.5)
    rise = math.pi * (0.5 - (np.arange(width // 2) + 0.5) / (width // 2))
    turn, rise = np.meshgrid(turn, rise)
    return np.sin(turn) * np.cos(rise), np.sin(rise), -np.cos(turn) * np.cos(rise)


def to_bytes(values):
    """Returns values from 0 to 1 as 8-bit pixels."""
    return np.clip(np.rint(255 * values), 0, 255).astype(np.uint8)


def random(i, j, key):
    """Returns numbers in [0, 1) that depend on the cell (i, j) and the key alone, for arrays of cells."""
    h = (np.asarray(i).astype(np.uint64) * np.uint64(0xBF58476D1CE4E5B9)) ^ (np.asarray(j).astype(np.uint64) * np.uint64(0x94D049BB133111EB))
    h = h + np.uint64(key * 0x9E3779B97F4A7C15 & 2 ** 64 - 1)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        h = (h ^ (h >> np.uint64(shift))) * np.uint64(factor)
    return ((h ^ (h >> np.uint64(31))) >> np.uint64(11)).astype(float) / 2 ** 53


def smoothstep(a, b, x):
    """Returns 0 at a, 1 at b and a smooth curve between them, for arrays."""
    t = np.clip((x - a) / (b - a), 0, 1)
    return t * t * (3 - 2 * t)


def noise(x, y, key):
    """Returns value noise from 0 to 1, whose features have a length of 1."""
    i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    f, g = smoothstep(0, 1, x - i), smoothstep(0, 1, y - j)
    low = random(i, j, key) * (1 - f) + random(i + 1, j, key) * f
    high = random(i, j + 1, key) * (1 - f) + random(i + 1, j + 1, key) * f
    return low * (1 - g) + high * g
