#!/usr/bin/python3
"""Makes the surfaces of the scene spheres: make_spheres.py DIR writes

    DIR/ball.obj   a sphere of radius 1 around the origin
    DIR/floor.obj  a slab whose top is at y = 0

Units are metres; the ball is scaled and moved by the scene.
"""
import math
import os
import sys


def ball(path, across=96, up=48):
    with open(path, "w") as f:
        f.write("# made by make_spheres.py\nv 0 -1 0\nv 0 1 0\n")
        for j in range(1, up):
            for i in range(across):
                a, b = 2 * math.pi * i / across, math.pi * (j / up - 0.5)
                f.write("v %.6f %.6f %.6f\n" % (math.cos(b) * math.sin(a), math.sin(b), math.cos(b) * math.cos(a)))
        ring = lambda j, i: 3 + (j - 1) * across + i % across
        for i in range(across):
            f.write("f 1 %d %d\n" % (ring(1, i + 1), ring(1, i)))
            for j in range(1, up - 1):
                f.write("f %d %d %d %d\n" % (ring(j, i), ring(j, i + 1), ring(j + 1, i + 1), ring(j + 1, i)))
            f.write("f 2 %d %d\n" % (ring(up - 1, i), ring(up - 1, i + 1)))


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
    ball(os.path.join(out, "ball.obj"))
    slab(os.path.join(out, "floor.obj"), (-0.78, -0.048, -0.24), (0.78, 0.0, 1.12))


if __name__ == "__main__":
    main()
