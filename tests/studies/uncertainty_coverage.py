#!/usr/bin/env python3
"""Whether the uncertainty that a correction states of its positions is what its errors are.

uncertainty_coverage.py FIELDTRUE-CLI ROOMS-FOLDER [--tables N] [--places 60,120] [--rooms a,b] [--methods m,n] [--processes N]

Tables are drawn from rooms as in interval_coverage.py, calm and with gross slips; the jig's 2 mm are stated. Each method is
fitted to a table by `fit` and applied to 3,000 places that no table holds. `uncertainty_m` is the root of the sum of the
variances of the three axes, so were they alike and Gaussian nine errors in ten would be below 1.4436 times it (chi-square
of three). Printed, by room and method: the share of errors below that (aim 0.85 to 0.95), of those inside the middle half of the box
along each axis and of the others apart, and the RMS of what is stated over that of the errors.
"""
import math
import multiprocessing
import os
import random
import sys
import tempfile

from interval_coverage import EXTENT_M, Misplacing, POOL, drawn_table, parser_of, record, rows_of, run, write

NINE_IN_TEN = math.sqrt(6.2514 / 3)  # Quantile of chi-square of three over three.


def errors_and_sds(cli, table, method, fresh, folder):
    """[(error, SD, whether well inside)] at fresh places, metres."""
    calibration, corrected = os.path.join(folder, "a.ftcal.json"), os.path.join(folder, "corrected.csv")
    run(cli, "fit", "--nodes", table, "--position", method, "--out", calibration)
    run(cli, "apply", "--calibration", calibration, "--in", fresh, "--out", corrected, "--force")
    pairs = []
    for row in rows_of(corrected)[1]:
        if not row["uncertainty_m"]:
            continue
        true_m = [float(row[f"{axis}_true_m"]) for axis in "xyz"]
        error_m = math.dist(true_m, [float(row[f"{axis}_corrected_m"]) for axis in "xyz"])
        inside = all(0.25 * side_m <= x_m <= 0.75 * side_m for x_m, side_m in zip(true_m, EXTENT_M))
        pairs.append((error_m, float(row["uncertainty_m"]), inside))
    return pairs


def cell(job):
    cli, rooms, room, heavy, n_places, n_tables, methods = job
    pairs = {method: [] for method in methods}
    with tempfile.TemporaryDirectory() as folder:
        head, rows = record(cli, rooms, room, folder)
        head = [line for line in head if "jig_tolerance_m" not in line] + ["# jig_tolerance_m: 0.002"]
        fresh, table = os.path.join(folder, "fresh.csv"), os.path.join(folder, "table.nodes.csv")
        write(fresh, head, rows[POOL:])
        draw, misplacing = random.Random(f"uncertainty {room} {heavy} {n_places}"), Misplacing(heavy)
        for _ in range(n_tables):
            write(table, head, drawn_table(rows, n_places, draw, misplacing))
            for method in methods:
                pairs[method] += errors_and_sds(cli, table, method, fresh, folder)
    return job, pairs


def share(pairs):
    return sum(error_m <= NINE_IN_TEN * sd_m for error_m, sd_m, _ in pairs) / len(pairs) if pairs else math.nan


def rms_mm(values_m):
    return 1000 * math.sqrt(sum(value_m**2 for value_m in values_m) / len(values_m))


def main():
    parser = parser_of(__doc__, 4, "60,120")
    parser.add_argument("--methods", default="gaussian_process,harmonic_field")
    given = parser.parse_args()
    jobs = [(given.cli, given.rooms_folder, room, heavy, n_places, given.tables, given.methods.split(","))
            for n_places in map(int, given.places.split(",")) for room in given.rooms.split(",") for heavy in (False, True)]
    print("| places | room | placing | method | errors, RMS mm | stated / errors | below the 90 % | well inside | outer |\n"
          "|---|---|---|---|---|---|---|---|---|")
    with multiprocessing.Pool(given.processes) as pool:
        for (_, _, room, heavy, n_places, _, _), by_method in pool.imap(cell, jobs):
            for method, pairs in by_method.items():
                if not pairs:
                    continue
                error_mm = rms_mm([error_m for error_m, _, _ in pairs])
                ratio = rms_mm([sd_m for _, sd_m, _ in pairs]) / error_mm
                inner, outer = ([pair for pair in pairs if pair[2] == is_inside] for is_inside in (True, False))
                print(f"| {n_places} | {room} | {'gross slips' if heavy else 'calm'} | {method} | {error_mm:.3g} | {ratio:.2f} | "
                      f"{share(pairs):.2f} | {share(inner):.2f} | {share(outer):.2f} |", flush=True)


if __name__ == "__main__":
    sys.exit(main())
