#!/usr/bin/env python3
"""How often the 90 % intervals of `compare` hold the truth they are about.

interval_coverage.py FIELDTRUE-CLI ROOMS-FOLDER [--tables N] [--places 30,60,120,567] [--rooms a,b] [--processes N]

Of every room thousands of places are recorded without noise, scattered evenly over its box. Tables are drawn from
them; each stated position is then moved as a hand misplaces a jig, calm (Gaussian of 2 mm an axis) or with gross
slips (one in twenty by six times as much). `compare` judges a table: its RMS, its 90 % interval, and the gain with
its interval. The truth is this script's own: the calibration that `fit` makes of the whole table is applied to 42
places for each of the table's (3,000 at least) that no table holds, and the mean square of what is left, plus the
known mean square of the misplacing, is what the interval should hold: the RMS of this fitted correction at fresh
places like those of the table. Untuned methods are left out one by one, at all sizes; the tuned ones stand in tables
of 60 with ten folds. Printed: the share of tables whose interval holds the truth, by cell, with the least and the
largest.
"""
import argparse
import csv
import json
import math
import multiprocessing
import os
import random
import subprocess
import sys
import tempfile

EXTENT_M = (2.44, 2.44, 1.83)  # Of the rooms' grid.
POOL = 9000
FRESH_A_PLACE = 42  # The truth's own error, the same for all tables, is then a sixth of what a table errs by.
FEWEST_FRESH = 3000
SLIP_SD_M = 0.002
UNTUNED = ("none", "affine", "polynomial:degree=2", "hmq", "tetrahedral")
TUNED = ("none", "rbf", "gaussian_process")


class Misplacing:
    """How the rig's stated positions are off, along each axis."""

    def __init__(self, heavy):
        self.gross = 0.05 if heavy else 0.0

    def draw_m(self, draw):
        sd_m = SLIP_SD_M * (6 if draw.random() < self.gross else 1)
        return [draw.gauss(0, sd_m) for _ in range(3)]

    def mean_square_m2(self):
        return 3 * SLIP_SD_M**2 * (1 - self.gross + 36 * self.gross)


def run(*arguments):
    ended = subprocess.run(arguments, text=True, capture_output=True, check=False)
    if ended.returncode != 0:
        raise RuntimeError(f"{' '.join(arguments)}: {ended.stderr.strip()}")
    return ended.stdout


def rows_of(path):
    with open(path, encoding="utf-8") as text:
        lines = text.read().splitlines()
    return [line for line in lines if line.startswith("#")], list(
        csv.DictReader(line for line in lines if not line.startswith("#")))


def write(path, head, rows):
    with open(path, "w", encoding="utf-8", newline="") as out:
        out.write("".join(line + "\n" for line in head))
        writer = csv.DictWriter(out, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def record(cli, rooms, room, folder, n_fresh=FEWEST_FRESH):
    """Readings without noise at places scattered over the room's box."""
    with open(os.path.join(rooms, f"{room}.scene.json"), encoding="utf-8") as text:
        scene = json.load(text)
    scene["tracker"].update(coupling_noise=1e-9, correlation=0)
    scene["rig"] = {"tolerance_m": 0, "tolerance_rad": 0}
    draw = random.Random(room)
    nodes = [dict(zip(("x_m", "y_m", "z_m"), (draw.uniform(0, side_m) for side_m in EXTENT_M)), node=number)
             for number in range(POOL + n_fresh)]
    paths = [os.path.join(folder, name) for name in ("room.scene.json", "room.plan.json", "room.nodes.csv")]
    for path, content in zip(paths, (scene, {"schema": "fieldtrue.plan/1", "nodes": nodes})):
        with open(path, "w", encoding="utf-8") as out:
            json.dump(content, out)
    run(cli, "simulate", "--scene", paths[0], "--plan", paths[1], "--seed", "3", "--nodes", paths[2])
    return rows_of(paths[2])


def drawn_table(rows, n_places, draw, misplacing):
    """Rows of some places of the pool, each stated where the rig would say that it stands."""
    some = [dict(row) for row in draw.sample(rows[:POOL], n_places)]
    for row in some:
        for axis, slip_m in zip("xyz", misplacing.draw_m(draw)):
            row[f"{axis}_true_m"] = repr(float(row[f"{axis}_true_m"]) + slip_m)
    return some


def fresh_mean_square_m2(cli, table, method, fresh, folder):
    """Of the correction that a fit to the whole table is, against exact positions."""
    calibration, corrected = os.path.join(folder, "a.ftcal.json"), os.path.join(folder, "corrected.csv")
    run(cli, "fit", "--nodes", table, "--position", method, "--out", calibration)
    run(cli, "apply", "--calibration", calibration, "--in", fresh, "--out", corrected, "--force")
    rows = rows_of(corrected)[1]
    return sum((float(row[f"{axis}_corrected_m"]) - float(row[f"{axis}_true_m"]))**2
               for row in rows for axis in "xyz") / len(rows)


def cell(job):
    """{(figure, method): [whether each table's interval held the truth]} of one room, noise and size."""
    cli, rooms, room, heavy, n_places, n_tables, tuned = job
    held = {}
    with tempfile.TemporaryDirectory() as folder:
        head, rows = record(cli, rooms, room, folder, max(FEWEST_FRESH, FRESH_A_PLACE * n_places))
        fresh, table = os.path.join(folder, "fresh.csv"), os.path.join(folder, "table.nodes.csv")
        write(fresh, head, rows[POOL:])
        draw, misplacing = random.Random(f"{room} {heavy} {n_places} {tuned}"), Misplacing(heavy)
        for _ in range(n_tables):
            write(table, head, drawn_table(rows, n_places, draw, misplacing))
            methods = TUNED if tuned else UNTUNED
            judged = json.loads(run(cli, "compare", "--nodes", table, "--methods", ",".join(methods), "--json"))
            assert judged["validate"] == ("kfold:10" if tuned else "loo")
            truth_mm = {}
            for method, score in zip(methods, judged["position"]):
                if score["skipped"]:
                    continue
                square_m2 = fresh_mean_square_m2(cli, table, method, fresh, folder) + misplacing.mean_square_m2()
                truth_mm[method] = 1000 * math.sqrt(square_m2)
                low, high = (score["position_mm"][end] for end in ("rms_low90", "rms_high90"))
                held.setdefault(("RMS", method), []).append(low <= truth_mm[method] <= high)
                if score["method"] == judged["best"]["position"]:
                    gain = 1 - truth_mm[method] / truth_mm["none"]
                    low, high = (judged["verdict"][f"gain_{end}90"] for end in ("low", "high"))
                    held.setdefault(("gain", "best"), []).append(low <= gain <= high)
    return job, held


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cli")
    parser.add_argument("rooms_folder")
    parser.add_argument("--tables", type=int, default=400)
    parser.add_argument("--places", default="30,60,120,567")
    parser.add_argument("--rooms", default="steel_floor,mixed")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    given = parser.parse_args()
    jobs = [(given.cli, given.rooms_folder, room, heavy, n_places, given.tables, tuned)
            for n_places in map(int, given.places.split(",")) for room in given.rooms.split(",")
            for heavy in (False, True) for tuned in ((False, True) if n_places == 60 else (False,))]
    shares = {}
    print("| places | room | placing | figure | tables | intervals that hold the truth |\n|---|---|---|---|---|---|")
    with multiprocessing.Pool(given.processes) as pool:
        for (_, _, room, heavy, n_places, _, _), held in pool.imap(cell, jobs):
            for (figure, method), hits in held.items():
                share = sum(hits) / len(hits)
                shares.setdefault(figure, []).append(share)
                print(f"| {n_places} | {room} | {'gross slips' if heavy else 'calm'} | {figure} of {method} | {len(hits)} | "
                      f"{share:.3f} |", flush=True)
    for figure, values in shares.items():
        inside = sum(0.85 <= value <= 0.95 for value in values)
        print(f"\n{figure}: mean {sum(values) / len(values):.3f}, least {min(values):.2f}, largest {max(values):.2f}; "
              f"{inside} of {len(values)} cells from 0.85 to 0.95")


if __name__ == "__main__":
    sys.exit(main())
