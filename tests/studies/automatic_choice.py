#!/usr/bin/env python3
"""What the automatic choice costs against the best method in hindsight, on fresh places.

automatic_choice.py FIELDTRUE-CLI ROOMS-FOLDER [--tables N] [--places 40,60,120] [--rooms a,b,...] [--processes N]
                    [--draw WORD,...]

Tables are drawn from rooms as in interval_coverage.py, calm and with gross slips, by each word others. Every method, and
`auto`, is fitted to the whole table by `fit` and applied to 3,000 places that the table does not hold; the figures are this
script's own. Printed, a table a line, of the places in the region that the calibration states: the RMS before, with `auto`,
what it chose, and of the method that errs least there, with RMS(auto) / RMS(best); the same ratio as whoever measures the fresh
places with the same jig would find it, the mean square of its misplacing in both (which is the RMS that `compare` states); the
first over the whole box, of which a few places scattered in it leave a part outside; and the first of whoever does not use
`auto`, but takes up as many places again as the table has, or five times as many, with the same jig, and keeps the method that
errs least there. Then median and largest of the ratios, and how often `auto` is worse than no correction. Last, a room, placing
and size a line: the RMS of `auto` over its tables against that of the one method that is best for all of them, which a lab
would have to know beforehand.
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

from interval_coverage import Misplacing, POOL, drawn_table, fresh_errors_m, parser_of, record, write

METHODS = ("none", "affine", "polynomial:degree=2", "polynomial:degree=3", "polynomial:degree=4", "hmq", "rbf",
           "rbf:kernel=thin_plate", "bspline", "gaussian_process", "harmonic_field", "tetrahedral")


TIMES_AS_MANY = (1, 5)


def rms_mm(square_m2):
    return 1000 * math.sqrt(math.fsum(square_m2) / len(square_m2)) if square_m2 else math.nan


def square(error_m):
    return math.fsum(axis_m**2 for axis_m in error_m)


class Table(typing.NamedTuple):
    """A table's methods by their RMS at fresh places, mm."""

    n_places: int
    room: str
    placing: str
    share: float  # Of the fresh places, in the stated region.
    chosen: str  # By auto.
    inside: dict
    everywhere: dict
    placing_mm: float
    by_new_places: tuple  # What asking some new places chooses.

    def best(self, rms):
        return min((method for method in rms if method != "auto"), key=rms.get)

    def ratios(self):
        """By what is asked, RMS over the least."""
        least, auto = self.inside[self.best(self.inside)], self.inside["auto"]
        return {"in the stated region": auto / least,
                "the same, as the jig measures": math.hypot(auto, self.placing_mm) / math.hypot(least, self.placing_mm),
                "everywhere": self.everywhere["auto"] / self.everywhere[self.best(self.everywhere)],
                **{f"chosen by {times} x as many new places": self.inside[method] / least
                   for times, method in zip(TIMES_AS_MANY, self.by_new_places)}}


def by_new_places(errors_m, in_region, n_new, misplacing, draw):
    """Of all methods that which errs least at some of the places in the region, as the jig states them."""
    places = [place for place, is_in in enumerate(in_region) if is_in]
    asked = draw.sample(places, min(n_new, len(places)))
    off_m = [misplacing.draw_m(draw) for _ in asked]
    return min(errors_m, key=lambda method: math.fsum(
        square([error_m - axis_m for error_m, axis_m in zip(errors_m[method][place], stated_m)])
        for place, stated_m in zip(asked, off_m)))


def cell(job):
    cli, rooms, word, room, heavy, n_places, n_tables = job
    tables = []
    with tempfile.TemporaryDirectory() as folder:
        head, rows = record(cli, rooms, room, folder)
        fresh, table = os.path.join(folder, "fresh.csv"), os.path.join(folder, "table.nodes.csv")
        write(fresh, head, rows[POOL:])
        draw, misplacing = random.Random(f"{word} {room} {heavy} {n_places}"), Misplacing(heavy)
        asking = random.Random(f"{word} {room} {heavy} {n_places} asked")
        for _ in range(n_tables):
            write(table, head, drawn_table(rows, n_places, draw, misplacing))
            errors_m = {}
            for method in METHODS + ("auto",):
                try:
                    errors = fresh_errors_m(cli, table, method, fresh, folder)
                except RuntimeError:  # Too few places for it.
                    continue
                errors_m[method] = [error_m for error_m, _ in errors]
                if method == "none":  # Which covers the stated region, whatever cells other methods are made of.
                    in_region = [covered for _, covered in errors]
            inside = {method: rms_mm([square(error_m) for error_m, is_in in zip(errors, in_region) if is_in])
                      for method, errors in errors_m.items()}
            everywhere = {method: rms_mm([square(error_m) for error_m in errors]) for method, errors in errors_m.items()}
            with open(os.path.join(folder, "a.ftcal.json"), encoding="utf-8") as text:
                chosen = json.load(text)["position"]["parameters"]["method"]
            fixed_m = {method: errors for method, errors in errors_m.items() if method != "auto"}
            tables.append(Table(n_places, room, "gross slips" if heavy else "calm", sum(in_region) / len(in_region), chosen,
                                inside, everywhere, 1000 * math.sqrt(misplacing.mean_square_m2()),
                                tuple(by_new_places(fixed_m, in_region, times * n_places, misplacing, asking)
                                      for times in TIMES_AS_MANY)))
    return tables


def print_cells(tables):
    print("\n| places | room | placing | auto, mm | best for all tables, mm | of | auto / best |\n|---|---|---|---|---|---|---|")
    over_all_mm = {}
    for key in dict.fromkeys((table.n_places, table.room, table.placing) for table in tables):
        of_cell = [table for table in tables if (table.n_places, table.room, table.placing) == key]
        common = set.intersection(*(set(table.inside) for table in of_cell))
        over_all_mm[key] = {method: math.sqrt(statistics.fmean(table.inside[method]**2 for table in of_cell))
                            for method in METHODS + ("auto",) if method in common}
    ratios = []
    for key, rms in over_all_mm.items():
        best = min((method for method in rms if method != "auto"), key=rms.get)
        ratios.append(rms["auto"] / rms[best])
        print(f"| {' | '.join(map(str, key))} | {rms['auto']:.3g} | {rms[best]:.3g} | {best} | {ratios[-1]:.2f} |")
    print(f"\nmedian of auto / best for all tables {statistics.median(ratios):.3f}, largest {max(ratios):.2f}")


def main():
    parser = parser_of(__doc__, 5, "40,60,120")
    parser.add_argument("--draw", default="auto")
    given = parser.parse_args()
    jobs = [(given.cli, given.rooms_folder, word, room, heavy, n_places, given.tables)
            for word in given.draw.split(",") for n_places in map(int, given.places.split(","))
            for room in given.rooms.split(",") for heavy in (False, True)]
    tables = []
    print("| places | room | placing | share in the region | before, mm | auto, mm | chosen | best, mm | of | auto / best | "
          "as measured | everywhere | by as many new places | by five times as many |\n" + "|---" * 14 + "|")
    with multiprocessing.Pool(given.processes) as pool:
        for of_cell in pool.imap(cell, jobs):
            for table in of_cell:
                best = table.best(table.inside)
                print(f"| {table.n_places} | {table.room} | {table.placing} | {table.share:.2f} | {table.inside['none']:.3g} | "
                      f"{table.inside['auto']:.3g} | {table.chosen} | {table.inside[best]:.3g} | {best} | "
                      f"{' | '.join(f'{ratio:.2f}' for ratio in table.ratios().values())} |", flush=True)
            tables += of_cell
    for what in tables[0].ratios():
        values = [table.ratios()[what] for table in tables]
        print(f"\n{what}, {len(values)} tables: median of RMS / best {statistics.median(values):.3f}, "
              f"largest {max(values):.2f}, above 1.15 in {sum(value > 1.15 for value in values)}")
    print(f"\nworse than no correction in {sum(table.inside['auto'] > 1.001 * table.inside['none'] for table in tables)}")
    print_cells(tables)


if __name__ == "__main__":
    sys.exit(main())
