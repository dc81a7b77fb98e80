#!/usr/bin/env python3
"""The runtime as another program meets it.

runtime_check.py FIELDTRUE-CLI BUILD

Installs the component `runtime` to a folder of its own; looks at what its libraries need; builds the examples in C and C++
through pkg-config and CMake's package and runs them, and the one in Python, on 1,000 points; loads the exported trackd plug-in as a
host would. What `apply` writes is what all are held to. Printed, a line each; the status is 1 when a figure is beyond its bound.
"""
import csv
import ctypes
import math
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "exporters"))
from read_back import Check, FOOT, run  # noqa: E402

ALLOWED = ("linux-vdso", "libstdc++", "libm.", "libgcc_s", "libc.", "ld-linux")
FAILED = []


def judged(what, good, seen):
    print(f"{'ok' if good else 'WRONG':5} {what}: {seen}")
    if not good:
        FAILED.append(what)


def check_needs(prefix):
    for name in ("lib/libfieldtrue_runtime.so", "lib/fieldtrue/libfieldtrue_trackd.so"):
        needs = [line.split()[0] for line in run("ldd", prefix / name).splitlines()]
        foreign = [one for one in needs if not any(part in one for part in ALLOWED)]
        judged(f"{name} needs", not foreign, ", ".join(foreign) or "the C++ runtime alone")
    names = {line.split()[-1] for line in run("nm", "-D", "--defined-only", prefix / "lib/libfieldtrue_runtime.so").splitlines()}
    judged("exported names", all(n.startswith("fieldtrue_") for n in names), f"{len(names)}, all fieldtrue_*")


def corrected(text):
    rows = [line.split() for line in text.splitlines()]
    return numpy.array([[float(x) for x in row[:7]] for row in rows]), [row[7] for row in rows]


def compare(what, text, check, name, bound_um, bound_deg):
    rows, inside = corrected(text)
    off_um = 1e6 * numpy.linalg.norm(rows[:, :3] - check.expected[name], axis=1).max()
    angle = [2 * math.degrees(math.acos(min(1.0, abs(float(a @ b))))) for a, b in zip(rows[:, 3:], check.turned)]
    same = bound_um == 0.0 and (rows[:, :3] == check.expected[name]).all() and (rows[:, 3:] == check.turned).all()
    good = same if bound_um == 0.0 else off_um <= bound_um and max(angle) <= bound_deg
    judged(what, good and set(inside) == {"inside"}, "apply's bits" if same else f"{off_um:.3g} um, {max(angle):.2g} deg")


def check_examples(check, prefix, folder):
    examples, environment = prefix / "share/fieldtrue/examples", dict(os.environ)
    environment["PKG_CONFIG_PATH"] = str(prefix / "lib/pkgconfig")
    environment["LD_LIBRARY_PATH"] = str(prefix / "lib")
    environment["PYTHONPATH"] = str(prefix / "lib/python3/fieldtrue")
    flags = subprocess.run(["pkg-config", "--cflags", "--libs", "fieldtrue_runtime"], env=environment, capture_output=True,
                           text=True, check=True).stdout.split()
    strict = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    run("cc", "-std=c99", *strict, examples / "correct.c", "-o", folder / "in_c", *flags)
    run("c++", "-std=c++11", *strict, examples / "correct.cpp", "-o", folder / "in_cpp", *flags)
    project = folder / "project"
    project.mkdir()
    (project / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(user C)\nfind_package(FieldtrueRuntime 0.1 REQUIRED)\n"
        f"add_executable(user {examples / 'correct.c'})\ntarget_link_libraries(user Fieldtrue::fieldtrue_runtime)\n", "utf-8")
    run("cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={prefix}")
    run("cmake", "--build", project / "build")
    poses = "".join(" ".join(repr(float(x)) for x in (*p, 1, 0, 0, 0)) + "\n" for p in check.points)

    def ran(*command):
        return subprocess.run([str(c) for c in command], input=poses, env=environment, capture_output=True, text=True,
                              check=True).stdout

    for name in ("gp", "poly"):
        check.expected[name] = check.apply(name, check.points)  # And check.turned.
        file = check.at(f"{name}.ftcal.json")
        compare(f"C, pkg-config, {name}", ran(folder / "in_c", file), check, name, 0.0, 0.0)
        compare(f"C, CMake's package, {name}", ran(project / "build/user", file), check, name, 0.0, 0.0)
        compare(f"Python, {name}", ran(sys.executable, examples / "correct.py", file), check, name, 0.0, 0.0)
        compare(f"C++, baked, {name}", ran(folder / "in_cpp", file), check, name, 50.0, 0.01)
    damaged = folder / "damaged.ftcal.json"
    damaged.write_text(pathlib.Path(check.at("gp.ftcal.json")).read_text("utf-8").replace('"rigid"', '"none"', 1), "utf-8")
    for command in ([folder / "in_c"], [folder / "in_cpp"], [sys.executable, examples / "correct.py"]):
        done = subprocess.run([str(c) for c in [*command, damaged]], input="", env=environment, capture_output=True, text=True,
                              check=False)
        told = done.stderr.strip()
        judged(f"damaged file, {os.path.basename(str(command[-1]))}", done.returncode == 1 and "checksum" in told
               and "\n" not in told, told)


def check_python(check, prefix):
    os.environ["FIELDTRUE_RUNTIME"] = str(prefix / "lib/libfieldtrue_runtime.so.0")
    sys.path.insert(0, str(prefix / "lib/python3/fieldtrue"))
    import fieldtrue_runtime
    calibration = fieldtrue_runtime.Calibration(check.at("gp.ftcal.json"))
    rows = numpy.hstack([check.points, numpy.tile([1.0, 0, 0, 0], (len(check.points), 1))])
    off = numpy.abs(calibration.correct_many(rows)[:, :3] - check.expected["gp"]).max()
    judged("Python, many at once", off == 0.0, "apply's bits" if off == 0.0 else off)
    lists = calibration.correct_many([list(map(float, row)) for row in rows[:3]])
    judged("Python, facts", calibration.fact("method") == "gaussian_process" and calibration.fact("setup.room") == "the oblique room"
           and calibration.fact("setup.units") is None and numpy.shape(lists) == (3, 7), calibration.fact("setup.room"))
    told_m = [calibration.uncertainty_m(list(p), [1, 0, 0, 0]) for p in check.points]
    check.apply("gp", check.points)
    with open(check.at("out.csv"), encoding="utf-8") as lines:
        expected_m = [float(r["uncertainty_m"]) for r in csv.DictReader(line for line in lines if not line.startswith("#"))]
    worst = max(abs(a / b - 1) for a, b in zip(told_m, expected_m))
    # By another Cholesky factor, of a matrix whose noise is all but nil.
    judged("uncertainty", worst < 1e-4, f"{worst:.1e} of itself beside apply's")


def euler(q):
    w, x, y, z = q
    return [math.degrees(a) for a in (math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
                                      math.asin(max(-1.0, min(1.0, 2 * (w * y - x * z)))),
                                      math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)))]


def check_trackd(check, folder):
    run(check.cli, "export", "--calibration", check.at("gp.ftcal.json"), "--format", "trackd_plugin", "--out", folder / "plug")
    again = subprocess.run([str(check.cli), "export", "--calibration", check.at("gp.ftcal.json"), "--format", "trackd_plugin",
                            "--out", str(folder / "plug/fieldtrue.params")], capture_output=True, text=True, check=False)
    judged("trackd writes over nothing", again.returncode == 1 and "--force" in again.stderr, again.stderr.strip()[-60:])
    (folder / "mine").mkdir()
    (folder / "mine/gp_measured-to-true.trackd").mkdir()
    (folder / "mine/gp_measured-to-true.trackd/precious").touch()
    for force in ([], ["--force"]):
        done = subprocess.run([str(check.cli), "export", "--calibration", check.at("gp.ftcal.json"), "--format", "trackd_plugin",
                               "--out", str(folder / "mine"), *force], capture_output=True, text=True, check=False)
        judged(f"a folder of somebody else's stays {force}", done.returncode == 1
               and (folder / "mine/gp_measured-to-true.trackd/precious").exists(), done.stderr.strip()[-60:])
    plugin = ctypes.CDLL(str(folder / "plug/libfieldtrue_trackd.so"))
    plugin.calib_init.restype = ctypes.c_void_p
    plugin.calib_init.argtypes = [ctypes.POINTER(ctypes.c_char_p), ctypes.c_int]
    plugin.calib_evaluate.argtypes = [ctypes.c_void_p, ctypes.POINTER(ctypes.c_float)]
    plugin.calib_exit.argtypes = [ctypes.c_void_p]

    def init(*parameters):
        return plugin.calib_init((ctypes.c_char_p * len(parameters))(*(p.encode() for p in parameters)), len(parameters))

    params = str(folder / "plug/fieldtrue.params")
    check.expected["gp"] = check.apply("gp", check.points)
    for what, more, unit, angle, order in (
            ("trackd, feet and degrees", [], FOOT, 1.0, (0, 1, 2, 3, 4, 5)),
            ("trackd, another order, m and rad", ["units=m", "angles=rad", "order=roll,elevation,azimuth,z,y,x"], 1.0,
             math.pi / 180, (5, 4, 3, 2, 1, 0))):
        data = init(params, *more)
        worst_um = worst_deg = 0.0
        for p, expected, turned in zip(check.points, check.expected["gp"], check.turned):
            numbers = [*(p / unit), 0.0, 0.0, 0.0]
            pose = (ctypes.c_float * 6)()
            for i, place in enumerate(order):
                pose[place] = numbers[i]
            plugin.calib_evaluate(data, pose)
            seen = [pose[place] for place in order]
            worst_um = max(worst_um, 1e6 * numpy.linalg.norm(unit * numpy.array(seen[:3]) - expected))
            worst_deg = max(worst_deg, max(abs((a / angle - b + 180) % 360 - 180) for a, b in zip(seen[3:], euler(turned))))
        judged(what, worst_um < 1.0 and worst_deg < 1e-3, f"{worst_um:.2g} um, {worst_deg:.1g} deg")
        plugin.calib_exit(data)
    pose = (ctypes.c_float * 6)(1, 2, 3, 4, 5, 6)
    for wrong in (["calibration=none.json"], [], [params, "units=parsec"], [params, "order=x,x,y,z,azimuth,roll"], ["no.params"]):
        data = init(*wrong)
        plugin.calib_evaluate(data, pose)
        judged(f"trackd refuses {wrong[-1:] or 'nothing'}", data is None and list(pose) == [1, 2, 3, 4, 5, 6], "stays")
    plugin.calib_exit(None)
    text = (folder / "plug/fieldtrue.params").read_text("utf-8")
    told = [key for key in ("unit", "direction", "method", "date", "held_out", "frame") if key not in text]
    judged("trackd's parameter file tells", not told, ", ".join(told) or "unit, direction, method, date, held-out error, frame")


def main():
    cli, build = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        run("cmake", "--install", build, "--component", "runtime", "--prefix", folder / "installed")
        check = Check(cli, name)
        check_needs(folder / "installed")
        check_examples(check, folder / "installed", folder)
        check_python(check, folder / "installed")
        check_trackd(check, folder)
    if FAILED:
        sys.exit("beyond its bound: " + ", ".join(FAILED))


if __name__ == "__main__":
    main()
