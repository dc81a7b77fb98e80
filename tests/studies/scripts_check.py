#!/usr/bin/env python3
"""Whether the studies that draw tables from the rooms still run: each once, on a table or two.

scripts_check.py FIELDTRUE-CLI ROOMS-FOLDER

They share helpers, take hours at full size, and are called by nothing else. What they print must be the rows promised, with
finite numbers in them; what the numbers are is the studies' business.
"""
import math
import os
import re
import subprocess
import sys
import tempfile

SMALL = ("--tables", "1", "--processes", "2")
ONE_ROOM = ("--rooms", "clean")
# Script, its arguments, and how many rows of its table hold figures.
RUNS = [("interval_coverage.py", ("--places", "30", *ONE_ROOM), 12),
        ("uncertainty_coverage.py", ("--places", "60", "--methods", "gaussian_process", *ONE_ROOM), 2),
        ("multiquadric_spread.py", ("--places", "30", *ONE_ROOM), 2),
        ("automatic_choice.py", ("--places", "40", *ONE_ROOM), 2),
        ("alignment_slips.py", ("--places", "40", *ONE_ROOM), 2),
        ("physics_gain.py", ("--places", "30"), 6)]


def rows_with_figures(text):
    """Rows of Markdown tables that end with a number, all of them finite."""
    rows = [line for line in text.splitlines() if line.startswith("|") and re.search(r"\| *-?\d[\d.]* *\|$", line)]
    return [row for row in rows if all(math.isfinite(float(number)) for number in re.findall(r"-?\d+\.\d+", row))]


def main():
    cli, rooms = sys.argv[1:3]
    failed = []
    here = os.path.dirname(os.path.abspath(__file__))
    for script, arguments, n_rows in RUNS:
        ended = subprocess.run([sys.executable, os.path.join(here, script), cli, rooms, *SMALL, *arguments], text=True,
                               capture_output=True, check=False)
        rows = rows_with_figures(ended.stdout)
        if ended.returncode != 0 or len(rows) < n_rows:
            failed.append(script)
            print(f"{script} ended with {ended.returncode}, {len(rows)} of {n_rows} rows\n{ended.stdout}\n{ended.stderr}")
    # What is kept is gone on from, and judged again by the same program is the same.
    with tempfile.TemporaryDirectory() as keep:
        coverage = [sys.executable, os.path.join(here, "interval_coverage.py"), cli, rooms, "--places", "30", *ONE_ROOM,
                    "--processes", "1", "--keep", keep]
        printed = [subprocess.run([*coverage, *more], text=True, capture_output=True, check=False).stdout
                   for more in (("--tables", "1"), ("--tables", "2"), ("--tables", "2", "--again"))]
        if not printed[0] or printed[1] != printed[2] or printed[0] == printed[1]:
            failed.append("interval_coverage.py --keep")
            print("\n\n".join(printed))
    return f"failed: {', '.join(failed)}" if failed else None


if __name__ == "__main__":
    sys.exit(main())
