#!/usr/bin/env python3
"""Every export format read back by something that shares no code with Fieldtrue.

read_back.py FIELDTRUE-CLI [--itk ITK-POINTS] [--vtk VTK-POINTS] [--table]

A rig turned in all three angles with three different pitches is measured through a smooth bend; calibrations are fitted and
exported; 1,000 points inside the hull are corrected by `apply` and by each format's own reader: ITK and VTK, SciPy, compilers, teem,
h5dump, and readers written here from the formats' descriptions. Printed, a format a line: the reader, the worst and the 99 %
deviation in um, and how far the wrong direction is off. The status is 1 when a figure is beyond its bound.
"""
import argparse
import csv
import ctypes
import gzip
import json
import math
import os
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

import numpy
import scipy.interpolate
import scipy.io

FOOT = 0.3048
COUNTS, PITCHES = (6, 5, 5), (0.11, 0.13, 0.17)
LATTICE_UM = 60.0
ROWS = []


def rotation(axis, angle):
    axis = numpy.array(axis) / numpy.linalg.norm(axis)
    cross = numpy.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return numpy.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


RIG = rotation((0.3, -0.8, 0.5), 0.9)  # tracker from rig
ORIGIN = numpy.array([0.35, -0.3, -0.4])


def bend(p):
    """What the tracker reads where the sensor truly is, tracker frame."""
    x, y, z = p
    return p + numpy.array([0.02 * math.sin(3 * y) + 0.015 * x * z, 0.018 * math.cos(2.5 * x) - 0.01 * y * y,
                            0.02 * x * y + 0.012 * math.sin(2 * z)])


def quaternion(matrix):
    w = math.sqrt(max(0.0, 1 + numpy.trace(matrix))) / 2
    return numpy.array([w, (matrix[2, 1] - matrix[1, 2]) / (4 * w), (matrix[0, 2] - matrix[2, 0]) / (4 * w),
                        (matrix[1, 0] - matrix[0, 1]) / (4 * w)])


def write_places(path):
    places = []
    with open(path, "w", encoding="utf-8") as out:
        out.write("# frame: jig\n# date: 2024-05-17 10:30:00\n# setup.room: the oblique room\n"
                  "node,x_true_m,y_true_m,z_true_m,qw_true,qx_true,qy_true,qz_true,x_m,y_m,z_m,qw,qx,qy,qz\n")
        node = 0
        for i in range(COUNTS[0]):
            for j in range(COUNTS[1]):
                for k in range(COUNTS[2]):
                    rig = numpy.array([i, j, k]) * PITCHES
                    truth = RIG @ rig + ORIGIN
                    seen = bend(truth)
                    turn = rotation((1, 2, -1), 0.05 + 0.04 * math.sin(4 * truth[0]) + 0.03 * truth[1])
                    q = quaternion(turn.T @ RIG)
                    out.write(",".join([str(node)] + [repr(float(v)) for v in (*rig, 1, 0, 0, 0, *seen, *q)]) + "\n")
                    places.append(seen)
                    node += 1
    return numpy.array(places)


def run(*arguments, text=None):
    done = subprocess.run([str(a) for a in arguments], input=text, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, arguments))}: {done.stderr.strip() or done.stdout.strip()}")
    return done.stdout


class Check:
    """Calibrations, the points, and where `apply` says they are."""

    def __init__(self, cli, folder):
        self.cli, self.folder = cli, folder
        places = write_places(self.at("places.nodes.csv"))
        draw = random.Random(5)
        self.points = []
        while len(self.points) < 1000:  # Within cells of the grid, so that each lies in the hull.
            i, j, k = (draw.randrange(n - 1) for n in COUNTS)
            at = lambda a, b, c: places[((i + a) * COUNTS[1] + j + b) * COUNTS[2] + k + c]
            u = [draw.random() for _ in range(3)]
            p = sum((u[0] if a else 1 - u[0]) * (u[1] if b else 1 - u[1]) * (u[2] if c else 1 - u[2]) * at(a, b, c)
                    for a in (0, 1) for b in (0, 1) for c in (0, 1))
            self.points.append(p)
        self.points = numpy.array(self.points)
        self.expected = {}
        for name, position in (("gp", "gaussian_process"), ("poly", "polynomial:degree=3")):
            run(cli, "fit", "--nodes", self.at("places.nodes.csv"), "--position", position, "--orientation",
                "polynomial_quaternion", "--out", self.at(f"{name}.ftcal.json"))
            self.expected[name] = self.apply(name, self.points)

    def at(self, name):
        return os.path.join(self.folder, name)

    def apply(self, name, points):
        with open(self.at("in.csv"), "w", encoding="utf-8") as out:
            out.write("x_m,y_m,z_m,qw,qx,qy,qz\n")
            for p in points:
                out.write(",".join(repr(float(v)) for v in (*p, 1, 0, 0, 0)) + "\n")
        run(self.cli, "apply", "--calibration", self.at(f"{name}.ftcal.json"), "--in", self.at("in.csv"), "--out",
            self.at("out.csv"))
        with open(self.at("out.csv"), encoding="utf-8") as lines:
            rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        self.turned = numpy.array([[float(r[f"q{a}_corrected"]) for a in "wxyz"] for r in rows])
        return numpy.array([[float(r[f"{a}_corrected_m"]) for a in "xyz"] for r in rows])

    def export(self, form, name="gp", *more):
        out = self.at(f"{form}{'-inverse' if 'true-to-measured' in more else ''}.out")
        suffix = {"itk_nrrd": ".nrrd", "itk_mha": ".mha", "itk_tfm": ".tfm", "itk_h5": ".h5", "vtk_vti": ".vti",
                  "vtk_landmarks": ".vtp", "vtk_vtp": ".vtp", "numpy": ".npz", "matlab": ".mat", "polynomial_c": ".c"}
        out += suffix.get(form, ".txt")
        run(self.cli, "export", "--calibration", self.at(f"{name}.ftcal.json"), "--format", form, "--out", out, "--force", *more)
        return out

    def judge(self, form, reader, seen, bound_um, name="gp", inverse=False):
        """Compares, and takes the file for the other direction, which must not go unnoticed."""
        seen = numpy.asarray(seen)
        expected = self.points if inverse else self.expected[name]
        off = 1e6 * numpy.linalg.norm(seen - expected, axis=1)
        source = self.expected[name] if inverse else self.points
        wrong = 1e6 * numpy.linalg.norm((2 * source - seen) - expected, axis=1)  # The displacement the other way round.
        good = off.max() <= bound_um and wrong.max() > 10 * max(bound_um, 1.0)
        ROWS.append((form + (" (inverse)" if inverse else ""), reader, off.max(), numpy.percentile(off, 99), wrong.max() / 1000, good))


def lps(points):
    return numpy.asarray(points) * 1000.0 * [-1, -1, 1]


def lines_of(points):
    return "\n".join(" ".join(repr(float(v)) for v in p) for p in points) + "\n"


def numbers_of(text):
    return numpy.array([[float(v) for v in line.split()] for line in text.strip().splitlines()])


def trilinear(origin, pitch, corrected, points):
    """corrected: [nx, ny, nz, 3]"""
    axes = [origin[a] + pitch[a] * numpy.arange(corrected.shape[a]) for a in range(3)]
    return scipy.interpolate.RegularGridInterpolator(axes, corrected)(points)


def check_itk(check, program):
    for form in ("itk_nrrd", "itk_mha", "itk_tfm", "itk_h5"):
        path = check.export(form)
        seen = numbers_of(run(program, path, text=lines_of(lps(check.points)))) / 1000.0 * [-1, -1, 1]
        check.judge(form, "ITK 5.2", seen, LATTICE_UM)
        path = check.export(form, "gp", "--direction", "true-to-measured")
        seen = numbers_of(run(program, path, text=lines_of(lps(check.expected["gp"])))) / 1000.0 * [-1, -1, 1]
        check.judge(form, "ITK 5.2", seen, LATTICE_UM, inverse=True)


def check_nrrd_alone(check):
    path = check.export("itk_nrrd")
    with open(path, "rb") as file:
        head, data = file.read().split(b"\n\n", 1)
    fields = dict(re.split(r":=?\s*", line, maxsplit=1) for line in head.decode().splitlines()[1:] if not line.startswith("#"))
    assert fields["displacement field type"] == "modeling" and fields["space"] == "left-posterior-superior", fields
    assert fields["fieldtrue.direction"] == "measured-to-true" and "held_out" in head.decode()
    sizes = [int(v) for v in fields["sizes"].split()]
    steps = numpy.array([[float(v) for v in t.split(",")] for t in re.findall(r"\(([^)]*)\)", fields["space directions"])])
    origin = numpy.array([float(v) for v in fields["space origin"].strip("()").split(",")])
    values = numpy.frombuffer(gzip.decompress(data), "<f8").reshape(sizes[::-1]).transpose(2, 1, 0, 3)
    at = numpy.linalg.solve(steps.T, (lps(check.points) - origin).T).T
    seen = (lps(check.points) + trilinear((0, 0, 0), (1, 1, 1), values, at)) / 1000.0 * [-1, -1, 1]
    check.judge("itk_nrrd", "NumPy, from the format's description", seen, LATTICE_UM)
    if shutil.which("unu"):
        assert "type: double" in run("unu", "head", path)
        low, high = (float(v) for v in re.findall(r"(?:min|max): (\S+)", run("unu", "minmax", path)))
        assert abs(low - values.min()) < 1e-9 and abs(high - values.max()) < 1e-9


def check_h5_alone(check):
    if not shutil.which("h5dump"):
        return
    text = run("h5dump", "-d", "/TransformGroup/0/TransformFixedParameters", "-m", "%.17g", check.export("itk_h5"))
    fixed = [float(v) for v in re.findall(r"[-+0-9.e]+", text[text.index("DATA {"):].replace("(0)", "").split("}")[0])
             if re.fullmatch(r"[-+]?[0-9][-+0-9.e]*", v)]
    assert "DisplacementFieldTransform_double_3_3" in run("h5dump", "-d", "/TransformGroup/0/TransformType", check.at("itk_h5.out.h5"))
    assert len([v for v in fixed]) >= 18, text


def check_vtk(check, program):
    seen = numbers_of(run(program, "grid", check.export("vtk_vti"), text=lines_of(check.points)))
    check.judge("vtk_vti", "VTK's vtkGridTransform", seen, LATTICE_UM)
    path = check.export("vtk_vti", "gp", "--direction", "true-to-measured")
    seen = numbers_of(run(program, "grid", path, text=lines_of(check.expected["gp"])))
    check.judge("vtk_vti", "VTK's vtkGridTransform", seen, LATTICE_UM, inverse=True)
    # A spline of its own between the places; at them it is exact.
    with open(check.at("places.nodes.csv"), encoding="utf-8") as lines:
        places = [[float(row[f"{a}_m"]) for a in "xyz"] for row in csv.DictReader(l for l in lines if not l.startswith("#"))]
    truth = check.apply("gp", places)
    seen = numbers_of(run(program, "landmarks", check.export("vtk_landmarks"), text=lines_of(places)))
    off = 1e6 * numpy.linalg.norm(seen - truth, axis=1)
    ROWS.append(("vtk_landmarks (at the places)", "VTK's vtkThinPlateSplineTransform", off.max(), numpy.percentile(off, 99), math.nan,
                 off.max() < 1.0))
    seen = numbers_of(run(program, "landmarks", check.at("vtk_landmarks.out.vtp"), text=lines_of(check.points)))
    check.judge("vtk_landmarks", "VTK's vtkThinPlateSplineTransform", seen, 3000.0)
    seen = numbers_of(run(program, "places", check.export("vtk_vtp")))
    rig = numpy.array([[i, j, k] for i in range(COUNTS[0]) for j in range(COUNTS[1]) for k in range(COUNTS[2])]) * PITCHES
    off = 1e6 * numpy.linalg.norm(seen[:, :3] - rig, axis=1)
    ROWS.append(("vtk_vtp (true places)", "VTK's vtkXMLPolyDataReader", off.max(), numpy.percentile(off, 99), math.nan,
                 off.max() < 1e-3 and len(seen) == len(rig)))


def check_scipy(check):
    for direction in ("measured-to-true", "true-to-measured"):
        inverse = direction == "true-to-measured"
        points = check.expected["gp"] if inverse else check.points
        arrays = numpy.load(check.export("numpy", "gp", "--direction", direction))
        assert f"direction: {direction}" in arrays["about"].item().decode()
        assert arrays["inside"].dtype == bool and arrays["inside"].any() and numpy.isfinite(arrays["uncertainty_m"]).all()
        assert numpy.allclose(arrays["raw_m"][1, 2, 3], [arrays["x_m"][1], arrays["y_m"][2], arrays["z_m"][3]], atol=1e-15)
        axes = (arrays["x_m"], arrays["y_m"], arrays["z_m"])
        seen = scipy.interpolate.RegularGridInterpolator(axes, arrays["corrected_m"])(points)
        check.judge("numpy", "SciPy's RegularGridInterpolator", seen, LATTICE_UM, inverse=inverse)
        if not inverse:
            turn = scipy.interpolate.RegularGridInterpolator(axes, arrays["q_wxyz"])(points)
            check_turns(check, "numpy (orientation)", turn)
    mat = scipy.io.loadmat(check.export("matlab"))
    axes = tuple(mat[f"{a}_m"].ravel() for a in "xyz")
    check.judge("matlab", "SciPy's loadmat", scipy.interpolate.RegularGridInterpolator(axes, mat["corrected_m"])(check.points), LATTICE_UM)
    assert "unit: metres" in str(mat["about"][0])
    with open(check.export("lattice_csv"), encoding="utf-8") as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    raw = numpy.array([[float(r[f"{a}_m"]) for a in "xyz"] for r in rows])
    corrected = numpy.array([[float(r[f"{a}_corrected_m"]) for a in "xyz"] for r in rows])
    axes = tuple(numpy.unique(raw[:, a]) for a in range(3))
    grid = corrected.reshape(tuple(len(a) for a in axes) + (3,))
    check.judge("lattice_csv", "SciPy's RegularGridInterpolator", scipy.interpolate.RegularGridInterpolator(axes, grid)(check.points),
                LATTICE_UM)


def check_turns(check, form, turns):
    """Rotations before the identity, against what `apply` makes of it. The mounting is the sensor's own: taken off at a point."""
    check.apply("gp", check.points)
    turns = turns / numpy.linalg.norm(turns, axis=1)[:, None]
    conjugate = turns * [1, -1, -1, -1]
    mounts = numpy.array([multiplied(c, t) for c, t in zip(conjugate, check.turned)])
    mounts *= numpy.sign(mounts[:, :1])
    spread = 2 * numpy.degrees(numpy.linalg.norm(mounts[:, 1:] - mounts[0, 1:], axis=1)).max()
    ROWS.append((form, "spread of the mounting left, degrees", spread, spread, math.nan, spread < 0.01))


def multiplied(a, b):
    return numpy.array([a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
                        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]])


def check_vrui(check):
    with open(check.export("vrui_grid"), "rb") as file:
        data = file.read()
    n = struct.unpack("<3i", data[:12])
    vertices = numpy.frombuffer(data[12:12 + 52 * n[0] * n[1] * n[2]], "<f4").astype(float).reshape(*n, 13)
    origin, last = vertices[0, 0, 0, :3], vertices[-1, -1, -1, :3]
    pitch = (last - origin) / (numpy.array(n) - 1)
    seen = check.points + trilinear(origin, pitch, vertices[..., 7:10], check.points)
    check.judge("vrui_grid", "transcribed reader", seen, LATTICE_UM)
    vectors = trilinear(origin, pitch, vertices[..., 10:13], check.points)
    angle = numpy.linalg.norm(vectors, axis=1)
    turns = numpy.hstack([numpy.cos(angle / 2)[:, None], vectors * (numpy.sin(angle / 2) / angle)[:, None]])
    check_turns(check, "vrui_grid (orientation)", turns)

    with open(check.export("vrui_forward_grid"), encoding="utf-8") as file:
        text = file.read().split("#")[0]
    head, body = text.split("V", 1)
    n, origin, pitch = ([float(v) for v in line.split()] for line in head.strip().splitlines())
    n = [int(v) for v in n]
    values = numpy.array([float(v) for v in re.findall(r"[-+0-9.e]+", body)]).reshape(*n, 7)
    lattice = numpy.stack(numpy.meshgrid(*[origin[a] + pitch[a] * numpy.arange(n[a]) for a in range(3)], indexing="ij"), -1)
    offset = trilinear(origin, pitch, values[..., :3] - lattice, check.points)
    vectors = trilinear(origin, pitch, values[..., 3:6] * values[..., 6:7], check.points)
    seen = [rotation(v, numpy.linalg.norm(v)) @ p + o for v, p, o in zip(vectors, check.points, offset)]
    check.judge("vrui_forward_grid", "transcribed reader", seen, 200.0)


def check_period(check):
    numbers = [float(v) for v in open(check.export("cave_table"), encoding="utf-8").read().split("#")[0].split()]
    bounds, rows = numpy.array(numbers[:6]).reshape(3, 2), numpy.array(numbers[6:]).reshape(-1, 6)
    # The old drivers take the step for one foot, and ignore the first three columns.
    n = [int(round(high - low)) + 1 for low, high in bounds]
    assert len(rows) == n[0] * n[1] * n[2] and numpy.allclose(bounds, numpy.round(bounds))
    corrected = rows[:, 3:].reshape(*n, 3) * FOOT
    seen = trilinear(bounds[:, 0] * FOOT, (FOOT,) * 3, corrected, check.points)
    check.judge("cave_table", "transcribed reader, 1-foot steps", seen, 20000.0)
    numbers = [float(v) for v in open(check.export("syzygy_table"), encoding="utf-8").read().split("#")[0].split()]
    n, origin, pitch = [int(v) for v in numbers[0:9:3]], numpy.array(numbers[1:9:3]), numpy.array(numbers[2:9:3])
    values = numpy.array(numbers[9:]).reshape(3, n[2], n[1], n[0]).transpose(3, 2, 1, 0) * FOOT
    seen = trilinear(origin * FOOT, pitch * FOOT, values, check.points)
    check.judge("syzygy_table", "transcribed reader", seen, 5000.0)


def check_rigid(check):
    transform = xml.etree.ElementTree.parse(check.export("plus_xml")).getroot().find("CoordinateDefinitions/Transform")
    assert transform.get("From") == "Tracker" and transform.get("To") == "Reference" and transform.get("Date") == "2024.05.17 10:30:00"
    matrix = numpy.array([float(v) for v in transform.get("Matrix").split()]).reshape(4, 4)
    seen = (check.points * 1000.0) @ matrix[:3, :3].T / 1000.0 + matrix[:3, 3] / 1000.0
    check.judge("plus_xml", "by hand: rigid part", seen, 40000.0)
    lines = [l.split() for l in open(check.export("vrpn_cfg"), encoding="utf-8") if not l.startswith("#")]
    t, (x, y, z, w) = numpy.array([float(v) for v in lines[2][:3]]), [float(v) for v in lines[2][3:]]
    turn = numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    again = check.points @ turn.T + t
    off = 1e6 * numpy.linalg.norm(again - seen, axis=1)
    ROWS.append(("vrpn_cfg (against plus_xml)", "by hand: rigid part", off.max(), numpy.percentile(off, 99), math.nan, off.max() < 0.01))


def check_polynomial(check):
    with open(check.export("polynomial_json", "poly"), encoding="utf-8") as file:
        p = json.load(file)
    u = (check.points - p["center_m"]) @ numpy.array(p["axes"]) / p["scale_m"]
    seen = check.points @ numpy.array(p["rotation"]).T + p["translation_m"]
    for term in p["terms"]:
        seen = seen + numpy.prod(u ** numpy.array(term["powers"]), axis=1)[:, None] * numpy.array(term["coefficient_m"])
    check.judge("polynomial_json", "NumPy", seen, 1e-6, "poly")
    source = check.export("polynomial_c", "poly")
    points = check.points
    for compiler in ("gcc", "clang-14", "clang"):
        if not shutil.which(compiler):
            continue
        for level in ("-O0", "-O1", "-O2", "-O3"):
            library = check.at(f"{compiler}{level}.so")
            run(compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", level, "-shared", "-fPIC", "-o", library, source)
            function = ctypes.CDLL(library).fieldtrue_correct
            seen = []
            for point in points:
                at, goes = (ctypes.c_double * 3)(*point), (ctypes.c_double * 3)()
                function(at, goes)
                seen.append(list(goes))
            check.judge("polynomial_c", f"{compiler} {level}", seen, 1e-6, "poly")
    refused = subprocess.run([check.cli, "export", "--calibration", check.at("gp.ftcal.json"), "--format", "polynomial_c", "--out",
                              check.at("no.c")], capture_output=True, text=True, check=False)
    assert refused.returncode == 1 and "polynomial only" in refused.stderr and not os.path.exists(check.at("no.c")), refused


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cli")
    parser.add_argument("--itk")
    parser.add_argument("--vtk")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        check = Check(given.cli, folder)
        if given.itk:
            check_itk(check, given.itk)
        if given.vtk:
            check_vtk(check, given.vtk)
        for one in (check_nrrd_alone, check_h5_alone, check_scipy, check_vrui, check_period, check_rigid, check_polynomial):
            one(check)
    print("| format | reader | worst, um | 99 %, um | wrong direction off by, mm | |\n|---|---|---|---|---|---|")
    for form, reader, worst, most, wrong, good in ROWS:
        print(f"| {form} | {reader} | {worst:.3g} | {most:.3g} | {wrong:.3g} | {'' if good else 'BEYOND ITS BOUND'} |")
    return 0 if all(row[-1] for row in ROWS) else 1


if __name__ == "__main__":
    sys.exit(main())
