#!/usr/bin/env python3
"""What the automatic choice costs against the best method in hindsight, on fresh places.

automatic_choice.py FIELDTRUE-CLI ROOMS-FOLDER [--tables N] [--places 40,60,120] [--rooms a,b,...] [--processes N]
                    [--draw WORD]

Tables are drawn from rooms as in interval_coverage.py, calm and with gross slips; another word draws others. Every method, and
`auto`, is fitted to the whole table by `fit` and applied to 3,000 places that the table does not hold; the figures are this
script's own. Printed, a table a line, of the places in the region that the calibration states: the RMS before, with `auto`,
what it chose, and of the method that errs least there, with RMS(auto) / RMS(best); the same ratio as whoever measures the fresh
places with the same jig would find it, the mean square of its misplacing in both (which is the RMS that `compare` states); and
the first over the whole box, of which a few places scattered in it leave a part outside. Then median and largest of the ratios,
and how often `auto` is worse than no correction.
"""
import json
import math
import multiprocessing
import os
import random
import statistics
import sys
import tempfile
import typing

from interval_coverage import Misplacing, POOL, drawn_table, fresh_squares_m2, parser_of, record, write

METHODS = ("none", "affine", "polynomial:degree=2", "polynomial:degree=3", "polynomial:degree=4", "hmq", "rbf",
           "rbf:kernel=thin_plate", "bspline", "gaussian_process", "harmonic_field", "tetrahedral")


def rms_mm(square_m2):
    return 1000 * math.sqrt(math.fsum(square_m2) / len(square_m2)) if square_m2 else math.nan


class AgainstBest(typing.NamedTuple):
    """RMS at fresh places, mm, and ratios of RMS(auto) to the least."""

    before: float
    auto: float
    least: float
    of: str
    ratio: float
    ratio_as_measured: float


def against_best(rms, misplacing):
    placing_mm = 1000 * math.sqrt(misplacing.mean_square_m2())
    best = min((method for method in rms if method != "auto"), key=rms.get)
    auto, least = rms["auto"], rms[best]
    measured = math.hypot(auto, placing_mm) / math.hypot(least, placing_mm)
    return AgainstBest(rms["none"], auto, least, best, auto / least, measured)


def cell(job):
    cli, rooms, word, room, heavy, n_places, n_tables = job
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        head, rows = record(cli, rooms, room, folder)
        fresh, table = os.path.join(folder, "fresh.csv"), os.path.join(folder, "table.nodes.csv")
        write(fresh, head, rows[POOL:])
        draw, misplacing = random.Random(f"{word} {room} {heavy} {n_places}"), Misplacing(heavy)
        for _ in range(n_tables):
            write(table, head, drawn_table(rows, n_places, draw, misplacing))
            inside, everywhere = {}, {}
            for method in METHODS + ("auto",):
                try:
                    squares = fresh_squares_m2(cli, table, method, fresh, folder)
                except RuntimeError:  # Too few places for it.
                    continue
                if method == "none":  # Which covers the stated region, whatever cells other methods are made of.
                    in_region = [covered for _, covered in squares]
                inside[method] = rms_mm([square for (square, _), covered in zip(squares, in_region) if covered])
                everywhere[method] = rms_mm([square for square, _ in squares])
            with open(os.path.join(folder, "a.ftcal.json"), encoding="utf-8") as text:
                chosen = json.load(text)["position"]["parameters"]["method"]
            lines.append((n_places, room, heavy, sum(in_region) / len(in_region), chosen, against_best(inside, misplacing),
                          against_best(everywhere, misplacing)))
    return lines


def main():
    parser = parser_of(__doc__, 5, "40,60,120")
    parser.add_argument("--draw", default="auto")
    given = parser.parse_args()
    jobs = [(given.cli, given.rooms_folder, given.draw, room, heavy, n_places, given.tables)
            for n_places in map(int, given.places.split(",")) for room in given.rooms.split(",") for heavy in (False, True)]
    ratios = {"in the stated region": [], "the same, as the jig measures": [], "everywhere": []}
    worse = 0
    print("| places | room | placing | share in the region | before, mm | auto, mm | chosen | best, mm | of | auto / best | "
          "as measured | everywhere |\n|---|---|---|---|---|---|---|---|---|---|---|---|")
    with multiprocessing.Pool(given.processes) as pool:
        for lines in pool.imap(cell, jobs):
            for n_places, room, heavy, share, chosen, inside, everywhere in lines:
                of_table = (inside.ratio, inside.ratio_as_measured, everywhere.ratio)
                for values, value in zip(ratios.values(), of_table):
                    values.append(value)
                worse += inside.auto > 1.001 * inside.before
                print(f"| {n_places} | {room} | {'gross slips' if heavy else 'calm'} | {share:.2f} | {inside.before:.3g} | "
                      f"{inside.auto:.3g} | {chosen} | {inside.least:.3g} | {inside.of} | "
                      f"{' | '.join(f'{value:.2f}' for value in of_table)} |", flush=True)
    for where, values in ratios.items():
        print(f"\n{where}, {len(values)} tables: median of auto / best {statistics.median(values):.3f}, "
              f"largest {max(values):.2f}, above 1.15 in {sum(value > 1.15 for value in values)}")
    print(f"worse than no correction in {worse}")


if __name__ == "__main__":
    sys.exit(main())
