#!/usr/bin/env python3
"""What orientation as an input of the position error is worth, on places that no fit saw.

orientation_gain.py FIELDTRUE-CLI [TABLE.nodes.csv ...] [--rooms FOLDER] [--tables-only]

Makes tables of simulated rooms, permutes the orientations of some, and takes the tables given and the shipped rooms besides
(48 places in three orientations each). Of each the places
are dealt to ten folds; every fold's table is fitted with the others alone (alignment, scales, choice of inputs and all)
and its own rows are corrected by `apply`. Folds, errors and intervals are this script's own: it asks the program for no
judgement. Printed are the RMS over places with position alone, with `inputs=auto` and with `inputs=pose`, and the change of
the RMS from position alone to `auto` with its paired 90 % interval (bootstrap over places). Then: what a correction fitted in
1, 3 and 6 orientations is worth in others. Then the same of orientations: the RMS angle left, by the same folds.
"""
import argparse
import csv
import glob
import itertools
import json
import math
import os
import random
import subprocess
import sys
import tempfile

FOLDS = 10
ROOM_PLAN = "grid:4x4x3@0.8x0.8x0.9:origin=0,0,0:orientations=3"
POSITION = ("x_m", "y_m", "z_m")
TURN = ("qw", "qx", "qy", "qz")


def scene(name, effects):
    return {"schema": "fieldtrue.scene/1", "name": name, "rig": {"tolerance_m": 0.0005, "tolerance_rad": 0.002},
            "effects": [{"id": kind, "parameters": parameters} for kind, parameters in effects]}


METAL = ("compact_metal", {"center_m": [0.7, 0.4, -0.5], "radius_m": 0.12, "material": "conductive"})
COILS = [("coil_gain", {"receiver_gain": [0.01, -0.01, 0.005]}),
         ("coil_nonorthogonality", {"receiver_rad": [0.005, -0.01, 0.005]}),
         ("finite_coil", {"coil": "receiver", "radius_m": [0.02, 0.015, 0.01]})]
TURNING = ["polynomial_quaternion:degree=2", "hmq_matrix", "gaussian_process:inputs=position", "gaussian_process"]
SCENES = {"unequal coils": scene("unequal coils", COILS), "metal": scene("metal", [METAL]),
          "metal and unequal coils": scene("metal and unequal coils", [METAL] + COILS)}


def random_turn(draw):
    q = [draw.gauss(0, 1) for _ in range(4)]
    norm = math.sqrt(sum(part * part for part in q))
    return [part / norm for part in q]


def scattered_plan(draw):
    """Every place in an orientation of its own."""
    nodes = []
    for number, (i, j, k) in enumerate(itertools.product(range(6), range(6), range(4))):
        nodes.append(dict(zip(("node", "x_m", "y_m", "z_m") + TURN,
                              [number, 0.3 + 0.14 * i, -0.35 + 0.14 * j, -0.3 + 0.14 * k] + random_turn(draw))))
    return {"schema": "fieldtrue.plan/1", "nodes": nodes}


class Program:
    def __init__(self, path, folder):
        self.path, self.folder = path, folder

    def run(self, *arguments):
        ended = subprocess.run([self.path, *arguments], text=True, capture_output=True, check=False)
        if ended.returncode != 0:
            raise ValueError(f"{' '.join(arguments)}: {ended.stderr.strip()}")
        return ended.stdout

    def file(self, name):
        return os.path.join(self.folder, name)

    def simulated(self, room, plan):
        with open(self.file("room.scene.json"), "w", encoding="utf-8") as out:
            json.dump(room, out)
        if isinstance(plan, dict):
            with open(self.file("some.plan.json"), "w", encoding="utf-8") as out:
                json.dump(plan, out)
            plan = self.file("some.plan.json")
        self.run("simulate", "--scene", self.file("room.scene.json"), "--plan", plan, "--seed", "7", "--nodes",
                 self.file("all.nodes.csv"))
        return Table(self.file("all.nodes.csv"))


class Table:
    def __init__(self, path):
        with open(path, encoding="utf-8") as text:
            lines = text.read().splitlines()
        self.head = [line for line in lines if line.startswith("#")]
        self.rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))

    def write(self, path, rows):
        with open(path, "w", encoding="utf-8", newline="") as out:
            out.write("".join(line + "\n" for line in self.head))
            writer = csv.DictWriter(out, self.rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)

    def permuted(self, draw):
        """Turns of other rows, tracked and true alike."""
        names = [name for name in self.rows[0] if name in TURN or name in [turn[:2] + "_true" for turn in TURN]]
        turns = [[row[name] for name in names] for row in self.rows]
        draw.shuffle(turns)
        for row, turn in zip(self.rows, turns):
            row.update(zip(names, turn))
        return self


def square_mm2(row):
    return sum((1e3 * (float(row[f"{axis}_corrected_m"]) - float(row[f"{axis}_true_m"]))) ** 2 for axis in "xyz")


def square_deg2(row):
    """Of the angle between corrected and true."""
    cosine = abs(sum(float(row[f"{turn}_corrected"]) * float(row[f"{turn}_true"]) for turn in TURN))
    return math.degrees(2 * math.acos(min(1.0, cosine))) ** 2


def foreign_squares(program, seen, unseen, inputs):
    """{place: squared error [mm2]} in orientations that were not fitted, inside the region that was; the share of the errors
    below twice the stated uncertainty; and the RMS of that over the RMS of the errors."""
    seen.write(program.file("seen.nodes.csv"), seen.rows)
    unseen.write(program.file("unseen.csv"), unseen.rows)
    program.run("fit", "--nodes", program.file("seen.nodes.csv"), "--position", f"gaussian_process:inputs={inputs}", "--out",
                program.file("foreign.ftcal.json"))
    program.run("apply", "--calibration", program.file("foreign.ftcal.json"), "--in", program.file("unseen.csv"), "--out",
                program.file("corrected.csv"), "--force")
    rows = [row for row in Table(program.file("corrected.csv")).rows if row["covered"] == "1"]
    within = sum(square_mm2(row) < (2e3 * float(row["uncertainty_m"])) ** 2 for row in rows) / len(rows)
    stated = math.sqrt(sum((1e3 * float(row["uncertainty_m"])) ** 2 for row in rows) / sum(map(square_mm2, rows)))
    return {row["node"]: square_mm2(row) for row in rows}, within, stated


def squares_by_place(program, table, method, square=square_mm2):
    """{place: mean squared error of its rows}, each by a fit that saw none of them. @param method options of `fit`"""
    places = sorted({row["node"] for row in table.rows}, key=int)
    random.Random(5).shuffle(places)
    fold_of = {place: number % min(FOLDS, len(places)) for number, place in enumerate(places)}
    squares = {place: [] for place in places}
    for fold in sorted(set(fold_of.values())):
        table.write(program.file("seen.nodes.csv"), [row for row in table.rows if fold_of[row["node"]] != fold])
        table.write(program.file("unseen.csv"), [row for row in table.rows if fold_of[row["node"]] == fold])
        program.run("fit", "--nodes", program.file("seen.nodes.csv"), *method, "--out", program.file("fold.ftcal.json"))
        program.run("apply", "--calibration", program.file("fold.ftcal.json"), "--in", program.file("unseen.csv"), "--out",
                    program.file("corrected.csv"), "--force")
        for row in Table(program.file("corrected.csv")).rows:
            squares[row["node"]].append(square(row))
    return {place: sum(rows) / len(rows) for place, rows in squares.items()}


def rms(squares, places):
    return math.sqrt(sum(squares[place] for place in places) / len(places))


def rms_of(squares):
    return rms(squares, list(squares))


def paired_interval(a, b):
    """90 % of the relative change of the RMS from a to b."""
    draw, places = random.Random(11), list(a)
    changes = []
    for _ in range(2000):
        some = draw.choices(places, k=len(places))
        changes.append(rms(b, some) / rms(a, some) - 1)
    changes.sort()
    return changes[100], changes[1899]


def told(program, name, table):
    """One line: RMS with position alone, `auto` and `pose`, and what `auto` changes."""
    def of(inputs):
        return squares_by_place(program, table, ["--position", f"gaussian_process:inputs={inputs}"])

    position, auto = of("position"), of("auto")
    try:
        pose = f"{rms_of(of('pose')):.3g}"
    except ValueError:  # Turned alike.
        pose = "-"
    low, high = paired_interval(position, auto)
    change = rms_of(auto) / rms_of(position) - 1
    print(f"| {name} | {len(table.rows)} | {rms_of(position):.3g} | {rms_of(auto):.3g} | {pose} | "
          f"{100 * change:+.0f} % ({100 * low:+.0f} to {100 * high:+.0f}) |", flush=True)


def tell_made(program):
    for name, room in SCENES.items():
        for turns in (3, 6):
            told(program, f"{name}, {turns} orientations",
                 program.simulated(room, f"grid:4x4x3@0.2:orientations={turns}"))
        told(program, f"{name}, each place turned at random", program.simulated(room, scattered_plan(random.Random(2))))
    for name in ("unequal coils", "metal"):
        permuted = program.simulated(SCENES[name], "grid:4x4x3@0.2:orientations=6").permuted(random.Random(3))
        told(program, f"{name}, 6 orientations permuted", permuted)


def tell_unseen(program):
    print("\n| never seen in these orientations | rows | position alone | auto | change by auto, 90 % | within 2 SD | stated SD / RMS |\n"
          "|---|---|---|---|---|---|---|")
    for name, room in SCENES.items():
        unseen = program.simulated(room, scattered_plan(random.Random(2)))
        for turns in (1, 3, 6):
            grid = f"grid:4x4x3@0.2:origin=0.3,-0.3,-0.25:orientations={turns}"
            seen = program.simulated(room, grid)
            (position, within, _), (auto, within_auto, stated) = (foreign_squares(program, seen, unseen, inputs)
                                                       for inputs in ("position", "auto"))
            low, high = paired_interval(position, auto)
            print(f"| {name}, fitted in {turns} | {len(seen.rows)} | {rms_of(position):.3g} | {rms_of(auto):.3g} | "
                  f"{100 * (rms_of(auto) / rms_of(position) - 1):+.0f} % ({100 * low:+.0f} to {100 * high:+.0f}) | "
                  f"{100 * within:.0f} %, {100 * within_auto:.0f} % | {stated:.2g} |", flush=True)


def tell_turning(program):
    print("\n| orientations | rows | none | " + " | ".join(TURNING) + " |\n|---|---|---|" + "---|" * len(TURNING))
    for name, room in SCENES.items():
        for plan, words in (("grid:4x4x3@0.2:orientations=3", "3 orientations"),
                            (scattered_plan(random.Random(2)), "each place turned at random")):
            table = program.simulated(room, plan)
            left = [squares_by_place(program, table, ["--position", "affine", "--orientation", method], square_deg2)
                    for method in ["none"] + TURNING]
            print(f"| {name}, {words} | {len(table.rows)} | " + " | ".join(f"{rms_of(one):.3g}" for one in left) + " |",
                  flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cli")
    parser.add_argument("tables", nargs="*")
    parser.add_argument("--rooms", help="folder of *.scene.json")
    parser.add_argument("--tables-only", action="store_true", help="leave out what is made here")
    options = parser.parse_args()
    head = "| table | rows | position alone | auto | pose | change by auto, 90 % |\n|---|---|---|---|---|---|"
    with tempfile.TemporaryDirectory() as folder:
        program = Program(options.cli, folder)
        if not options.tables_only:
            print(head)
            tell_made(program)
            tell_unseen(program)
            tell_turning(program)
            print()
        print(head)
        for path in sorted(glob.glob(os.path.join(options.rooms, "*.scene.json"))) if options.rooms else []:
            with open(path, encoding="utf-8") as text:
                told(program, os.path.basename(path).removesuffix(".scene.json").replace("_", " ") + ", 3 orientations",
                     program.simulated(json.load(text), ROOM_PLAN))
        for path in options.tables:
            told(program, os.path.basename(path).removesuffix(".nodes.csv"), Table(path))


if __name__ == "__main__":
    main()
