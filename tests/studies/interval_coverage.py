#!/usr/bin/env python3
"""How often the 90 % intervals of `compare` hold the truth they are about.

interval_coverage.py FIELDTRUE-CLI ROOMS-FOLDER [--tables N] [--places 30,60,120,567] [--rooms a,b] [--processes N]
                     [--keep FOLDER [--again]]

Of every room thousands of places are recorded without noise, scattered evenly over its box. Tables are drawn from
them; each stated position is then moved as a hand misplaces a jig, calm (Gaussian of 2 mm an axis) or with gross
slips (one in twenty by six times as much). `compare` judges a table: its RMS, its 90 % interval, and the gain with
its interval. The truth is this script's own: the calibration that `fit` makes of the whole table is applied to 42
places for each of the table's (3,000 at least) that no table holds, and the mean square of what is left, plus the
known mean square of the misplacing, is what the interval should hold: the RMS of this fitted correction at fresh
places like those of the table. Untuned methods are left out one by one, at all sizes; the tuned ones stand in tables
of 60 with ten folds. Printed: the share of tables whose interval holds the truth, by cell, and mean, least and
largest over the cells of a size.
"""
import argparse
import csv
import functools
import json
import math
import multiprocessing
import os
import random
import subprocess
import sys
import tempfile
import typing

EXTENT_M = (2.44, 2.44, 1.83)  # Of the rooms' grid.
ALL_ROOMS = "clean,steel_floor,steel_bar,two_bodies,copper_loop,mixed"
POOL = 9000
# All tables share what the pool and the fresh places err by: a fifth of what a table errs by.
POOL_A_PLACE = 60
FRESH_A_PLACE = 42
FEWEST_FRESH = 3000
SLIP_SD_M = 0.002
UNTUNED = ("none", "affine", "polynomial:degree=2", "hmq", "tetrahedral")
TUNED = ("none", "rbf", "gaussian_process")
COLUMNS = ("node", *(f"{axis}{kind}_m" for kind in ("_true", "") for axis in "xyz"))  # Positions are what is judged.


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


def columns_of(path, names):
    """[[number of each named column]] of the rows of a table."""
    with open(path, encoding="utf-8") as text:
        rows = csv.reader(line for line in text if not line.startswith("#"))
        head = next(rows)
        at = [head.index(name) for name in names]
        return [[float(row[column]) for column in at] for row in rows]


def write(path, head, rows):
    with open(path, "w", encoding="utf-8", newline="") as out:
        out.write("".join(line + "\n" for line in head))
        writer = csv.DictWriter(out, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def record(cli, rooms, room, folder, n_fresh=FEWEST_FRESH, n_pool=POOL):
    """Readings without noise at places scattered over the room's box."""
    with open(os.path.join(rooms, f"{room}.scene.json"), encoding="utf-8") as text:
        scene = json.load(text)
    scene["tracker"].update(coupling_noise=1e-9, correlation=0)
    scene["rig"] = {"tolerance_m": 0, "tolerance_rad": 0}
    draw = random.Random(room)
    nodes = [dict(zip(("x_m", "y_m", "z_m"), (draw.uniform(0, side_m) for side_m in EXTENT_M)), node=number)
             for number in range(n_pool + n_fresh)]
    paths = [os.path.join(folder, name) for name in ("room.scene.json", "room.plan.json", "room.nodes.csv")]
    for path, content in zip(paths, (scene, {"schema": "fieldtrue.plan/1", "nodes": nodes})):
        with open(path, "w", encoding="utf-8") as out:
            json.dump(content, out)
    run(cli, "simulate", "--scene", paths[0], "--plan", paths[1], "--seed", "3", "--nodes", paths[2])
    return rows_of(paths[2])


def drawn_table(rows, n_places, draw, misplacing, n_pool=POOL):
    """Rows of some places of the pool, each stated where the rig would say that it stands."""
    some = [dict(row) for row in draw.sample(rows[:n_pool], n_places)]
    for row in some:
        for axis, slip_m in zip("xyz", misplacing.draw_m(draw)):
            row[f"{axis}_true_m"] = repr(float(row[f"{axis}_true_m"]) + slip_m)
    return some


def fresh_errors_m(cli, table, method, fresh, folder):
    """[(what the correction that a fit to the whole table is leaves, whether it covers the place)]: against exact positions."""
    calibration, corrected = os.path.join(folder, "a.ftcal.json"), os.path.join(folder, "corrected.csv")
    run(cli, "fit", "--nodes", table, "--position", method, "--out", calibration)
    run(cli, "apply", "--calibration", calibration, "--in", fresh, "--out", corrected, "--force")
    columns = [f"{axis}_{kind}_m" for kind in ("corrected", "true") for axis in "xyz"] + ["covered"]
    return [([row[axis] - row[3 + axis] for axis in range(3)], row[6] == 1) for row in columns_of(corrected, columns)]


def fresh_mean_square_m2(cli, table, method, fresh, folder):
    square_m2 = [math.fsum(axis_m**2 for axis_m in error_m) for error_m, _ in fresh_errors_m(cli, table, method, fresh, folder)]
    return math.fsum(square_m2) / len(square_m2)


def judged_table(cli, table, methods, truths_mm):
    """What `compare` says of a table, beside the truths that its intervals should hold.

    truths_mm: method -> RMS of its correction at fresh places
    """
    judged = json.loads(run(cli, "compare", "--nodes", table, "--methods", ",".join(methods), "--json"))
    assert judged["validate"] == ("kfold:10" if methods is TUNED else "loo")
    scores = {method: {"truth": truths_mm(method), "is_best": score["method"] == judged["best"]["position"],
                       **{end: score["position_mm"][f"rms_{end}90"] for end in ("low", "high")},
                       "place_mm": score["place_mm"]}
              for method, score in zip(methods, judged["position"]) if not score["skipped"]}
    return {"scores": scores, "gain": {end: judged["verdict"][f"gain_{end}90"] for end in ("low", "high")}}


class Cell(typing.NamedTuple):
    """Tables of one room, placing and size."""

    cli: str
    rooms: str
    room: str
    heavy: bool
    n_places: int
    n_tables: int
    tuned: bool
    keep: str
    again: bool

    def placing(self):
        return "gross slips" if self.heavy else "calm"

    def name(self):
        return f"{self.n_places} {self.room} {self.placing()}{' tuned' if self.tuned else ''}".replace(" ", "_")


def kept_tables(path):
    """Whole lines of a file, as what they hold."""
    if not os.path.exists(path):
        return []
    with open(path, encoding="utf-8") as text:
        return [json.loads(line) for line in text if line.endswith("\n")]


def tables_of(cell):
    """[what judged_table returned], from what is kept as far as that goes; nothing that is kept is lost."""
    path = os.path.join(cell.keep, f"{cell.name()}.jsonl")
    growing = path + ".again" if cell.again else path
    kept, tables = kept_tables(path), kept_tables(growing)
    if len(tables) < cell.n_tables:
        with open(growing + ".new", "w", encoding="utf-8") as out:
            out.writelines(json.dumps(table) + "\n" for table in tables)
        os.replace(growing + ".new", growing)
        with tempfile.TemporaryDirectory() as folder, open(growing, "a", encoding="utf-8") as out:
            n_pool = max(POOL, POOL_A_PLACE * cell.n_places)
            head, rows = record(cell.cli, cell.rooms, cell.room, folder,
                                max(FEWEST_FRESH, FRESH_A_PLACE * cell.n_places), n_pool)
            rows = [{name: text for name, text in row.items() if name in COLUMNS} for row in rows]
            fresh, table = os.path.join(folder, "fresh.csv"), os.path.join(folder, "table.nodes.csv")
            write(fresh, head, rows[n_pool:])
            misplacing = Misplacing(cell.heavy)

            def truth_mm(method, number):
                known = kept[number]["scores"].get(method) if number < len(kept) else None
                if known:
                    return known["truth"]
                square_m2 = fresh_mean_square_m2(cell.cli, table, method, fresh, folder)
                return 1000 * math.sqrt(square_m2 + misplacing.mean_square_m2())

            for number in range(len(tables), cell.n_tables):
                draw = random.Random(f"{cell.name()} {number}")
                write(table, head, drawn_table(rows, cell.n_places, draw, misplacing, n_pool))
                tables.append(judged_table(cell.cli, table, TUNED if cell.tuned else UNTUNED,
                                           functools.partial(truth_mm, number=number)))
                out.write(json.dumps(tables[-1]) + "\n")
                out.flush()
    if cell.again and len(tables) >= len(kept):
        os.replace(growing, path)
    return cell, tables[:cell.n_tables]


def holding(tables):
    """{(figure, method): [whether each table's interval held the truth]}"""
    held = {}
    for table in tables:
        truth_mm = {method: score["truth"] for method, score in table["scores"].items()}
        for method, score in table["scores"].items():
            held.setdefault(("RMS", method), []).append(score["low"] <= truth_mm[method] <= score["high"])
            if score["is_best"]:
                gain = 1 - truth_mm[method] / truth_mm["none"]
                held.setdefault(("gain", "best"), []).append(table["gain"]["low"] <= gain <= table["gain"]["high"])
    return held


def parser_of(description, tables, places, rooms=ALL_ROOMS):
    """The words that every study on the rooms takes, with its own defaults."""
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("cli")
    parser.add_argument("rooms_folder")
    parser.add_argument("--tables", type=int, default=tables)
    parser.add_argument("--places", default=places)
    parser.add_argument("--rooms", default=rooms)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    return parser


def cells_of(given, keep):
    return [Cell(given.cli, given.rooms_folder, room, heavy, n_places, given.tables, tuned, keep, given.again)
            for n_places in map(int, given.places.split(",")) for tuned in ((False, True) if n_places == 60 else (False,))
            for room in given.rooms.split(",") for heavy in (False, True)]


def main():
    parser = parser_of(__doc__, 400, "30,60,120,567", "steel_floor,mixed")
    parser.add_argument("--keep", help="folder of a line a table; a run that was ended goes on from there")
    parser.add_argument("--again", action="store_true",
                        help="judge kept tables anew: the intervals have changed, the fits have not")
    given = parser.parse_args()
    shares = {}
    print("| places | room | placing | figure | tables | intervals that hold the truth |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as unkept, multiprocessing.Pool(given.processes) as pool:
        os.makedirs(given.keep or unkept, exist_ok=True)
        for cell, tables in pool.imap(tables_of, cells_of(given, given.keep or unkept), chunksize=1):
            for (figure, method), hits in holding(tables).items():
                share = sum(hits) / len(hits)
                shares.setdefault((figure, cell.n_places, "tuned" if cell.tuned else "untuned"), []).append(share)
                print(f"| {cell.n_places} | {cell.room} | {cell.placing()} | {figure} of {method} | {len(hits)} | {share:.3f} |",
                      flush=True)
    print("\n| figure, places, methods | cells | mean | least | largest |\n|---|---|---|---|---|")
    for (figure, n_places, kind), values in shares.items():
        print(f"| {figure}, {n_places} places, {kind} | {len(values)} | {sum(values) / len(values):.3f} | {min(values):.3f} | "
              f"{max(values):.3f} |")


if __name__ == "__main__":
    sys.exit(main())
