#!/usr/bin/python3
"""Makes the ball of the scene hello: make_hello.py DIR writes DIR/ball.obj, a sphere of radius 6 cm around the origin."""
import math
import os
import sys

RADIUS = 0.06
ACROSS, UP = 96, 48  # faces around the axis and from pole to pole


def main():
    out = sys.argv[1]
    os.makedirs(out, exist_ok=True)
    with open(os.path.join(out, "ball.obj"), "w") as f:
        f.write("# made by make_hello.py; metres\n")
        f.write(f"v 0 {-RADIUS} 0\nv 0 {RADIUS} 0\n")
        for j in range(1, UP):
            for i in range(ACROSS):
                a, b = 2 * math.pi * i / ACROSS, math.pi * (j / UP - 0.5)
                f.write("v %.6f %.6f %.6f\n" % (RADIUS * math.cos(b) * math.sin(a), RADIUS * math.sin(b), RADIUS * math.cos(b) * math.cos(a)))
        ring = lambda j, i: 3 + (j - 1) * ACROSS + i % ACROSS
        for i in range(ACROSS):
            f.write("f 1 %d %d\n" % (ring(1, i + 1), ring(1, i)))
            for j in range(1, UP - 1):
                f.write("f %d %d %d %d\n" % (ring(j, i), ring(j, i + 1), ring(j + 1, i + 1), ring(j + 1, i)))
            f.write("f 2 %d %d\n" % (ring(UP - 1, i), ring(UP - 1, i + 1)))


if __name__ == "__main__":
    main()
