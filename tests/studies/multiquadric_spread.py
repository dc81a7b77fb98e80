#!/usr/bin/env python3
"""How much a multiquadric varies with its places, what pairs of places left out tell of that, and what its interval holds.

multiquadric_spread.py FIELDTRUE-CLI ROOMS-FOLDER [--tables N] [--places 30,60,120,567] [--rooms a,b] [--processes N]

Readings come from rooms as in interval_coverage.py; everything else, Hardy's interpolation, its errors at places left
out, the jackknife over places and the interval, is written here once more, on numpy. A line a cell: SD over tables of the
logarithm of the mean square at fresh places and of that at places left out, their correlation, the SD that the jackknife
gives in the median table, and the share of tables whose 90 % interval holds the truth without it and with it.
"""
import math
import multiprocessing
import random
import tempfile

import numpy
from scipy.stats import t as student

from interval_coverage import COLUMNS, FRESH_A_PLACE, FEWEST_FRESH, Misplacing, POOL, POOL_A_PLACE, parser_of, record

R2_M2 = 0.01
NORMAL_POINT_95 = 1.645


def weights(points_m, centres_m):
    return numpy.sqrt(((points_m[:, None, :] - centres_m[None, :, :])**2).sum(2) + R2_M2)


def aligned(true_m, seen_m):
    """The rigid motion that takes true positions to the readings, as a function."""
    about_true, about_seen = true_m.mean(0), seen_m.mean(0)
    left, _, right = numpy.linalg.svd((seen_m - about_seen).T @ (true_m - about_true))
    rotation = left @ numpy.diag([1, 1, numpy.sign(numpy.linalg.det(left @ right))]) @ right
    return lambda points_m: (points_m - about_true) @ rotation.T + about_seen


class Table:
    """Of one table: squares left at places left out, the variance of their logarithm by the jackknife, and the truth."""

    def __init__(self, stated_m, seen_m, fresh_true_m, fresh_seen_m):
        move = aligned(stated_m, seen_m)
        inverse = numpy.linalg.inv(weights(seen_m, seen_m))
        alpha = inverse @ move(stated_m)
        diagonal = numpy.diag(inverse)
        self.squares = ((alpha / diagonal[:, None])**2).sum(1)
        both = diagonal[:, None] * diagonal[None, :] - inverse**2
        numpy.fill_diagonal(both, 1)
        without_both = sum(((diagonal[None, :] * alpha[:, [axis]] - inverse * alpha[:, axis][None, :]) / both)**2
                           for axis in range(3))
        numpy.fill_diagonal(without_both, self.squares)
        grown = without_both.sum(0) - self.squares.sum()
        self.own_variance = ((grown - grown.mean())**2).sum() / self.squares.sum()**2
        left = weights(fresh_seen_m, seen_m) @ alpha - move(fresh_true_m)
        self.truth = (left**2).sum(1).mean()

    def holds(self, misplaced, own_variance):
        """Whether the interval holds the truth, and what the jig adds to it."""
        n, mean = len(self.squares), self.squares.mean()
        spread = self.squares.std(ddof=1) / mean
        carrying, sd = n / (1 + spread**2), spread / math.sqrt(n)
        reach = student.ppf(0.95, max(1, carrying / 2)) * sd
        least = NORMAL_POINT_95 * math.sqrt(sd**2 + own_variance) if own_variance else 0
        off = math.log((self.truth + misplaced) / mean)
        return -max(reach, least) <= off <= max(reach * (1 + 1.2 / math.sqrt(carrying)), least)


def cell(job):
    """A line of the table."""
    cli, rooms, room, heavy, n_places, n_tables = job
    n_pool, n_fresh = max(POOL, POOL_A_PLACE * n_places), max(FEWEST_FRESH, FRESH_A_PLACE * n_places)
    with tempfile.TemporaryDirectory() as folder:
        _, rows = record(cli, rooms, room, folder, n_fresh, n_pool)
    places = numpy.array([[float(row[name]) for name in COLUMNS[1:]] for row in rows])
    fresh, misplacing = places[n_pool:], Misplacing(heavy)
    tables = []
    for number in range(n_tables):
        draw = random.Random(f"spread {room} {heavy} {n_places} {number}")
        some = places[draw.sample(range(n_pool), n_places)]
        stated = some[:, :3] + numpy.array([misplacing.draw_m(draw) for _ in range(n_places)])
        tables.append(Table(stated, some[:, 3:], fresh[:, :3], fresh[:, 3:]))
    misplaced = misplacing.mean_square_m2()
    truths = numpy.log([table.truth + misplaced for table in tables])
    seen = numpy.log([table.squares.mean() for table in tables])
    held = [[table.holds(misplaced, own * table.own_variance) for table in tables] for own in (0, 1)]
    told = math.sqrt(numpy.median([table.own_variance for table in tables]))
    alike = numpy.corrcoef(truths, seen)[0, 1] if n_tables > 1 else 0
    return (f"| {n_places} | {room} | {'gross slips' if heavy else 'calm'} | {n_tables} | {truths.std():.2f} | {seen.std():.2f} | "
            f"{alike:.2f} | {told:.2f} | {numpy.mean(held[0]):.3f} | {numpy.mean(held[1]):.3f} |")


def main():
    given = parser_of(__doc__, 200, "30,60,120,567", "steel_floor,mixed").parse_args()
    jobs = [(given.cli, given.rooms_folder, room, heavy, n_places, given.tables) for n_places in map(int, given.places.split(","))
            for room in given.rooms.split(",") for heavy in (False, True)]
    print("| places | room | placing | tables | SD of the truth | of places left out | correlation | by the jackknife | held without it "
          "| with it |\n|---|---|---|---|---|---|---|---|---|---|")
    with multiprocessing.Pool(given.processes) as pool:
        for line in pool.imap(cell, jobs):
            print(line, flush=True)


if __name__ == "__main__":
    main()
