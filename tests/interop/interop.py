#!/usr/bin/python3
"""Reads what the programs write with the programs that users have: interop.py BIN WORK, where BIN holds volcomp's programs.
Each test is skipped where its program is not installed. Blender is no dependency of the project; install it to run its test."""
import json
import os
import shutil
import subprocess
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
SCENE = os.path.join(HERE, "scene.toml")
VOXEL, PIXEL = 0.01, 0.8 / 160  # m, of the scene's volume and picture


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode:
        raise AssertionError(f"{command}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def program(name):
    return unittest.skipUnless(shutil.which(name), f"{name} is not installed")


def module(name):
    try:
        return __import__(name)
    except ImportError:
        return None


class Interop(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.bin, cls.work = sys.argv[1:3]
        shutil.rmtree(cls.work, ignore_errors=True)
        os.makedirs(cls.work)
        cls.volume, cls.picture = cls.work + "/volume.vdb", cls.work + "/picture.exr"
        run(cls.bin + "/volcomp-bake", SCENE, "-o", cls.work + "/boxes")
        run(cls.bin + "/volcomp-compose", SCENE, "--boxes", cls.work + "/boxes", "-o", cls.volume)
        run(cls.bin + "/volcomp-render", SCENE, "--volume", cls.volume, "--extinction", "isotropic", "--filter", "trilinear", "-o", cls.picture)

    @unittest.skipUnless(module("pyopenvdb"), "python3-openvdb is not installed")
    def test_openvdb_in_python(self):
        import pyopenvdb as vdb
        grids = {g.name: g for g in vdb.readAll(self.volume)[0]}
        vectors = {"tangentu_fur": "contravariant relative", "Cd_fur": "invariant"}
        self.assertEqual(sorted(grids), ["Cd_fur", "density", "density_fur", "density_soil", "tangentu_fur"])
        for name, grid in grids.items():
            self.assertEqual(grid.gridClass, "fog volume", name)
            self.assertEqual(grid.vectorType, vectors.get(name, "invariant"), name)
            self.assertAlmostEqual(grid.transform.voxelSize()[0], VOXEL)
            for p in ((0, 0, 0), (3, -7, 11)):  # voxel centres stand at whole index coordinates
                self.assertTrue(all(abs(a - b * VOXEL) < 1e-12 for a, b in zip(grid.transform.indexToWorld(p), p)), name)
        # The parts sum to the whole, and the ground lies where the scene puts it.
        sums = {name: sum(v.value * v.count for v in g.citerOnValues()) for name, g in grids.items() if name.startswith("density")}
        self.assertAlmostEqual(sums["density"], sums["density_fur"] + sums["density_soil"], delta=1e-4 * sums["density"])
        soil = grids["density_soil"]
        place = [sum(v.value * v.min[a] for v in soil.citerOnValues()) / sums["density_soil"] * VOXEL for a in range(3)]
        for found, expected in zip(place, (0.5, 0.2, -0.1)):
            self.assertAlmostEqual(found, expected, delta=0.05 * VOXEL)

    @unittest.skipUnless(module("pyopenvdb"), "python3-openvdb is not installed")
    def test_names_for_blender(self):
        import pyopenvdb as vdb
        file = self.work + "/blender.vdb"
        run(self.bin + "/volcomp-compose", SCENE, "--boxes", self.work + "/boxes", "--grid-names", "blender", "-o", file)
        self.assertEqual(sorted(g.name for g in vdb.readAll(file)[0]), ["color_fur", "density", "density_fur", "density_soil", "tangentu_fur"])
        ours, theirs = vdb.read(self.volume, "Cd_fur"), vdb.read(file, "color_fur")
        self.assertEqual([(v.min, v.value) for v in ours.citerOnValues()], [(v.min, v.value) for v in theirs.citerOnValues()])

    @program("vdb_print")
    def test_vdb_print(self):
        text = run("vdb_print", self.volume)
        for name in ("density ", "density_fur", "density_soil", "tangentu_fur", "Cd_fur"):
            self.assertIn(name, text)

    @program("nanovdb_convert")
    def test_nanovdb_convert(self):
        packed, back = self.work + "/volume.nvdb", self.work + "/back.vdb"
        run("nanovdb_convert", "-f", self.volume, packed)
        run("nanovdb_validate", packed)
        run("nanovdb_convert", "-f", packed, back)
        if module("pyopenvdb"):
            import pyopenvdb as vdb
            a, b = (vdb.read(f, "density") for f in (self.volume, back))
            self.assertEqual(a.activeVoxelCount(), b.activeVoxelCount())
            self.assertEqual(a.getAccessor().getValue((60, 25, -10)), b.getAccessor().getValue((60, 25, -10)))

    @program("oiiotool")
    def test_openimageio(self):
        text = run("oiiotool", "--info", "-v", self.picture)
        self.assertIn("160 x  120, 14 channel, float openexr", text)
        for name in ("R, G, B, A, Z, N.X, N.Y, N.Z, albedo.R, albedo.G, albedo.B, light1.R, light1.G, light1.B", "volcomp/scene", "volcomp/seconds"):
            self.assertIn(name, text)
        settings = next(line for line in text.splitlines() if "volcomp/settings" in line).split(": ", 1)[1]
        self.assertEqual(json.loads(settings.strip('"').replace('\\"', '"'))["samples"], 16)

    @program("blender")
    @unittest.skipUnless(module("OpenImageIO") and module("numpy"), "python3-openimageio is not installed")
    def test_blender(self):
        import numpy as np
        import OpenImageIO as oiio
        picture = self.work + "/blender.exr"
        text = run("blender", "-b", "-noaudio", "--python-exit-code", "3", "--python", HERE + "/blender_render.py", "--", self.volume, picture, "Cd_fur")
        self.assertIn("grids: Cd_fur/VECTOR_FLOAT density/FLOAT density_fur/FLOAT density_soil/FLOAT tangentu_fur/VECTOR_FLOAT error: none", text)

        def alpha(file):
            return oiio.ImageBuf(file).get_pixels(oiio.FLOAT)[:, :, 3].astype(float)

        ours, theirs = alpha(self.picture), alpha(picture)

        def shifted(x, y):  # RMSE against our picture moved by so many pixels to the right and up
            return np.sqrt(np.mean((np.roll(ours, (-y, x), (0, 1)) - theirs) ** 2))

        # A voxel is two pixels. Blender before 5 draws every volume half a voxel towards +x, +y, +z of where its file has it.
        rmse = {(x, y): shifted(x, y) for x in range(-3, 4) for y in range(-3, 4)}
        best = min(rmse, key=rmse.get)
        self.assertIn(best, ((0, 0), (1, 1)), rmse)
        self.assertLess(rmse[best], 0.02)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
