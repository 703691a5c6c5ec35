#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Reads what the programs write with the programs that users have: interop.py BIN TEST, where BIN
holds volcomp's programs and TEST is the name of a test below. Writes into the working directory.
Exits with 77 if the test's program is not installed. Blender is no dependency of the project:
install it to run its test."""
import json
import os
import shutil
import subprocess
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
SCENE = os.path.join(HERE, "scene.toml")
VOXEL = 0.01  # m, of the scene's volume
DENSITIES = ["density", "density_fur", "density_soil"]
OWN_SHARES = ["own_share_fur", "own_share_soil"]


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
        cls.bin, cls.work = sys.argv[1], os.getcwd()
        cls.volume, cls.picture = cls.work + "/volume.vdb", cls.work + "/picture.exr"
        run(cls.bin + "/volcomp-bake", SCENE, "-o", cls.work + "/boxes")
        run(cls.bin + "/volcomp-compose", SCENE, "--boxes", cls.work + "/boxes", "-o", cls.volume)
        run(cls.bin + "/volcomp-render", SCENE, "--volume", cls.volume, "--extinction", "isotropic",
            "--filter", "trilinear", "-o", cls.picture)

    @unittest.skipUnless(module("pyopenvdb"), "python3-openvdb is not installed")
    def test_openvdb_in_python(self):
        import pyopenvdb as vdb
        grids = {g.name: g for g in vdb.readAll(self.volume)[0]}
        vectors = {"tangentu_fur": "contravariant relative", "Cd_fur": "invariant"}
        self.assertEqual(sorted(grids), ["Cd_fur", *DENSITIES, *OWN_SHARES, "tangentu_fur"])
        for name, grid in grids.items():
            self.assertEqual(grid.gridClass, "fog volume", name)
            self.assertEqual(grid.vectorType, vectors.get(name, "invariant"), name)
            self.assertAlmostEqual(grid.transform.voxelSize()[0], VOXEL)
            for index in ((0, 0, 0), (3, -7, 11)):  # voxel centres are at whole index coordinates
                for found, i in zip(grid.transform.indexToWorld(index), index):
                    self.assertAlmostEqual(found, i * VOXEL, delta=1e-12, msg=name)
        # The parts sum to the whole, and the ground lies where the scene puts it.
        whole, fur, soil = (sum(v.value * v.count for v in grids[name].citerOnValues())
                            for name in DENSITIES)
        self.assertAlmostEqual(whole, fur + soil, delta=1e-4 * whole)
        for axis, expected in enumerate((0.5, 0.2, -0.1)):
            moment = sum(v.value * v.min[axis] for v in grids["density_soil"].citerOnValues())
            self.assertAlmostEqual(moment / soil * VOXEL, expected, delta=0.05 * VOXEL)

    @unittest.skipUnless(module("pyopenvdb"), "python3-openvdb is not installed")
    def test_names_for_blender(self):
        import pyopenvdb as vdb
        file = self.work + "/blender.vdb"
        run(self.bin + "/volcomp-compose", SCENE, "--boxes", self.work + "/boxes",
            "--grid-names", "blender", "-o", file)
        names = sorted(g.name for g in vdb.readAll(file)[0])
        self.assertEqual(names, ["color_fur", *DENSITIES, *OWN_SHARES, "tangentu_fur"])
        ours, theirs = ([(v.min, v.value) for v in grid.citerOnValues()]
                        for grid in (vdb.read(self.volume, "Cd_fur"), vdb.read(file, "color_fur")))
        self.assertEqual(ours, theirs)

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
            a, b = (grid.getAccessor().getValue((60, 25, -10)) for grid in (a, b))
            self.assertEqual(a, b)

    @program("oiiotool")
    def test_openimageio(self):
        text = run("oiiotool", "--info", "-v", self.picture)
        self.assertIn("160 x  120, 23 channel, float openexr", text)
        channels = ("R, G, B, A, Z, N.X, N.Y, N.Z, albedo.R, albedo.G, albedo.B, "
                    "ambient.R, ambient.G, ambient.B, background.R, background.G, background.B, "
                    "haze.R, haze.G, haze.B, light1.R, light1.G, light1.B")
        for name in (channels, "volcomp/scene", "volcomp/seconds"):
            self.assertIn(name, text)
        settings = next(line for line in text.splitlines() if "volcomp/settings" in line)
        settings = settings.split(": ", 1)[1].strip('"').replace('\\"', '"')
        self.assertEqual(json.loads(settings)["samples"], 16)

    @unittest.skipUnless(module("pxr"), "usd-core is not installed")
    def test_usd_instancer(self):
        from pxr import Gf, Usd, UsdGeom
        files = [self.work + "/placements." + ending for ending in ("json", "usda")]
        for file in files:
            run(self.bin + "/volcomp-compose", SCENE, "--boxes", self.work + "/boxes", "-o",
                self.work + "/placed.vdb", "--placements", file)
        with open(files[0], encoding="utf-8") as stream:
            places = json.load(stream)
        stage = Usd.Stage.Open(files[1])
        self.assertEqual(UsdGeom.GetStageUpAxis(stage), "Y")
        self.assertEqual(UsdGeom.GetStageMetersPerUnit(stage), 1)
        instancer = UsdGeom.PointInstancer(stage.GetDefaultPrim())
        self.assertTrue(instancer)
        transforms = instancer.ComputeInstanceTransformsAtTime(
            Usd.TimeCode.Default(), Usd.TimeCode.Default())
        self.assertEqual(len(transforms), len(places))
        names = [str(target.name) for target in instancer.GetPrototypesRel().GetTargets()]
        for place, matrix, index in zip(places, transforms, instancer.GetProtoIndicesAttr().Get()):
            self.assertIn(place["box"], names[index])
            for local in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)):
                expected = Gf.Vec3d(*place["position"])
                for share, axis in zip(local, ("x_axis", "y_axis", "z_axis")):
                    expected += Gf.Vec3d(*place[axis]) * share * place["scale"]
                found = matrix.Transform(Gf.Vec3d(*local))
                # Rotations are half floats.
                self.assertLess((found - expected).GetLength(), 2e-3 * place["scale"] + 1e-6)

    @program("blender")
    @unittest.skipUnless(module("OpenImageIO") and module("numpy"),
                         "python3-openimageio is not installed")
    def test_blender(self):
        import numpy as np
        import OpenImageIO as oiio
        picture = self.work + "/blender.exr"
        text = run("blender", "-b", "-noaudio", "--python-exit-code", "3",
                   "--python", HERE + "/blender_render.py", "--", self.volume, picture, "Cd_fur")
        self.assertIn("grids: Cd_fur/VECTOR_FLOAT density/FLOAT density_fur/FLOAT "
                      "density_soil/FLOAT tangentu_fur/VECTOR_FLOAT error: none", text)

        def alpha(file):
            return oiio.ImageBuf(file).get_pixels(oiio.FLOAT)[:, :, 3].astype(float)

        ours, theirs = alpha(self.picture), alpha(picture)

        def shifted(x, y):
            """RMSE against our picture moved by x pixels to the right and y pixels up."""
            return np.sqrt(np.mean((np.roll(ours, (-y, x), (0, 1)) - theirs) ** 2))

        # A voxel is two pixels. Blender before version 5 draws every volume half a voxel too far
        # towards +x, +y and +z.
        rmse = {(x, y): shifted(x, y) for x in range(-3, 4) for y in range(-3, 4)}
        best = min(rmse, key=rmse.get)
        self.assertIn(best, ((0, 0), (1, 1)), rmse)
        self.assertLess(rmse[best], 0.02)


def main():
    test = getattr(Interop, sys.argv[2])
    if getattr(test, "__unittest_skip__", False):  # set by the decorators above
        print("skipped:", test.__unittest_skip_why__)
        return 77
    suite = unittest.TestSuite([Interop(sys.argv[2])])  # which calls setUpClass()
    result = unittest.TextTestRunner(verbosity=2).run(suite)
    return 0 if result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
