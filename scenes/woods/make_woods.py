#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the land of the scene woods, and maps that say where each plant grows.

    make_woods.py DIR [AREA]

writes the surfaces
    DIR/land.ply     the land that the camera sees, a wedge up to the horizon
    DIR/meadow.ply   its first 400 m, where undergrowth and grass can be seen
    DIR/oaks.ply, birches.ply, spruces.ply, dead.ply
                     a small square for each of the trees nearby, which stand where they are wanted
and the maps
    DIR/sky.png      the sky, a lat-long image for the dome
    DIR/ground.png   the ground's colours, as the plants on it have them from afar
    DIR/trees.png    red: where spruces stand, green: birches, blue: oaks
    DIR/low.png      red: where grass grows, green: ferns, blue: bushes
    DIR/season.png   what the season does to the colour of broadleaf trees
    DIR/dry.png      and to the grass, which stays green where it is damp
The wedge reaches 10 km, and further if AREA, a factor on its area, is given. Maps lie on the wedge:
their pixels are as large as the distance wants them. Units are metres, y is up, and the camera looks
along -z from above the origin. The files are the same in every run.
"""
import math
import os
import struct
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from making import directions, noise, random, smoothstep, to_bytes, write_png  # noqa: E402

NEAR, FAR, MEADOW = 14.0, 10000.0, 400.0
SPREAD = math.tan(math.radians(20.6))
LEFT, RIGHT = 70.0, 25.0       # land beside the picture: the sun is on the left
SUN = (-0.83, 0.36, -0.43)     # from where it shines
ROWS, COLUMNS = 640, 220

# Trees nearby: x, distance.
OAKS = [(-17.5, 50), (5.5, 93)]
BIRCHES = [(15.5, 47), (19.5, 53), (-31, 92)]
SPRUCES = [(-29, 74), (31, 78), (24, 66), (-37, 104), (-22, 110)]
DEAD = [(-10.5, 72)]

# Ridges: distance, height, half the width, length of their bends.
RIDGES = [(1150, 62, 260, 500), (1900, 120, 330, 900), (3100, 190, 560, 1500), (5200, 330, 900, 2600), (8600, 640, 1500, 3600)]


def fold(x, d, length, key):
    """Returns noise of three octaves from -1 to 1."""
    return sum((2 * noise(x * 2 ** k / length + 31.7 * k, d * 2 ** k / length + 17.3 * k, key + k) - 1) * 0.5 ** k for k in range(3)) / 1.75


def height(x, d):
    """Returns the height of the land: a knoll, a valley, and ridges behind each other."""
    edge = d + 30 * fold(x, 0 * d, 60, 40) * smoothstep(20, 50, d)  # the knoll's, which is not straight
    h = 81 - 7 * smoothstep(25, 70, edge) - 74 * smoothstep(38, 400, edge) ** 0.8
    h = h + 34 * smoothstep(0.10, 0.42, np.abs(x / (d + 40) - 0.03)) * smoothstep(70, 260, d) * smoothstep(900, 400, d)
    for k, (at, top, width, bend) in enumerate(RIDGES):
        line = at + 0.35 * bend * fold(x, 0 * d, bend, 50 + 10 * k)
        crest = top * (1 + 0.55 * fold(x + 0.4 * d, 0.15 * d, 0.8 * bend, 90 + 10 * k))
        h = h + crest * np.exp(-np.abs((d - line) / width) ** 1.7)
    for k, length in enumerate((90, 260, 700, 1900)):
        h = h + 0.10 * length * fold(x, d, length, 130 + 10 * k) * smoothstep(0.9 * length, 3.2 * length, d)
    return h + (0.35 * fold(x, d, 9, 170) + 0.8 * fold(x, d, 26, 180) + 1.5 * fold(x, d, 48, 190)) * smoothstep(14, 40, d)


def distances(v):
    """Returns the distance of each place along the wedge, v from 0 to 1: by factors, not by steps."""
    return NEAR * (FAR / NEAR) ** v


def across(u, d):
    """Returns x of each place across the wedge, u from 0 to 1."""
    return (-SPREAD * d - LEFT) + u * (2 * SPREAD * d + LEFT + RIGHT)


def write_ply(path, points, coordinates, faces):
    """Writes quads with texture coordinates."""
    with open(path, "wb") as f:
        f.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty double x\nproperty double y\nproperty double z\n"
                 "property float u\nproperty float v\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n" % (len(points), len(faces))).encode())
        vertices = np.zeros(len(points), dtype=[("p", "<f8", 3), ("t", "<f4", 2)])
        vertices["p"], vertices["t"] = points, coordinates
        f.write(vertices.tobytes())
        quads = np.zeros(len(faces), dtype=[("n", "u1"), ("i", "<i4", 4)])
        quads["n"], quads["i"] = 4, faces
        f.write(quads.tobytes())


def write_land(path, to, rows):
    last = math.log(to / NEAR) / math.log(FAR / NEAR)
    v, u = np.meshgrid(np.linspace(0, last, rows + 1), np.linspace(0, 1, COLUMNS + 1), indexing="ij")
    d = distances(v)
    x = across(u, d)
    a = (np.arange(rows)[:, None] * (COLUMNS + 1) + np.arange(COLUMNS)).ravel()
    write_ply(path, np.stack([x, height(x, d), -d], -1).reshape(-1, 3), np.stack([u, v], -1).reshape(-1, 2),
              np.stack([a, a + 1, a + COLUMNS + 2, a + COLUMNS + 1], -1))


def write_places(path, places):
    """Writes a square of 20 cm for each place; a layer of 25 boxes to the square metre stands one on each."""
    x, d = np.array(places, dtype=float).T
    y = height(x, d) - 0.1
    corners = [np.stack([x + i, y, -(d + j)], -1) for i, j in ((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1))]
    points = np.stack(corners, 1).reshape(-1, 3)
    write_ply(path, points, np.zeros((len(points), 2)), np.arange(len(points)).reshape(-1, 4))


def sky(width=2048):
    """Returns the evening's sky: warm and bright around the sun, pale at the horizon, with thin clouds."""
    dx, dy, dz = directions(width)
    rise = np.maximum(dy, 0)[..., None]
    sun = np.array(SUN) / np.linalg.norm(SUN)
    near = np.clip(dx * sun[0] + dy * sun[1] + dz * sun[2], 0, 1)[..., None]
    horizon, zenith = np.array([0.86, 0.80, 0.72]), np.array([0.22, 0.40, 0.70])
    colour = zenith + (horizon - zenith) * np.exp(-rise / 0.16)
    colour = colour + np.array([0.22, 0.13, 0.03]) * near ** 3 * np.exp(-rise / 0.5) + np.array([0.3, 0.22, 0.1]) * near ** 40
    x, y = dx / (np.maximum(dy, 0) + 0.07), -dz / (np.maximum(dy, 0) + 0.07)
    streak = sum(noise(x * 1.1 * 2 ** k + 5 * k, y * 0.45 * 2 ** k + 3, 20 + k) * 0.55 ** k for k in range(6)) / 2.16
    cloud = smoothstep(0.44, 0.72, streak)[..., None] * smoothstep(0.02, 0.14, rise) * 0.75
    colour = colour + (np.array([0.98, 0.90, 0.82]) - colour) * cloud
    below = smoothstep(0.0, -0.05, dy)[..., None]
    return np.clip(colour + (np.array([0.20, 0.20, 0.13]) - colour) * below, 0, 1)


def write_maps(out, columns=512, rows=1280):
    v, u = np.meshgrid((np.arange(rows) + 0.5) / rows, (np.arange(columns) + 0.5) / columns, indexing="ij")
    d = distances(v)
    x = across(u, d)
    h = height(x, d)
    rough = fold(x, d, 30, 1)
    # Meadows: the knoll and the slope below it, the valley's floor, and clearings.
    side = np.abs(x / (d + 12) - 0.02)
    knoll = smoothstep(1.0, 0.7, side / (0.27 - 0.10 * smoothstep(60, 240, d)) + 0.45 * rough) * smoothstep(300, 210, d + 40 * rough)
    knoll = np.maximum(knoll, smoothstep(66, 52, d + 8 * rough))
    river = 470 + 60 * np.sin(x / 130) + 25 * np.sin(x / 47)
    valley = smoothstep(150, 95, np.abs(d - river) * (1 + 0.002 * np.abs(x)) + 60 * rough + 45 * fold(x, d, 120, 5))
    clearing = smoothstep(0.34, 0.50, fold(x, d, 240, 9) + 0.16 * rough) * smoothstep(500, 800, d)
    high = smoothstep(520, 720, h + 60 * fold(x, d, 300, 12))
    open_land = np.clip(np.maximum.reduce([knoll, valley, clearing, high]), 0, 1)
    wood = 1 - open_land
    # Groups of trees in the valley, and lonely ones.
    groups = smoothstep(0.30, 0.42, fold(x, d, 55, 15)) * smoothstep(330, 380, d) * (1 - high)
    wood = np.maximum(wood, 0.8 * groups)
    conifers = np.clip(smoothstep(20, 190, h + 70 * fold(x, d, 160, 21)) * 0.75 + 0.25 * smoothstep(0.0, 0.25, fold(x, d, 110, 25)), 0, 1)
    patch = smoothstep(-0.12, 0.12, fold(x, d, 80, 31))
    # Stands of one age have gaps.
    full = 0.72 + 0.28 * smoothstep(-0.3, 0.1, fold(x, d, 40, 35))
    spruce = wood * full * (0.10 + 0.90 * conifers)
    birch = wood * full * (1 - 0.92 * conifers) * (1 - 0.75 * patch)
    oak = wood * full * (1 - 0.92 * conifers) * (0.10 + 0.90 * patch)
    write_png(os.path.join(out, "trees.png"), to_bytes(np.stack([spruce, birch, oak], -1)[::-1]))

    edge = smoothstep(0.05, 0.5, open_land) * smoothstep(1.0, 0.6, open_land)
    grass = open_land * smoothstep(400, 260, d)
    fern = np.clip(edge * 0.9 + 0.6 * wood * smoothstep(180, 90, d) + 0.25 * open_land * smoothstep(0.25, 0.45, fold(x, d, 12, 41)), 0, 1) * smoothstep(260, 170, d)
    bush = np.clip(edge * 0.8 + 0.7 * open_land * smoothstep(0.30, 0.42, fold(x, d, 16, 45)), 0, 1) * smoothstep(26, 34, d)
    write_png(os.path.join(out, "low.png"), to_bytes(np.stack([grass, fern, bush], -1)[::-1]))

    soil, moss, green, straw = (np.array(c)[None, None, :] for c in ((0.22, 0.17, 0.11), (0.17, 0.20, 0.08), (0.30, 0.36, 0.13), (0.50, 0.44, 0.22)))
    damp = smoothstep(-0.2, 0.3, fold(x, d, 7, 51))[..., None]
    dry = smoothstep(-0.15, 0.35, fold(x, d, 60, 55))[..., None]
    floor = soil + (moss - soil) * damp
    meadow = green + (straw - green) * dry * 0.8
    write_png(os.path.join(out, "ground.png"), to_bytes(floor + (meadow - floor) * open_land[..., None])[::-1])
    lush, straw = np.array([0.62, 0.86, 0.50]), np.array([1.45, 1.12, 0.78])
    parched = smoothstep(-0.30, 0.30, fold(x, d, 18, 65) + 0.5 * fold(x, d, 4, 66))[..., None]
    write_png(os.path.join(out, "dry.png"), to_bytes(((lush + (straw - lush) * parched) / 1.5) ** (1 / 2.2))[::-1])
    turned = 0.55 * smoothstep(0.0, 0.35, fold(x, d, 70, 61)) + 0.6 * random(*np.indices(x.shape), 9) ** 3
    green, gold = np.array([0.62, 0.64, 0.60]), np.array([1.40, 0.86, 0.42])
    write_png(os.path.join(out, "season.png"), to_bytes(((green + (gold - green) * np.clip(turned, 0, 1)[..., None]) / 1.5) ** (1 / 2.2))[::-1])


def main():
    global FAR
    out = sys.argv[1]
    os.makedirs(out, exist_ok=True)
    reach = FAR * math.sqrt(float(sys.argv[2]) if len(sys.argv) > 2 else 1.0)
    rows = round(ROWS * math.log(reach / NEAR) / math.log(FAR / NEAR))
    FAR = reach
    write_land(os.path.join(out, "land.ply"), FAR, rows)
    write_land(os.path.join(out, "meadow.ply"), MEADOW, round(rows * math.log(MEADOW / NEAR) / math.log(FAR / NEAR)))
    for name, places in (("oaks", OAKS), ("birches", BIRCHES), ("spruces", SPRUCES), ("dead", DEAD)):
        write_places(os.path.join(out, name + ".ply"), places)
    write_maps(out)
    write_png(os.path.join(out, "sky.png"), to_bytes(sky()))


if __name__ == "__main__":
    main()
