# SPDX-License-Identifier: Apache-2.0
"""Running volcomp's programs, for the benchmarks against exact pictures."""
import hashlib
import os
import resource
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PRIMITIVES = os.path.join(ROOT, "scenes", "primitives")


def run(command):
    """Runs a program quietly; returns its CPU seconds and its standard output."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if process.returncode:
        sys.exit(f"{' '.join(command)} failed:\n{process.stderr}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, process.stdout


def digest(*texts):
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]


def content(file):
    with open(file, "rb") as stream:
        return hashlib.sha256(stream.read()).hexdigest()


def add_options(parser, samples):
    """The options that the benchmarks have in common."""
    parser.add_argument("--only", default="", help="scenes whose name has this word")
    parser.add_argument("--samples", type=int, default=samples, help="of the exact pictures")
    parser.add_argument("--keep", default=os.path.join(ROOT, "out", "truth"))
    parser.add_argument("--output", help="also write the table to this file")
    parser.add_argument("bin", nargs="?", default=os.path.join(ROOT, "build", "release", "bin"))


class Programs:
    """The programs of one folder, and the exact pictures that are kept."""

    def __init__(self, arguments):
        self.bin, self.samples = arguments.bin, arguments.samples
        self.folder = arguments.keep
        self.truth_program = content(os.path.join(self.bin, "volcomp-truth"))
        os.makedirs(self.folder, exist_ok=True)

    def program(self, name):
        return os.path.join(self.bin, "volcomp-" + name)

    def exact(self, scene, text, *options):
        """The exact picture of the scene file with that text: its file, and the CPU seconds that it
        took, 0 if it was kept."""
        exact = os.path.join(self.folder, "exact_" + digest(
            text, str(self.samples), self.truth_program, *options) + ".exr")
        if os.path.exists(exact):
            return exact, 0
        traced, _ = run([self.program("truth"), scene, "--samples", str(self.samples), "-o", exact,
                         "-q", *options])
        return exact, traced
