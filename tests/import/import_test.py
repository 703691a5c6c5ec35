#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""volcomp-import on files that this test writes: import_test.py PROGRAM [check].

Exits with 77 (skipped) if its environment is not there and cannot be made, as without a network.
The checks run inside of that environment, which has the writers of the formats."""
import importlib.machinery
import importlib.util
import json
import math
import os
import struct
import subprocess
import sys
import tempfile


def load(program):
    loader = importlib.machinery.SourceFileLoader("volcomp_import", program)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("volcomp_import", loader))
    loader.exec_module(module)
    return module


def read_hair(path):
    """Returns the strands of a HAIR file as lists of points, with widths and colours or None."""
    with open(path, "rb") as f:
        data = f.read()
    magic, strands, points, flags = struct.unpack_from("<4s3I", data)
    assert magic == b"HAIR" and flags & 3 == 3
    counts = [n + 1 for n in struct.unpack_from(f"<{strands}H", data, 128)]
    assert sum(counts) == points
    at = 128 + 2 * strands
    lists = []
    for bit, size in ((2, 3), (4, 1), (16, 3)):
        values = None
        if flags & bit:
            flat = struct.unpack_from(f"<{size * points}f", data, at)
            values = [flat[size * k:size * (k + 1)] for k in range(points)]
            at += 4 * size * points
        cut, first = [], 0
        for n in counts:
            cut.append(values and values[first:first + n])
            first += n
        lists.append(cut)
    assert at == len(data)
    return lists


def near(a, b, tolerance=1e-5):
    a, b = ([x] if isinstance(x, (int, float)) else list(x) for x in (a, b))
    assert len(a) == len(b) and all(abs(x - y) <= tolerance for x, y in zip(a, b)), (a, b)


class Checks:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder

    def run(self, name, *options):
        output = os.path.join(self.folder, "out.hair")
        done = subprocess.run([self.program, os.path.join(self.folder, name), "-o", output, "-q", *options], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        with open(output + ".json") as f:
            return read_hair(output), json.load(f)

    def refused(self, *command):
        done = subprocess.run([self.program, *command], capture_output=True, text=True)
        assert done.returncode == 1 and "Traceback" not in done.stderr, done.stderr
        return done.stderr

    def usda(self, body, head="upAxis = \"Z\"\n    metersPerUnit = 0.01"):
        with open(os.path.join(self.folder, "a.usda"), "w") as f:
            f.write(f"#usda 1.0\n(\n    {head}\n)\n\n{body}\n")
        return "a.usda"

    def check_bases(self):
        """Each basis runs on its own closed form."""
        control = [(0, 0, 0), (1, 2, 0), (3, 2, 1), (4, 0, 0)]
        forms = {
            "bezier": lambda t: [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t ** 3],
            "bspline": lambda t: [(1 - t) ** 3 / 6, (3 * t ** 3 - 6 * t * t + 4) / 6, (-3 * t ** 3 + 3 * t * t + 3 * t + 1) / 6, t ** 3 / 6],
            "catmullRom": lambda t: [(-t + 2 * t * t - t ** 3) / 2, (2 - 5 * t * t + 3 * t ** 3) / 2, (t + 4 * t * t - 3 * t ** 3) / 2, (t ** 3 - t * t) / 2],
        }
        for basis, form in forms.items():
            name = self.usda(f"""def BasisCurves "a" {{
                uniform token type = "cubic"
                uniform token basis = "{basis}"
                int[] curveVertexCounts = [4]
                point3f[] points = {control}
                float[] widths = [0.4, 0.3, 0.2, 0.1] (interpolation = "vertex")
            }}""")
            (points, widths, colours), about = self.run(name, "--pieces", "8")
            assert len(points) == 1 and len(points[0]) == 9 and colours[0] is None
            assert about["unit"] == 0.01 and about["up"] == "z"
            for k in range(9):
                w = form(k / 8)
                near(points[0][k], [sum(x * c[a] for x, c in zip(w, control)) for a in range(3)])
                near(widths[0][k], sum(x * y for x, y in zip(w, (0.4, 0.3, 0.2, 0.1))))

    def check_wraps(self):
        """Rings close, and pinned curves reach their ends."""
        ring = [(math.cos(a), math.sin(a), 0) for a in (2 * math.pi * k / 12 for k in range(12))]
        for kind, basis in (("linear", "bezier"), ("cubic", "bezier"), ("cubic", "bspline"), ("cubic", "catmullRom")):
            name = self.usda(f"""def BasisCurves "a" {{
                uniform token type = "{kind}"
                uniform token basis = "{basis}"
                uniform token wrap = "periodic"
                int[] curveVertexCounts = [12]
                point3f[] points = {ring}
            }}""")
            (points, _, _), _ = self.run(name, "--pieces", "3")
            near(points[0][0], points[0][-1])
            assert len(points[0]) == {"linear": 13, "bezier": 13, "bspline": 37, "catmullRom": 37}["linear" if kind == "linear" else basis]
        for basis in ("bspline", "catmullRom"):
            name = self.usda(f"""def BasisCurves "a" {{
                uniform token type = "cubic"
                uniform token basis = "{basis}"
                uniform token wrap = "pinned"
                int[] curveVertexCounts = [3, 2]
                point3f[] points = [(0, 0, 0), (1, 1, 0), (2, 0, 0), (5, 0, 0), (5, 1, 0)]
                float[] widths = [1, 2, 3, 7, 9] (interpolation = "varying")
            }}""")
            (points, widths, _), _ = self.run(name)
            near(points[0][0], (0, 0, 0)), near(points[0][-1], (2, 0, 0)), near(points[1][-1], (5, 1, 0))
            near(widths[0][0], 1), near(widths[0][4], 2), near(widths[1][-1], 9)

    def check_usd_attributes(self):
        """Unreal's names, inherited transforms and frames."""
        name = self.usda("""def Xform "head" {
            double3 xformOp:translate = (10, 0, 0)
            double3 xformOp:scale = (2, 2, 2)
            uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
            def BasisCurves "a" {
                uniform token type = "linear"
                int[] curveVertexCounts = [2, 3]
                point3f[] points.timeSamples = { 1: [(0, 0, 0), (0, 1, 0), (1, 0, 0), (1, 1, 0), (1, 2, 0)],
                                                 2: [(0, 0, 5), (0, 1, 5), (1, 0, 5), (1, 1, 5), (1, 2, 5)] }
                float[] primvars:groom_width = [0.5, 0.25] (interpolation = "uniform")
                color3f[] primvars:groom_color = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (0, 0, 0)] (interpolation = "vertex")
                float2[] primvars:groom_root_uv = [(0.25, 0.5), (0.75, 1)] (interpolation = "uniform")
                int[] primvars:groom_group_id = [3, 4] (interpolation = "uniform")
                int[] primvars:groom_guide = [0, 1] (interpolation = "uniform")
            }
        }""")
        (points, widths, colours), about = self.run(name)
        near(points[0][1], (10, 2, 0)), near(points[1][2], (12, 4, 0))
        near(widths[0][0], 1), near(widths[1][2], 0.5)  # scaled with the curves
        near(colours[0][1], (0, 1, 0)), near(colours[1][1], (1, 1, 1))
        assert about["groups"] == [3, 4] and about["guides"] == [0, 1], about
        near(about["root_uv"][1], (0.75, 1))
        near(self.run(name, "--frame", "2")[0][0][0][0], (10, 0, 10))
        assert self.run(name, "--unit", "1", "--up", "y")[1]["unit"] == 1

    def check_alembic(self):
        """Curves with a transform above them, widths, Unreal's attributes and two samples."""
        import imath
        from alembic3d import Abc, AbcGeom
        path = os.path.join(self.folder, "a.abc")
        archive = Abc.OArchive(path)
        xform = AbcGeom.OXform(archive.getTop(), "head")
        sample = AbcGeom.XformSample()
        sample.setTranslation(imath.V3d(10, 0, 0))
        xform.getSchema().set(sample)
        schema = AbcGeom.OCurves(xform, "hair").getSchema()

        def array(kind, values):
            a = kind(len(values))
            for k, v in enumerate(values):
                a[k] = v
            return a

        for z in (0, 5):
            points = array(imath.V3fArray, [imath.V3f(x, y, z) for x, y in ((0, 0), (0, 1), (1, 0), (1, 1), (1, 2))])
            widths = AbcGeom.OFloatGeomParamSample(array(imath.FloatArray, [0.5, 0.4, 0.3, 0.2, 0.1]), AbcGeom.GeometryScope.kVertexScope)
            curves = AbcGeom.OCurvesSchemaSample(points, array(imath.IntArray, [2, 3]), AbcGeom.CurveType.kLinear, AbcGeom.CurvePeriodicity.kNonPeriodic, widths)
            schema.set(curves)
        extra = schema.getArbGeomParams()
        uniform = AbcGeom.GeometryScope.kUniformScope
        for kind, of, name, values in ((AbcGeom.OInt32GeomParam, AbcGeom.OInt32GeomParamSample, "groom_group_id", array(imath.IntArray, [3, 4])),
                                       (AbcGeom.OInt32GeomParam, AbcGeom.OInt32GeomParamSample, "groom_guide", array(imath.IntArray, [0, 1])),
                                       (AbcGeom.OV2fGeomParam, AbcGeom.OV2fGeomParamSample, "groom_root_uv", array(imath.V2fArray, [imath.V2f(0.25, 0.5), imath.V2f(0.75, 1)])),
                                       (AbcGeom.OC3fGeomParam, AbcGeom.OC3fGeomParamSample, "groom_color", array(imath.C3fArray, [imath.Color3f(1, 0, 0), imath.Color3f(0, 1, 0)]))):
            kind(extra, name, False, uniform, 1).set(of(values, uniform))
        del extra, schema, xform, archive, curves, widths
        (points, widths, colours), about = self.run("a.abc")
        near(points[0][1], (10, 1, 0)), near(points[1][2], (11, 2, 0))
        near(widths[1][0], 0.3), near(colours[1][2], (0, 1, 0))
        assert about["groups"] == [3, 4] and about["guides"] == [0, 1] and "unit" not in about, about
        near(about["root_uv"][0], (0.25, 0.5))
        near(self.run("a.abc", "--frame", "1")[0][0][0][0], (10, 0, 5))

    def check_knots(self):
        """Knots that meet at the ends make a B-spline reach them; even ones make the even spline."""
        module = load(self.program)
        w = module.weights_of(5, "cubic", "bspline", "nonperiodic", 4, (0, 0, 0, 0, 1, 2, 2, 2, 2))
        assert w.shape == (9, 5)
        near(w[0], (1, 0, 0, 0, 0)), near(w[-1], (0, 0, 0, 0, 1)), near(w.sum(1), [1] * 9)
        near(w[4], (0, 0.25, 0.5, 0.25, 0))  # blossom at the knot
        near(module.weights_of(6, "cubic", "bspline", "nonperiodic", 4, tuple(range(10))).ravel(),
             module.weights_of(6, "cubic", "bspline", "nonperiodic", 4).ravel())

    def check_refusals(self):
        path = lambda name: os.path.join(self.folder, name)  # noqa: E731
        for name in ("bad.abc", "bad.usd", "bad.usda"):
            with open(path(name), "w") as f:
                f.write("something else")
            assert path(name) in self.refused(path(name))
        assert "none" in self.refused(path("missing.abc"))
        assert "ends in .abc" in self.refused(path("mesh.obj"))
        name = self.usda('def BasisCurves "a" {\n uniform token type = "linear"\n int[] curveVertexCounts = [3]\n point3f[] points = [(0, 0, 0)]\n}')
        assert "expected 3 points" in self.refused(path(name))
        name = self.usda('def Xform "a" {\n}')
        assert "expected curves" in self.refused(path(name))


def main():
    program = os.path.abspath(sys.argv[1])
    if len(sys.argv) == 2:
        prepared = subprocess.run([program, "--prepare", "-q"], capture_output=True, text=True)
        if prepared.returncode:
            print("skipped:", prepared.stderr)
            return 77
        python = os.path.join(load(program).environment(), "bin", "python")
        return subprocess.run([python, os.path.abspath(__file__), program, "check"], env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}).returncode
    with tempfile.TemporaryDirectory() as folder:
        checks = Checks(program, folder)
        for name in dir(checks):
            if name.startswith("check_"):
                getattr(checks, name)()
                print(name, "passed", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
