#!/usr/bin/env python3
"""How often `difference` says that a field changed: where nothing did, and where something small came into the room.

difference_alarms.py FIELDTRUE-CLI ROOMS-FOLDER [PAIRS]

Each room is recorded twice, with other placing errors and noise, on random places of one box (4 slips of centimetres among
them in the rows named so); both are fitted, and `difference` is asked. Then the second recording is made with a metal
sphere more, at a random place in the box: how often it is said that the field changed, by the RMS that the sphere moves
readings by (told by `simulate` without noise, not by the program's judgement), and how far off the largest change is put.
"""
import csv
import json
import math
import os
import random
import subprocess
import sys
import tempfile

BOX = ((0.4, 1.6), (-0.6, 0.6), (-0.5, 0.5))
METHODS = ("gaussian_process", "polynomial:degree=3", "rbf", "harmonic_field")
SLIPS = 4


class Study:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder

    def run(self, *arguments):
        done = subprocess.run([self.program, *arguments], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(done.stderr)
        return done.stdout

    def at(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, value):
        with open(self.at(name), "w") as file:
            json.dump(value, file)
        return self.at(name)

    def plan(self, draw, count):
        nodes = [dict({"node": k, "qw": 1, "qx": 0, "qy": 0, "qz": 0},
                      **{axis: draw.uniform(*side) for axis, side in zip(("x_m", "y_m", "z_m"), BOX)})
                 for k in range(count)]
        return self.write("p.plan.json", {"schema": "fieldtrue.plan/1", "nodes": nodes})

    def record(self, scene, plan, seed, name, slips=0):
        path = self.at(name + ".csv")
        self.run("simulate", "--scene", scene, "--plan", plan, "--seed", str(seed), "--nodes", path)
        if slips:
            slip(path, random.Random(seed), slips)
        return path

    def fit(self, nodes, method, name):
        path = self.at(name + ".ftcal.json")
        self.run("fit", "--nodes", nodes, "--position", method, "--out", path)
        return path

    def difference(self, first, second):
        return json.loads(self.run("difference", first, second, "--json"))


def slip(path, draw, count):
    """The sensor stands elsewhere than the rig says, at some places."""
    with open(path) as file:
        lines = file.read().split("\n")
    head = next(i for i, line in enumerate(lines) if line and not line.startswith("#"))
    column = lines[head].split(",").index("x_true_m")
    rows = [i for i in range(head + 1, len(lines)) if lines[i]]
    for row in draw.sample(rows, count):
        fields = lines[row].split(",")
        for axis in range(3):
            fields[column + axis] = repr(float(fields[column + axis]) + draw.gauss(0, 0.02))
        lines[row] = ",".join(fields)
    with open(path, "w") as file:
        file.write("\n".join(lines))


def moved_mm(study, scene_a, scene_b, plan, seed):
    """RMS by which the same places are read elsewhere in the second scene."""
    tables = []
    for scene, name in ((scene_a, "ea"), (scene_b, "eb")):
        with open(study.record(scene, plan, seed, name)) as file:
            tables.append(list(csv.DictReader(line for line in file if not line.startswith("#"))))
    squares = [sum((float(a[axis]) - float(b[axis])) ** 2 for axis in ("x_m", "y_m", "z_m")) for a, b in zip(*tables)]
    return 1000 * math.sqrt(sum(squares) / len(squares))


def main():
    program, rooms = sys.argv[1:3]
    pairs = int(sys.argv[3]) if len(sys.argv) > 3 else 25
    with tempfile.TemporaryDirectory() as folder:
        study = Study(program, folder)
        print(f"{'room':12} {'places':>6} {'slips':>5}  said to have changed though nothing did, of {pairs} pairs")
        for room in ("steel_floor", "two_bodies", "mixed"):
            scene = os.path.join(rooms, room + ".scene.json")
            for count, slips in ((40, 0), (120, 0), (120, SLIPS)):
                alarms = {method: [0, 0] for method in METHODS}
                for pair in range(pairs):
                    draw = random.Random(f"{room} {count} {slips} {pair}")
                    a = study.record(scene, study.plan(draw, count), 2 * pair + 1, "a", slips)
                    b = study.record(scene, study.plan(draw, count), 2 * pair + 2, "b", slips)
                    for method in METHODS:
                        told = study.difference(study.fit(a, method, "a"), study.fit(b, method, "b"))
                        alarms[method][0] += told["verdict"] == "changed"
                        alarms[method][1] += told["verdict"] == "cannot_tell"
                print(f"{room:12} {count:6} {slips:5}  " + "  ".join(f"{m} {n} (cannot tell {k})" for m, (n, k) in
                                                                     alarms.items()), flush=True)
        print("\nA sphere more, 120 places: said to have changed, by the RMS that it moves readings by")
        scene = os.path.join(rooms, "steel_floor.scene.json")
        with open(scene) as file:
            before = json.load(file)
        for radius in (0.03, 0.05, 0.08, 0.12):
            told = {method: [0, 0, []] for method in METHODS}
            moved = []
            for pair in range(pairs):
                draw = random.Random(f"sphere {radius} {pair}")
                center = [draw.uniform(*side) for side in BOX]
                after = dict(before, effects=before["effects"] + [
                    {"id": "compact_metal", "parameters": {"center_m": center, "radius_m": radius,
                                                           "material": "conductive"}}])
                other = study.write("after.scene.json", after)
                plan_b = None
                try:
                    a = study.record(scene, study.plan(draw, 120), 2 * pair + 1, "a")
                    plan_b = study.plan(draw, 120)
                    b = study.record(other, plan_b, 2 * pair + 2, "b")
                    moved.append(moved_mm(study, scene, other, plan_b, 7))
                except RuntimeError:
                    continue  # A place inside the metal.
                for method in METHODS:
                    answer = study.difference(study.fit(a, method, "a"), study.fit(b, method, "b"))
                    told[method][0] += answer["verdict"] == "changed"
                    told[method][1] += answer["verdict"] == "cannot_tell"
                    if answer["verdict"] == "changed":
                        told[method][2].append(100 * math.dist(answer["field"]["max_at_m"], center))
            moved.sort()
            middle = lambda values: sorted(values)[len(values) // 2] if values else float("nan")
            print(f"radius {radius:.2f} m, median {middle(moved):6.2f} mm, of {len(moved)}:  " +
                  "  ".join(f"{m} {n} (cannot tell {k}; {middle(off):.0f} cm off)" for m, (n, k, off) in told.items()),
                  flush=True)


if __name__ == "__main__":
    main()
