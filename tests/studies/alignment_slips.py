#!/usr/bin/env python3
"""What slips of the jig leave of the alignment, and whether a second writing of its law finds the same motion.

alignment_slips.py FIELDTRUE-CLI ROOMS-FOLDER [--tables N] [--places 40,60,120,240] [--rooms clean,...] [--processes N]

Tables are drawn from rooms as in interval_coverage.py, calm and with gross slips. The rigid motion from tracked to stated
positions is found on numpy by least squares (Umeyama 1991) and by Student's t law of four degrees of freedom (weights of Lange,
Little and Taylor 1989, at most 1, the scale from the median), for all rows, without any look for a field. Printed, a cell a
line, at 3,000 places that no table holds: the RMS of least squares, of the t law and of `fit --position none`, as geometric
means over the tables, the least and largest of none over least squares, and in how many tables `none` is neither to 1 % the one
nor the other.
"""
import math
import multiprocessing
import os
import random
import sys
import tempfile

import numpy

from interval_coverage import Misplacing, POOL, drawn_table, fresh_mean_square_m2, parser_of, record, write

FREEDOM = 4
MEDIAN_OF_CHI_SQUARE_3 = 2.366


def positions_m(rows, names):
    return numpy.array([[float(row[name]) for name in names] for row in rows])


def pairs_m(rows):
    """(tracked, stated)"""
    return positions_m(rows, ("x_m", "y_m", "z_m")), positions_m(rows, ("x_true_m", "y_true_m", "z_true_m"))


def motion(from_m, to_m, weights):
    share = weights / weights.sum()
    from_center_m, to_center_m = share @ from_m, share @ to_m
    u, _, v = numpy.linalg.svd((share[:, None] * (to_m - to_center_m)).T @ (from_m - from_center_m))
    turn = u @ numpy.diag([1, 1, numpy.sign(numpy.linalg.det(u @ v))]) @ v
    return turn, to_center_m - turn @ from_center_m


def squares_m2(moved, from_m, to_m):
    turn, shift_m = moved
    return ((from_m @ turn.T + shift_m - to_m) ** 2).sum(axis=1)


def by_t_law(from_m, to_m):
    moved = motion(from_m, to_m, numpy.ones(len(from_m)))
    for _ in range(10):
        square_m2 = squares_m2(moved, from_m, to_m)
        in_variances = square_m2 / (numpy.median(square_m2) / MEDIAN_OF_CHI_SQUARE_3)
        moved = motion(from_m, to_m, numpy.minimum(1, (FREEDOM + 3) / (FREEDOM + in_variances)))
    return moved


def cell(job):
    cli, rooms, room, heavy, n_places, n_tables = job
    found_mm = []
    with tempfile.TemporaryDirectory() as folder:
        head, rows = record(cli, rooms, room, folder)
        fresh, table = os.path.join(folder, "fresh.csv"), os.path.join(folder, "table.nodes.csv")
        write(fresh, head, rows[POOL:])
        draw, misplacing = random.Random(f"slips {room} {heavy} {n_places}"), Misplacing(heavy)
        for _ in range(n_tables):
            drawn = drawn_table(rows, n_places, draw, misplacing)
            write(table, head, drawn)
            from_m, to_m = pairs_m(drawn)
            motions = motion(from_m, to_m, numpy.ones(n_places)), by_t_law(from_m, to_m)
            mean_m2 = [squares_m2(moved, *pairs_m(rows[POOL:])).mean() for moved in motions]
            mean_m2.append(fresh_mean_square_m2(cli, table, "none", fresh, folder))
            found_mm.append([1000 * math.sqrt(mean) for mean in mean_m2])
    return room, heavy, n_places, numpy.array(found_mm)


def main():
    given = parser_of(__doc__, 32, "40,60,120,240").parse_args()
    jobs = [(given.cli, given.rooms_folder, room, heavy, n_places, given.tables)
            for room in given.rooms.split(",") for heavy in (False, True) for n_places in map(int, given.places.split(","))]
    print("| room | placing | places | least squares, mm | t law, mm | none, mm | none / least squares | least | largest | neither |\n"
          "|---|---|---|---|---|---|---|---|---|---|")
    with multiprocessing.Pool(given.processes) as pool:
        for room, heavy, n_places, found_mm in pool.imap(cell, jobs):
            plain_mm, law_mm, none_mm = numpy.exp(numpy.log(found_mm).mean(axis=0))
            share = found_mm[:, 2] / found_mm[:, 0]
            neither = (abs(share - 1) > 0.01) & (abs(found_mm[:, 2] / found_mm[:, 1] - 1) > 0.01)
            print(f"| {room} | {'gross slips' if heavy else 'calm'} | {n_places} | {plain_mm:.3g} | {law_mm:.3g} | {none_mm:.3g} | "
                  f"{none_mm / plain_mm:.2f} | {share.min():.2f} | {share.max():.2f} | {neither.sum()} |", flush=True)


if __name__ == "__main__":
    sys.exit(main())
