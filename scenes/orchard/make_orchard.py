#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the trees of the scene orchard as another program would, and the land that they stand on.

    make_orchard.py DIR

writes
    DIR/apple_1.glb, apple_2.glb   trees of triangles: trunk and branches as tubes that are open at
                                   their ends, cards of leaves, and apples
    DIR/leaves.png                 a spray of leaves, cut out by alpha
    DIR/bark.png                   the bark
    DIR/land.obj                   a slope of 260 x 240 m
    DIR/trees_1.csv, trees_2.csv   where each of 2,000 trees stands, in rows
Units are metres, y is up. The files are the same in every run.
"""
import json
import math
import os
import struct
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from making import add, cross, grid, mul, noise, random, smoothstep, sub, to_bytes, unit, write_obj, write_png  # noqa: E402

ROWS, TREES = 40, 50      # 2,000 trees
BETWEEN, WITHIN = 5.2, 4.0  # metres between rows, and between the trees of a row


class Numbers:
    """Random numbers in a row."""

    def __init__(self, key):
        self.key, self.count = key, 0

    def __call__(self, low=0.0, high=1.0):
        self.count += 1
        return low + (high - low) * float(random(np.array([self.count]), np.array([0]), self.key)[0])


def land(x, z):
    """The height of the land."""
    return 0.045 * -z + 2.2 * math.sin(x / 41 + 0.6) + 1.4 * math.sin(z / 33 + x / 90)


# ---- pictures

def leaves(size=512, count=17):
    """A twig with leaves left and right; red, green, blue and alpha, from 0 to 1."""
    v, u = np.mgrid[0:size, 0:size]
    u, v = (u + 0.5) / size, 1 - (v + 0.5) / size
    picture = np.zeros((size, size, 4))
    number = Numbers(11)

    def paint(where, colour):
        for k in range(3):
            picture[..., k] = np.where(where, colour[k], picture[..., k])
        picture[..., 3] = np.where(where, 1.0, picture[..., 3])

    stem = np.abs(u - 0.5 - 0.02 * np.sin(6 * v)) < 0.008 * (1.3 - v)
    paint(stem & (v < 0.9), (0.30, 0.22, 0.14))
    for k in range(count):
        f = k / (count - 1)
        side = 1 if k % 2 else -1
        angle = math.radians(90 - side * (62 - 50 * f + number(-12, 12)))
        length, width = number(0.24, 0.33) * (1 - 0.25 * f), number(0.42, 0.52)
        root = (0.5 + 0.02 * math.sin(6 * 0.9 * f), 0.03 + 0.78 * f)
        du, dv = u - root[0], v - root[1]
        along = (du * math.cos(angle) + dv * math.sin(angle)) / length
        across = (dv * math.cos(angle) - du * math.sin(angle)) / length
        shape = np.clip(along, 0, 1)
        half = 0.5 * width * np.sin(math.pi * shape ** 0.75) ** 0.8
        inside = (along > 0) & (along < 1) & (np.abs(across) < half)
        shade = number(0.8, 1.15)
        vein = np.abs(np.sin(9 * (along * 1.6 - np.abs(across) * 1.3) * math.pi / 2)) ** 8 * 0.10
        rib = np.exp(-(across / 0.02) ** 2) * 0.25
        light = shade * (0.92 + vein + rib + 0.1 * (across > 0))
        yellow = number(0, 0.25) ** 2 * 4
        colour = [(0.27 + 0.25 * yellow) * light, (0.43 + 0.06 * yellow) * light, 0.16 * light]
        paint(inside, [np.clip(c, 0, 1) for c in colour])
    # Where nothing is, the colour of what is nearest, so that nothing dark bleeds into a mean.
    empty = picture[..., 3] == 0
    for k, c in enumerate((0.27, 0.43, 0.16)):
        picture[..., k] = np.where(empty, c, picture[..., k])
    return to_bytes(picture)


def bark(size=256):
    v, u = np.mgrid[0:size, 0:size] / size
    ridges = sum(noise(u * 12 * 2 ** k, v * 4 * 2 ** k, 40 + k) * 0.5 ** k for k in range(4)) / 1.9
    light = 0.55 + 0.7 * (ridges - 0.5) * 2
    lichen = smoothstep(0.62, 0.75, noise(u * 5, v * 5, 71))
    colour = [(0.36 + 0.08 * lichen) * light, (0.30 + 0.13 * lichen) * light, (0.25 + 0.06 * lichen) * light]
    return to_bytes(np.clip(np.stack(colour, -1), 0, 1))


# ---- the tree

class Part:
    """Triangles of one material."""

    def __init__(self):
        self.points, self.normals, self.uvs, self.indices = [], [], [], []

    def vertex(self, p, n, uv):
        self.points.append(p)
        self.normals.append(n)
        self.uvs.append(uv)
        return len(self.points) - 1


def sides(axis):
    """Two unit vectors across an axis."""
    x = unit(cross(axis, (0.31, 0.11, 0.94) if abs(axis[2]) < 0.8 else (0.95, 0.2, 0.1)))
    return x, cross(axis, x)


def tube(part, line, corners):
    """line: (point, radius) from root to tip."""
    rings, run = [], 0.0
    for i, (p, r) in enumerate(line):
        axis = unit(sub(line[min(i + 1, len(line) - 1)][0], line[max(i - 1, 0)][0]))
        x, y = sides(axis)
        if i:
            run += math.dist(p, line[i - 1][0])
        ring = []
        for k in range(corners + 1):
            angle = 2 * math.pi * k / corners
            n = add(mul(x, math.cos(angle)), mul(y, math.sin(angle)))
            ring.append(part.vertex(add(p, mul(n, r)), n, (k / corners, 1 - run)))
        # The last corner is the first one's place, exactly.
        part.points[ring[-1]] = part.points[ring[0]]
        rings.append(ring)
    for a, b in zip(rings, rings[1:]):
        for k in range(corners):
            part.indices += [a[k], a[k + 1], b[k + 1], a[k], b[k + 1], b[k]]


def card(part, root, along, up, size):
    """A bent card with the picture of leaves."""
    side = unit(cross(along, up))
    face = cross(side, along)
    rows = []
    for f in (0.0, 0.5, 1.0):
        middle = add(add(root, mul(along, size * f)), mul(face, -0.16 * size * f * f))
        rows.append([part.vertex(add(middle, mul(side, 0.42 * size * s)), face, (0.5 + 0.42 * s, 1 - f)) for s in (-1, 1)])
    for a, b in zip(rows, rows[1:]):
        part.indices += [a[0], a[1], b[1], a[0], b[1], b[0]]


def apple(part, middle, radius):
    rows, columns = 5, 8
    ring = lambda j: [part.vertex(
        add(middle, mul((math.sin(math.pi * j / rows) * math.cos(2 * math.pi * i / columns),
                         math.cos(math.pi * j / rows) * 0.92,
                         math.sin(math.pi * j / rows) * math.sin(2 * math.pi * i / columns)), radius)),
        (0.0, 1.0, 0.0), (0.0, 0.0)) for i in range(columns)]
    top = [part.vertex(add(middle, (0.0, 0.8 * radius, 0.0)), (0.0, 1.0, 0.0), (0.0, 0.0))] * columns
    low = [part.vertex(add(middle, (0.0, -0.85 * radius, 0.0)), (0.0, -1.0, 0.0), (0.0, 0.0))] * columns
    circles = [top] + [ring(j) for j in range(1, rows)] + [low]
    for a, b in zip(circles, circles[1:]):
        for k in range(columns):
            n = (k + 1) % columns
            if a is not top:
                part.indices += [a[k], a[n], b[k]]
            if b is not low:
                part.indices += [a[n], b[n], b[k]]


def limb(parts, number, root, direction, length, radius, depth):
    """A branch with those that it bears, and leaves and apples on the last ones."""
    steps = 7 if depth < 2 else 5
    line, p, d = [], root, direction
    wander = 0.10 + 0.06 * depth
    for i in range(steps + 1):
        f = i / steps
        line.append((p, radius * (1 - 0.55 * f)))
        d = unit(add(d, (number(-wander, wander), number(-wander, wander) + (0.05, 0.07, 0.03, -0.07)[depth], number(-wander, wander))))
        p = add(p, mul(d, length / steps))
    if depth < 3:
        tube(parts["bark"], line, (12, 8, 6)[depth])
        count = (7, 6, 6)[depth]
        for k in range(count):
            f = (0.42, 0.3, 0.2)[depth] + (1 - (0.42, 0.3, 0.2)[depth]) * (k + number()) / count
            at = min(f * steps, steps - 0.01)
            a, b = line[int(at)], line[int(at) + 1]
            t = at - int(at)
            start = add(mul(a[0], 1 - t), mul(b[0], t))
            axis = unit(sub(b[0], a[0]))
            x, y = sides(axis)
            turn = 2.4 * k + number(-0.5, 0.5)
            out = add(mul(x, math.cos(turn)), mul(y, math.sin(turn)))
            lean = math.radians(number(38, 66))
            limb(parts, number, start, unit(add(mul(axis, math.cos(lean)), mul(out, math.sin(lean)))),
                 length * number(0.52, 0.72) * (0.8 if depth == 0 else 1), a[1] * 0.55, depth + 1)
    if depth < 2:
        return
    if depth == 3:
        tube(parts["bark"], line, 4)
    for k in range(5 if depth == 3 else 3):
        f = 0.25 + 0.75 * (k + number()) / 5
        at = min(f * steps, steps - 0.01)
        start, axis = line[int(at)][0], unit(sub(line[int(at) + 1][0], line[int(at)][0]))
        x, y = sides(axis)
        turn = number(0, 2 * math.pi)
        out = add(mul(x, math.cos(turn)), mul(y, math.sin(turn)))
        along = unit(add(add(mul(axis, 0.7), mul(out, 0.8)), (0.0, number(-0.45, 0.15), 0.0)))
        up = unit(add((0.0, 1.0, 0.0), (number(-0.7, 0.7), 0.0, number(-0.7, 0.7))))
        card(parts["leaves"], start, along, up, number(0.22, 0.33))
    if number() < 0.4:
        apple(parts["apples"], add(line[-1][0], (0.0, -0.06, 0.0)), number(0.032, 0.042))


def tree(key):
    parts = {"bark": Part(), "leaves": Part(), "apples": Part()}
    number = Numbers(key)
    limb(parts, number, (0.0, -0.15, 0.0), unit((number(-0.06, 0.06), 1.0, number(-0.06, 0.06))), 2.5, 0.13, 0)
    return parts


# ---- files

def write_glb(path, parts):
    binary, views, accessors, primitives = b"", [], [], []

    def store(data, component, count, kind, low=None, high=None):
        nonlocal binary
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        binary += data + b"\0" * (-len(data) % 4)
        accessor = {"bufferView": len(views) - 1, "componentType": component, "count": count, "type": kind}
        if low:
            accessor.update(min=low, max=high)
        accessors.append(accessor)
        return len(accessors) - 1

    for material, part in enumerate(parts.values()):
        p = np.array(part.points, np.float32)
        attributes = {
            "POSITION": store(p.tobytes(), 5126, len(p), "VEC3", p.min(0).tolist(), p.max(0).tolist()),
            "NORMAL": store(np.array(part.normals, np.float32).tobytes(), 5126, len(p), "VEC3"),
            "TEXCOORD_0": store(np.array(part.uvs, np.float32).tobytes(), 5126, len(p), "VEC2")}
        indices = store(np.array(part.indices, np.uint32).tobytes(), 5125, len(part.indices), "SCALAR")
        primitives.append({"attributes": attributes, "indices": indices, "material": material})
    root = {
        "asset": {"version": "2.0", "generator": "make_orchard.py"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "tree"}], "meshes": [{"name": "apple tree", "primitives": primitives}],
        "materials": [
            {"name": "bark", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
            {"name": "leaves", "doubleSided": True, "alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}},
            {"name": "apples", "pbrMetallicRoughness": {"baseColorFactor": [0.55, 0.06, 0.03, 1]}}],
        "textures": [{"source": 0}, {"source": 1}], "images": [{"uri": "bark.png"}, {"uri": "leaves.png"}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(binary)}]}
    text = json.dumps(root, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as f:
        f.write(b"glTF" + struct.pack("<II", 2, 28 + len(text) + len(binary)))
        f.write(struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", len(binary)) + b"BIN\0" + binary)


def write_places(folder):
    number = Numbers(99)
    files = [open(os.path.join(folder, f"trees_{k}.csv"), "w") for k in (1, 2)]
    for f in files:
        f.write("x,y,z,scale,red,green,blue\n")
    for i in range(ROWS):
        for j in range(TREES):
            x = (i - ROWS / 2 + 0.5) * BETWEEN + number(-0.2, 0.2)
            z = -8 - j * WITHIN + number(-0.3, 0.3)
            tint = [number(0.88, 1.1), number(0.9, 1.08), number(0.85, 1.1)]
            files[int(number() < 0.5)].write("%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f\n" % (x, land(x, z), z, number(0.82, 1.12), *tint))
    for f in files:
        f.close()


def main():
    folder = sys.argv[1]
    os.makedirs(folder, exist_ok=True)
    write_png(os.path.join(folder, "leaves.png"), leaves())
    write_png(os.path.join(folder, "bark.png"), bark())
    for k in (1, 2):
        write_glb(os.path.join(folder, f"apple_{k}.glb"), tree(k))
    place = lambda s, t: (260 * (s - 0.5), land(260 * (s - 0.5), 20 - 240 * t), 20 - 240 * t)
    write_obj(os.path.join(folder, "land.obj"), [("land", grid(place, lambda s, t: (s, t), 130, 120))])
    write_places(folder)


if __name__ == "__main__":
    main()
