#!/usr/bin/env python3
"""What the scene behind a recording is worth to its correction: `physics_residual` against `gaussian_process`.

physics_gain.py FIELDTRUE-CLI ROOMS-FOLDER [TABLE.nodes.csv ...] [--tables N] [--places 60] [--processes N]

In every room tables are drawn as in interval_coverage.py; both methods are fitted to each and applied to 3,000 places that the
table does not hold. Of a table given the places are dealt to ten folds as in orientation_gain.py. All figures are this
script's own. Printed: the RMS of both and their ratio, of a real table with its paired 90 % interval (bootstrap over places).
"""
import argparse
import math
import multiprocessing
import os
import random
import sys
import tempfile

from interval_coverage import Misplacing, POOL, drawn_table, fresh_mean_square_m2, record, write
from orientation_gain import Program, Table, paired_interval, rms_of, squares_by_place

ROOMS = ("clean", "steel_floor", "steel_bar", "two_bodies", "copper_loop", "mixed")
METHODS = ("gaussian_process", "physics_residual")


def in_room(job):
    """[(RMS of the process, RMS with physics) of each table], mm on fresh places."""
    cli, rooms, room, n_places, n_tables = job
    both = []
    with tempfile.TemporaryDirectory() as folder:
        head, rows = record(cli, rooms, room, folder)
        fresh, table = os.path.join(folder, "fresh.csv"), os.path.join(folder, "table.nodes.csv")
        write(fresh, head, rows[POOL:])
        draw, misplacing = random.Random(f"physics {room} {n_places}"), Misplacing(False)
        for _ in range(n_tables):
            write(table, head, drawn_table(rows, n_places, draw, misplacing))
            both.append([1e3 * math.sqrt(fresh_mean_square_m2(cli, table, method, fresh, folder)) for method in METHODS])
    return room, both


def of_table(job):
    """RMS of both over places of a table, and the interval of the ratio."""
    cli, path = job
    with tempfile.TemporaryDirectory() as folder:
        program, table = Program(cli, folder), Table(path)
        squares = [squares_by_place(program, table, ("--position", method)) for method in METHODS]
    low, high = paired_interval(*squares)
    return os.path.basename(path), len(squares[0]), rms_of(squares[0]), rms_of(squares[1]), 1 + low, 1 + high


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cli")
    parser.add_argument("rooms_folder")
    parser.add_argument("recordings", nargs="*")
    parser.add_argument("--tables", type=int, default=4)
    parser.add_argument("--places", type=int, default=60)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    given = parser.parse_args()
    with multiprocessing.Pool(given.processes) as pool:
        print("| room | `gaussian_process`, mm | `physics_residual`, mm | ratio of each table | ratio of means |\n|---|---|---|---|---|")
        for room, both in pool.imap(in_room, [(given.cli, given.rooms_folder, room, given.places, given.tables) for room in ROOMS]):
            alone, with_physics = (math.sqrt(sum(pair[k] ** 2 for pair in both) / len(both)) for k in (0, 1))
            print(f"| {room} | {alone:.3g} | {with_physics:.3g} | {', '.join(f'{b / a:.2f}' for a, b in both)} | "
                  f"{with_physics / alone:.2f} |", flush=True)
        print("\n| recording | places | `gaussian_process`, mm | `physics_residual`, mm | ratio, 90 % |\n|---|---|---|---|---|")
        for name, n, alone, with_physics, low, high in pool.imap(of_table, [(given.cli, path) for path in given.recordings]):
            print(f"| {name} | {n} | {alone:.3g} | {with_physics:.3g} | {with_physics / alone:.2f} ({low:.2f} to {high:.2f}) |", flush=True)


if __name__ == "__main__":
    sys.exit(main())
