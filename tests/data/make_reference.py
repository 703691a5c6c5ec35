#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Computes the reference values of this folder from the equations of docs/MODEL.md, in double
precision and without the library.

    make_reference.py write DIR    writes the three files below
    make_reference.py check DIR    fails if a number of a file is off by more than 1e-12 of itself
                                   (or of 1, if it is smaller)

    surface.json         MODEL 4: the light `rgb` that a surface-like voxel shows under one light of
                         strength 1, without attenuation
    fibre.json           MODEL 5: the same for a fibre, with `axis` as its tangent
    line_integrals.json  MODEL 3: the optical depth along rays through 6 x 6 x 6 voxels, with both
                         filters, in index space

The inputs are random, from a fixed seed, with special cases among them: mirror directions, grazing
ones, light from behind, gamma = 0, n = 1 and n < 1. The exit status is 77 if numpy is missing.
"""
import json
import math
import os
import sys

try:
    import numpy as np
except ImportError as missing:
    print(f"skipped: {missing} (Debian: python3-numpy)")
    sys.exit(77)

SEED = 1
LEAST_COSINE = 0.01  # lower bound of cos theta_r and cos theta_Q
LEAST_GAMMA = 0.001  # radians


def unit(v):
    v = np.asarray(v, float)
    return v / np.linalg.norm(v)


def arccos(x):
    return math.acos(max(-1.0, min(1.0, x)))


# ---- the two reflection models

def width_factor(phi, gamma):
    """D, the width of the highlight; phi and gamma in radians."""
    gamma = max(gamma, LEAST_GAMMA)
    return math.exp(-math.log(2) * phi * phi / (gamma * gamma))


def fresnel(c, n):
    """F, where c = cos theta_Q; 1 beyond the critical angle and 0 if nothing refracts."""
    g_squared = n * n + c * c - 1
    if n == 1:
        return 0.0
    if g_squared < 0:
        return 1.0
    g = math.sqrt(g_squared)
    if g + c == 0:
        return 1.0
    return 0.5 * ((g - c) / (g + c)) ** 2 * (1 + ((c * (g + c) - 1) / (c * (g - c) + 1)) ** 2)


def colour(material, diffuse, specular):
    return material["alpha"] * diffuse * np.array(material["c_b"]) \
        + material["beta"] * specular * np.array(material["e"])


def surface(N, V, L, material):
    """MODEL 4."""
    if N @ V < 0:
        N = -N
    cos_i, cos_r = float(N @ L), float(N @ V)
    if cos_i <= 0:
        return np.zeros(3)
    if np.linalg.norm(V + L) < 1e-6:
        return colour(material, cos_i, 0.0)
    Q = unit(V + L)
    cos_phi, cos_q = float(N @ Q), float(V @ Q)
    r, q = max(cos_r, LEAST_COSINE), max(cos_q, LEAST_COSINE)
    masking = min(1 / r, 2 * cos_phi / q, 2 * cos_phi * cos_i / (q * r))  # G / cos theta_r
    return colour(material, cos_i, width_factor(arccos(cos_phi), material["gamma"])
                  * fresnel(cos_q, material["n"]) * masking)


def fibre(t, V, L, material):
    """MODEL 5."""
    sin_i = float(np.linalg.norm(L - (t @ L) * t))

    def specular():
        if np.linalg.norm(V + L) < 1e-6:
            return 0.0
        Q = unit(V + L)
        across = Q - (t @ Q) * t
        cos_phi = float(np.linalg.norm(across))
        if cos_phi < 1e-6:
            return 0.0
        normal = across / cos_phi
        cos_i, cos_r = float(normal @ L), float(normal @ V)
        if cos_i <= 0 or cos_r <= 0:
            return 0.0
        cos_q = math.sqrt(max(0.0, (1 + float(V @ L)) / 2))
        q = max(cos_q, LEAST_COSINE)
        phi = arccos(float(t @ V)) - arccos(-float(t @ L))
        return width_factor(phi, material["gamma"]) * fresnel(cos_q, material["n"]) \
            * min(1.0, 2 * cos_phi * cos_r / q, 2 * cos_phi * cos_i / q)

    return colour(material, sin_i, specular())


# ---- the cases of both models

class Cases:
    def __init__(self, rng):
        self.rng, self.surface, self.fibre = rng, [], []

    def material(self):
        r = self.rng
        return dict(alpha=float(r.uniform(0, 1)), beta=float(r.uniform(0, 1)),
                    gamma=float(r.uniform(0.02, 0.8)),
                    n=float(r.choice([1.0, 1.33, 1.55, 2.4, 0.7])),
                    c_b=r.uniform(0, 1, 3).tolist(), e=r.uniform(0, 1, 3).tolist())

    def direction(self):
        return unit(self.rng.normal(size=3))

    def near(self, v, distance):
        return unit(v + distance * self.rng.normal(size=3))

    def add(self, material, axis, V, L):
        axis, V, L = (np.asarray(v, float) for v in (axis, V, L))
        row = dict(material=dict(material), axis=axis.tolist(), V=V.tolist(), L=L.tolist())
        self.surface.append(dict(row, rgb=surface(axis, V, L, material).tolist()))
        self.fibre.append(dict(row, rgb=fibre(axis, V, L, material).tolist()))


def mirrored(axis, V):
    """The direction in which a mirror with this normal sends light that comes from V."""
    return 2 * (axis @ V) * axis - V


def on_cone(axis, V):
    """V mirrored at the plane across the axis: it lies on the cone in which a fibre reflects."""
    return V - 2 * (axis @ V) * axis


def rotated(axis, v, angle):
    """Rodrigues' formula."""
    return v * math.cos(angle) + np.cross(axis, v) * math.sin(angle) \
        + axis * (axis @ v) * (1 - math.cos(angle))


def add_near_cases(cases):
    """Random directions, and such that are near the special ones."""
    for k in range(300):
        material, axis = cases.material(), cases.direction()
        V, L = cases.direction(), cases.direction()
        if k % 6 == 1:
            L = cases.near(unit(mirrored(axis, V)), 0.1)
        elif k % 6 == 2:  # grazing view
            V = unit(V - (axis @ V) * axis + 1e-4 * axis)
        elif k % 6 == 3:  # light from behind
            L = cases.near(-V, 1e-3)
        elif k % 6 == 4:
            L = cases.near(axis, 1e-5)
        if k % 30 == 5:
            material["gamma"] = 0.0
        if k % 12 == 7:
            L = cases.near(unit(on_cone(axis, V)), 0.05)
        cases.add(material, axis, V, L)


def add_axis_cases(cases):
    """Directions along the axes of space, in which terms are exactly 0 or 1."""
    material = dict(alpha=0.8, beta=0.5, gamma=0.2, n=1.55, c_b=[.6, .4, .2], e=[1, 1, 1])
    x, y, z = np.eye(3)
    for axis, V, L in ((y, y, y), (y, x, -x), (y, x, x), (z, -z, -z), (x, y, x), (x, x, y)):
        cases.add(material, axis, V + 0.0, L + 0.0)  # -0.0 becomes 0.0


def add_exact_cases(cases):
    """Directions on the special ones, as far as doubles can tell."""
    rng = cases.rng
    for k in range(120):
        material, axis, V = cases.material(), cases.direction(), cases.direction()
        across = np.cross(axis, V)
        if k % 6 == 0:    # on the fibre's cone, at any angle around it
            L = rotated(axis, on_cone(axis, V), rng.uniform(0, 2 * math.pi))
        elif k % 6 == 1:  # the mirror direction, with a gamma that is clamped
            material["gamma"], L = 0.0, unit(mirrored(axis, V))
        elif k % 6 == 2:  # a milliradian from it
            material["gamma"] = 0.0
            L = rotated(across / np.linalg.norm(across), unit(mirrored(axis, V)), 1e-3)
        elif k % 6 == 3:  # almost V = -L
            L = unit(-rotated(axis, V, 1e-2 if k % 12 == 3 else 1e-3))
        elif k % 6 == 4:
            material["n"], L = 1.0, cases.direction()
        else:             # the half vector almost along the axis
            half = unit(axis + (1e-5 if k % 12 == 5 else 1e-7) * unit(across))
            L = unit(2 * (V @ half) * half - V)
        cases.add(material, axis, V, L)


# ---- line integrals

def box_depth(density, origin, direction):
    """Sum over all voxels of the density times the ray's length in the cube around the centre."""
    total = 0.0
    for index, value in np.ndenumerate(density):
        enter, leave = 0.0, math.inf
        for a in range(3):
            low, high = index[a] - 0.5 - origin[a], index[a] + 0.5 - origin[a]
            if direction[a] == 0:
                if not low <= 0 < high:
                    leave = 0.0
            else:
                ends = sorted((low / direction[a], high / direction[a]))
                enter, leave = max(enter, ends[0]), min(leave, ends[1])
        total += value * max(0.0, leave - enter)
    return total


def interpolated(density, p):
    base = np.floor(p).astype(int)
    f = p - base
    total = 0.0
    for corner in np.ndindex(2, 2, 2):
        i = base + corner
        if (i >= 0).all() and (i < density.shape).all():
            weight = math.prod(f[a] if corner[a] else 1 - f[a] for a in range(3))
            total += density[tuple(i)] * weight
    return total


def trilinear_depth(density, origin, direction):
    """Gauss-Legendre quadrature between the planes through voxel centres, where the density is a
    cubic polynomial; two nodes are exact for it."""
    cuts = {0.0}
    for a in range(3):
        if direction[a] != 0:
            cuts |= {(k - origin[a]) / direction[a] for k in range(-1, max(density.shape) + 1)}
    cuts = sorted(t for t in cuts if t >= 0)
    nodes, weights = np.polynomial.legendre.leggauss(2)
    total = 0.0
    for a, b in zip(cuts, cuts[1:]):
        for node, weight in zip(nodes, weights):
            t = 0.5 * (a + b) + 0.5 * (b - a) * node
            total += 0.5 * (b - a) * weight * interpolated(density, origin + t * direction)
    return total


def line_integrals(rng):
    shape = (6, 6, 6)
    density = rng.uniform(0, 3, shape) * (rng.uniform(size=shape) < 0.6)
    rays = []
    for k in range(120):
        origin, target = rng.uniform(-3, 9, 3), rng.uniform(0, 5, 3)
        direction = unit(target - origin)
        if k % 5 == 1:    # along an axis through centres
            origin, direction = np.array([*np.round(rng.uniform(0, 5, 2)), -4.0]), np.eye(3)[2]
        elif k % 5 == 2:  # along an axis beside them
            corner = np.round(rng.uniform(0, 4, 2)) + 0.25
            origin, direction = np.array([*corner, -4.0]), np.eye(3)[2]
        elif k % 5 == 3:  # diagonals
            origin, direction = np.array([-3.0, -3.0, -3.0 + k % 3]), unit((1, 1, 1))
        elif k % 5 == 4:  # from the inside
            origin = rng.uniform(0, 5, 3)
        rays.append(dict(origin=origin.tolist(), direction=direction.tolist(),
                         box=box_depth(density, origin, direction),
                         trilinear=trilinear_depth(density, origin, direction)))
    grid = [dict(ijk=[int(i) for i in index], density=float(value))
            for index, value in np.ndenumerate(density) if value > 0]
    return dict(grid=grid, rays=rays)


# ---- files

def reference():
    rng = np.random.default_rng(SEED)
    cases = Cases(rng)
    add_near_cases(cases)
    add_axis_cases(cases)
    add_exact_cases(cases)
    return {"surface.json": cases.surface, "fibre.json": cases.fibre,
            "line_integrals.json": line_integrals(rng)}


def difference(found, expected):
    """The largest difference of two numbers of the same place; infinity if the shapes differ."""
    if isinstance(expected, dict):
        if not isinstance(found, dict) or found.keys() != expected.keys():
            return math.inf
        return max((difference(found[key], expected[key]) for key in expected), default=0.0)
    if isinstance(expected, list):
        if not isinstance(found, list) or len(found) != len(expected):
            return math.inf
        return max(map(difference, found, expected), default=0.0)
    return abs(found - expected) / max(1.0, abs(expected))


def main():
    if len(sys.argv) != 3 or sys.argv[1] not in ("write", "check"):
        print(__doc__)
        return 2
    worst = 0.0
    for name, data in reference().items():
        file = os.path.join(sys.argv[2], name)
        if sys.argv[1] == "write":
            with open(file, "w") as f:
                json.dump(data, f, separators=(",", ":"))
        else:
            with open(file) as f:
                off = difference(json.load(f), data)
            print(f"{file}: {off:.1e}")
            worst = max(worst, off)
    return 0 if worst <= 1e-12 else 1


if __name__ == "__main__":
    sys.exit(main())
