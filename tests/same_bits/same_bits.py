"""Runs two builds over the same inputs and compares what they write. See ../same_bits.sh."""
import argparse
import json
import os
import subprocess
import sys
import tempfile
import threading
import time

import compare
import inputs

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
LIMIT_S = 300


class Build:
    """The programs of one build, and the folder that they work in."""

    def __init__(self, folder, work):
        self.folder = os.path.abspath(folder)
        self.work = work
        self.times = []
        self.failed = []
        os.makedirs(work)

    def program(self, name):
        return os.path.join(self.folder, "app", name)

    def asked(self, *words):
        """What fieldtrue-cli says to that: (standard output, standard error)."""
        run = subprocess.run([self.program("fieldtrue-cli"), *words], capture_output=True, text=True, timeout=LIMIT_S,
                             stdin=subprocess.DEVNULL, check=False)
        return run.stdout, run.stderr

    def run(self, step):
        """Runs one step and writes what it printed and how it ended."""
        command = [self.program(step.program), *step.words]
        try:
            done = subprocess.run(command, cwd=self.work, capture_output=True, timeout=LIMIT_S, check=False,
                                  stdin=subprocess.DEVNULL, env={**os.environ, **inputs.ENVIRONMENT})
            out, err, status = done.stdout, done.stderr, done.returncode
        except subprocess.TimeoutExpired:
            out, err, status = b"", b"", f"none: it was ended after {LIMIT_S} s"
        for here, name in ((self.work, "FOLDER"), (self.folder, "BUILD")):
            out, err = out.replace(here.encode(), name.encode()), err.replace(here.encode(), name.encode())
        if step.last_line_only:
            out, err = b"".join(out.splitlines(keepends=True)[-1:]), b""
        self.write(step.name + (".json" if "--json" in step.words else ".txt"), out)
        self.write(step.name + ".err", err + f"status {status}\n".encode())
        if status != 0 and not step.name.startswith("refused"):
            self.failed.append(f"{step.name}, which ended with status {status}: {err.decode(errors='replace').strip()}")

    def write(self, name, data):
        with open(os.path.join(self.work, name), "wb") as file:
            file.write(data)

    def run_all(self, steps):
        for step in steps:
            began = time.monotonic()
            try:
                if step.before:
                    step.before(self)
                if step.program:
                    self.run(step)
            except (OSError, KeyError, IndexError, ValueError, subprocess.SubprocessError) as problem:
                self.write(step.name + ".err", f"{type(problem).__name__}\n".encode())
                self.failed.append(f"{step.name}, which was not possible: {problem}")
            self.times.append((time.monotonic() - began, step.name))


def side_by_side(builds, steps):
    workers = [threading.Thread(target=build.run_all, args=(steps,)) for build in builds]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()


def tell_differences(found, most=300):
    for file, where, old, new in found[:most]:
        print(f"{file}, {where}:")
        for sign, text in (("-", old), ("+", new)):
            if text is not None:
                print(f"  {sign} {text}")
    if len(found) > most:
        print(f"... and {len(found) - most} more")


def tell_changes(found, others):
    print("Largest relative change of each number:")
    for path, (change, old, new, file) in sorted(found.numbers.items(), key=lambda one: -one[1][0]):
        print(f"  {change:9.2e}  {path}  {old!r} -> {new!r}  ({file})")
    print(f"Texts that changed: {len(found.texts)}")
    for path, file, old, new in sorted(found.texts, key=lambda one: (not names_a_result(one[0]), one[0], one[1])):
        print(f"  {path}  ({file})\n    - {old}\n    + {new}")
    print(f"Other files that differ: {len(others)}" + "".join(f"\n  {name}" for name in others))


def names_a_result(path):
    """Whether a text is a verdict, the best method or the name of an effect."""
    return any(part in path for part in ("verdict", ".best", "selected", "candidates"))


def main():
    parser = argparse.ArgumentParser(prog="same_bits.sh", description="Compares all that two builds write, to the bit.")
    parser.add_argument("old", metavar="OLD_BUILD")
    parser.add_argument("new", metavar="NEW_BUILD")
    parser.add_argument("--largest-change", action="store_true", help="how much each number changed, instead")
    parser.add_argument("--keep", metavar="FOLDER", help="keep what the programs wrote here")
    parser.add_argument("--only", metavar="PART", action="append", help="only this part: " + ", ".join(inputs.PARTS))
    parser.add_argument("--times", action="store_true", help="also tell which steps took longest")
    given = parser.parse_args()
    for build in (given.old, given.new):
        if not os.access(os.path.join(build, "app", "fieldtrue-cli"), os.X_OK):
            parser.error(f"{build}/app/fieldtrue-cli is not built")
    with tempfile.TemporaryDirectory() as scratch:
        return compared(given, os.path.abspath(given.keep) if given.keep else scratch)


def compared(given, folder):
    began = time.monotonic()
    builds = [Build(given.old, os.path.join(folder, "old")), Build(given.new, os.path.join(folder, "new"))]
    steps, not_covered = inputs.steps(builds[0], ROOT, os.environ.get("FIELDTRUE_REAL_DATA", ""), given.only)
    side_by_side(builds, steps)
    same_software = len({build.asked("--version") for build in builds}) == 1
    folders = [build.work for build in builds]
    if given.times:
        print("\n".join(f"  {seconds:6.1f} s  {name}" for seconds, name in sorted(builds[0].times, reverse=True)[:40]))
    for text in not_covered + builds[0].failed:
        print(f"Not covered: {text}")
    if given.largest_change:
        found, others = compare.changes(*folders)
        tell_changes(found, others)
        print(f"{len(found.numbers)} numbers and {len(found.texts)} texts changed, {len(steps)} steps, "
              f"{time.monotonic() - began:.0f} s")
        return 1 if found.texts else 0
    found, n_files = compare.differences(*folders, same_software)
    tell_differences(found)
    print(f"{len(found) or 'No'} differences in {len({one[0] for one in found})} of {n_files} files, {len(steps)} steps, "
          f"{time.monotonic() - began:.0f} s")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
