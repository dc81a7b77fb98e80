#!/usr/bin/env python3
"""How often `diagnose --against` says that a field changed, on recordings made by the generator of the blind check.

against_blind.py FIELDTRUE-CLI SET

SET is a folder of `fieldtrue-blind generate` that is open. Each session is the earlier recording; the later one are its sealed
unseen places inside the grid, with 1 mm and 1.5 mrad of noise put on here. Only what acts in time differs between the two.
Printed: a session a line, then how many were said to have changed, by whether what was withheld acts in time.
"""
import csv
import json
import multiprocessing
import os
import random
import subprocess
import sys
import tempfile

IN_TIME = ("metal_moved", "gain_drift", "off:warm", "off:hysteresis", "off:cable_gain", "off:sensor_swapped")
SD_M, SD_HALF_RAD = 1e-3, 0.75e-3
POSE = ["x_m", "y_m", "z_m"]
TURN = ["qw", "qx", "qy", "qz"]
TRUE = ["x_true_m", "y_true_m", "z_true_m", "qw_true", "qx_true", "qy_true", "qz_true"]


def turned(q, draw):
    """A quaternion after a small random turn."""
    w, x, y, z = q
    a, b, c = (draw.gauss(0, SD_HALF_RAD) for _ in range(3))
    return w - a * x - b * y - c * z, x + a * w + b * z - c * y, y + b * w + c * x - a * z, z + c * w + a * y - b * x


def later(folder, name, path):
    """Writes the sealed places as a node table with the session's own metadata."""
    draw = random.Random(name)
    with open(os.path.join(folder, name + ".nodes.csv")) as file:
        lines = list(file)
    metadata = [line for line in lines if line.startswith("#")]
    header = next(line for line in lines if not line.startswith("#")).strip().split(",")
    columns = TRUE + POSE + (TURN if "qw" in header else [])
    with open(os.path.join(folder, "unseen", name + ".csv")) as file:
        rows = [row for row in csv.DictReader(line for line in file if not line.startswith("#")) if row["inside"] == "1"]
    with open(path, "w") as file:
        file.writelines(metadata)
        file.write(",".join(["node"] + columns) + "\n")
        for node, row in enumerate(rows):
            row.update({axis: float(row[axis]) + draw.gauss(0, SD_M) for axis in POSE})
            if "qw" in header:
                row.update(zip(TURN, turned([float(row[part]) for part in TURN], draw)))
            file.write(",".join([str(1000 + node)] + [str(row[column]) for column in columns]) + "\n")


def compare(job):
    program, folder, name = job
    with tempfile.TemporaryDirectory() as place:
        table, report = os.path.join(place, "later.csv"), os.path.join(place, "r.gap.json")
        later(folder, name, table)
        done = subprocess.run([program, "diagnose", "--threads", "1", "--nodes", table, "--against",
                               os.path.join(folder, name + ".nodes.csv"), "--out", report],
                              capture_output=True, text=True, check=False)
        if done.returncode:
            return name, None
        with open(report) as file:
            return name, json.load(file)["against"]


def main():
    program, folder = sys.argv[1:3]
    with open(os.path.join(folder, "truth.json")) as file:
        truth = {session["file"]: session for session in json.load(file)["sessions"]}
    counts = {False: [0, 0], True: [0, 0]}
    with multiprocessing.Pool(2) as pool:
        for name, against in pool.imap(compare, [(program, folder, name) for name in sorted(truth)]):
            effects = "+".join(effect["id"] for effect in truth[name]["effects"])
            if against is None:
                print(f"{name} {effects}: too few places that the earlier recording tells", flush=True)
                continue
            in_time = any(word in effects for word in IN_TIME)
            counts[in_time][0] += against["changed"]
            counts[in_time][1] += 1
            print(f"{name} rho {truth[name]['rho']:.2f} {effects}: {'changed' if against['changed'] else 'same'}, "
                  f"p {against['p_value']:.2g}, {against['rms_mm']:.2f} mm, {against['effect']}", flush=True)
    for in_time, words in ((False, "nothing acts in time"), (True, "something acts in time")):
        print(f"{words}: said to have changed in {counts[in_time][0]} of {counts[in_time][1]}")


if __name__ == "__main__":
    main()
