"""What the scenes' generators share: parametric patches, OBJ and PNG files, and noise that depends on its key alone."""
import math
import struct
import zlib

import numpy as np


def spline(rows, t):
    """Catmull-Rom through rows[i] at t = i; t is clamped."""
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
    """Vertices, texture coordinates and faces of a parametric patch of nu x nv quads."""
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


def write_obj(path, patches):
    """An OBJ file of [(name, grid(...))], with texture coordinates."""
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
    """8-bit pixels of shape (height, width) or (height, width, 3)."""
    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))
    height, width = pixels.shape[:2]
    raw = b"".join(b"\0" + row.tobytes() for row in pixels)
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2 if pixels.ndim == 3 else 0, 0, 0, 0))
                + chunk(b"IDAT", zlib.compress(raw, 6)) + chunk(b"IEND", b""))


def to_bytes(values):
    """Values from 0 to 1 as 8-bit pixels."""
    return np.clip(np.rint(255 * values), 0, 255).astype(np.uint8)


def random(i, j, key):
    """Numbers in [0, 1) that depend on the cell and the key alone; arrays in, array out."""
    h = (np.asarray(i).astype(np.uint64) * np.uint64(0xBF58476D1CE4E5B9)) ^ (np.asarray(j).astype(np.uint64) * np.uint64(0x94D049BB133111EB))
    h = h + np.uint64(key * 0x9E3779B97F4A7C15 & 2 ** 64 - 1)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        h = (h ^ (h >> np.uint64(shift))) * np.uint64(factor)
    return ((h ^ (h >> np.uint64(31))) >> np.uint64(11)).astype(float) / 2 ** 53


def smoothstep(a, b, x):
    """0 at a, 1 at b, smooth between; arrays in, array out."""
    t = np.clip((x - a) / (b - a), 0, 1)
    return t * t * (3 - 2 * t)


def noise(x, y, key):
    """Value noise with features of length 1, 0 to 1."""
    i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    f, g = smoothstep(0, 1, x - i), smoothstep(0, 1, y - j)
    low = random(i, j, key) * (1 - f) + random(i + 1, j, key) * f
    high = random(i, j + 1, key) * (1 - f) + random(i + 1, j + 1, key) * f
    return low * (1 - g) + high * g
