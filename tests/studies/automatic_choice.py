#!/usr/bin/env python3
"""What the automatic choice costs against the best method in hindsight, on fresh places.

automatic_choice.py FIELDTRUE-CLI ROOMS-FOLDER [--tables N] [--places 40,60,120] [--rooms a,b,...] [--processes N]

Tables are drawn from rooms as in interval_coverage.py, calm and with gross slips. Every method, and `auto`, is fitted to the
whole table by `fit` and applied to 3,000 places that the table does not hold; the figures are this script's own. Printed, a
table a line: the RMS before, with `auto`, what it chose, and of the method that errs least there; then the median and the
largest of RMS(auto) / RMS(best), and how often `auto` is worse than no correction.
"""
import argparse
import json
import math
import multiprocessing
import os
import random
import statistics
import sys
import tempfile

from interval_coverage import Misplacing, POOL, drawn_table, fresh_mean_square_m2, record, write

METHODS = ("none", "affine", "polynomial:degree=2", "polynomial:degree=3", "polynomial:degree=4", "hmq", "rbf",
           "rbf:kernel=thin_plate", "bspline", "gaussian_process", "harmonic_field", "tetrahedral")


def cell(job):
    cli, rooms, room, heavy, n_places, n_tables = job
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        head, rows = record(cli, rooms, room, folder)
        fresh, table = os.path.join(folder, "fresh.csv"), os.path.join(folder, "table.nodes.csv")
        write(fresh, head, rows[POOL:])
        draw, misplacing = random.Random(f"auto {room} {heavy} {n_places}"), Misplacing(heavy)
        for _ in range(n_tables):
            write(table, head, drawn_table(rows, n_places, draw, misplacing))
            rms_mm = {}
            for method in METHODS + ("auto",):
                try:
                    rms_mm[method] = 1000 * math.sqrt(fresh_mean_square_m2(cli, table, method, fresh, folder))
                except RuntimeError:  # Too few places for it.
                    continue
            with open(os.path.join(folder, "a.ftcal.json"), encoding="utf-8") as text:
                chosen = json.load(text)["position"]["parameters"]["method"]
            best = min((method for method in rms_mm if method != "auto"), key=rms_mm.get)
            lines.append((n_places, room, heavy, rms_mm["none"], rms_mm["auto"], chosen, rms_mm[best], best))
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cli")
    parser.add_argument("rooms_folder")
    parser.add_argument("--tables", type=int, default=5)
    parser.add_argument("--places", default="40,60,120")
    parser.add_argument("--rooms", default="clean,steel_floor,steel_bar,two_bodies,copper_loop,mixed")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    given = parser.parse_args()
    jobs = [(given.cli, given.rooms_folder, room, heavy, n_places, given.tables) for n_places in map(int, given.places.split(","))
            for room in given.rooms.split(",") for heavy in (False, True)]
    ratios, worse = [], 0
    print("| places | room | placing | before, mm | auto, mm | chosen | best, mm | of | auto / best |\n"
          "|---|---|---|---|---|---|---|---|---|")
    with multiprocessing.Pool(given.processes) as pool:
        for lines in pool.imap(cell, jobs):
            for n_places, room, heavy, before, auto, chosen, least, best in lines:
                ratios.append(auto / least)
                worse += auto > 1.001 * before
                print(f"| {n_places} | {room} | {'gross slips' if heavy else 'calm'} | {before:.3g} | {auto:.3g} | {chosen} | "
                      f"{least:.3g} | {best} | {auto / least:.2f} |", flush=True)
    print(f"\n{len(ratios)} tables: median of auto / best {statistics.median(ratios):.3f}, largest {max(ratios):.2f}; "
          f"worse than no correction in {worse}")


if __name__ == "__main__":
    sys.exit(main())
