#!/usr/bin/python3
"""Makes the surfaces of the scene spheres: make_spheres.py DIR writes

    DIR/ball.obj   a sphere of radius 1 around the origin
    DIR/floor.obj  a slab whose top is at y = 0

Units are metres; the ball is scaled and moved by the scene.
"""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from making import write_ball  # noqa: E402


def slab(path, low, high):
    with open(path, "w") as f:
        f.write("# made by make_spheres.py; metres\n")
        for k in range(8):
            f.write("v %g %g %g\n" % tuple((high if k >> i & 1 else low)[i] for i in range(3)))
        for face in ("1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"):
            f.write(f"f {face}\n")


def main():
    out = sys.argv[1]
    os.makedirs(out, exist_ok=True)
    write_ball(os.path.join(out, "ball.obj"), 1, "made by make_spheres.py")
    slab(os.path.join(out, "floor.obj"), (-0.78, -0.048, -0.24), (0.78, 0.0, 1.12))


if __name__ == "__main__":
    main()
