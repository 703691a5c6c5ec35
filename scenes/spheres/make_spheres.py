#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the surfaces of the scene spheres: make_spheres.py DIR writes

    DIR/ball.obj   a sphere of radius 1 around the origin
    DIR/floor.obj  the floor, a slab whose top is at y = 0

Units are metres; the ball is scaled and moved by the scene.
"""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from making import write_ball  # noqa: E402


def slab(path, near, far, thickness):
    """Writes a slab below y = 0 that becomes wider away from the camera, as its view does; near and
    far: z and half width of its edges."""
    with open(path, "w") as f:
        f.write("# made by make_spheres.py; metres\n")
        for k in range(8):
            z, half = far if k & 4 else near
            f.write("v %g %g %g\n" % (half if k & 1 else -half, 0 if k & 2 else -thickness, z))
        for face in ("2 4 3 1", "7 8 6 5", "5 6 2 1", "4 8 7 3", "3 7 5 1", "6 8 4 2"):
            f.write(f"f {face}\n")


def main():
    out = sys.argv[1]
    os.makedirs(out, exist_ok=True)
    write_ball(os.path.join(out, "ball.obj"), 1, "made by make_spheres.py")
    slab(os.path.join(out, "floor.obj"), (0.56, 0.52), (-1.50, 1.02), 0.03)


if __name__ == "__main__":
    main()
