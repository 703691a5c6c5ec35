#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the ball of the scene hello: make_hello.py DIR writes

    DIR/ball.obj   a sphere of radius 6 cm around the origin
"""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from making import write_ball  # noqa: E402


def main():
    out = sys.argv[1]
    os.makedirs(out, exist_ok=True)
    write_ball(os.path.join(out, "ball.obj"), 0.06, "made by make_hello.py; metres")


if __name__ == "__main__":
    main()
