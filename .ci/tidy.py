#!/usr/bin/env python3
"""clang-tidy over files as the `tidy` preset compiles them; any warning is an error.

tidy.py [--seconds N] [--done FOLDER] [--no-analyzer] [--together N] FILE... | --all

A header stands for the .cpp beside it. Files are looked at several together, as one text, so that the headers they share are
read once; files that cannot stand in one text (two meanings of a name), or of which anything is found, are looked at in halves
down to one. After --seconds nothing more is started, and what was left out is told. With --done, a file that was clean leaves
a mark in FOLDER and is not looked at again.
"""
import argparse
import bisect
import concurrent.futures
import itertools
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
BUILD = os.path.join(ROOT, "build", "tidy")
GNU_ONLY = {os.path.join("tests", "exporters", "itk_points.cpp")}  # Debian's headers of ITK refuse every other compiler.


def prepared():
    """Configures, and tells the files that are compiled: {file: command}."""
    # Each time: of a file that came since the last, an older list of commands knows nothing.
    subprocess.run(["cmake", "--preset", "tidy"], cwd=ROOT, stdout=subprocess.DEVNULL, check=True)
    with open(os.path.join(BUILD, "compile_commands.json"), encoding="utf-8") as commands:
        files = {os.path.relpath(one["file"], ROOT): one["command"] for one in json.load(commands)}
    return {file: files[file] for file in files if file.endswith(".cpp") and not file.startswith(("build", ".."))
            and file not in GNU_ONLY}


def stand_in_for_moc(file, command):
    """What moc would write is needed by the linker only, so an empty file stands for it."""
    folder = re.search(r"(\S+_autogen/include)\b", command)
    with open(os.path.join(ROOT, file), encoding="utf-8") as source:
        for name in re.findall(r'#include "(\w+\.moc)"', source.read()):
            path = folder.group(1).removeprefix("-I")
            os.makedirs(path, exist_ok=True)
            open(os.path.join(path, name), "a", encoding="utf-8").close()


def wanted(given, compiled):
    """The files that are compiled among those given, headers by the file beside them, in the order given."""
    files = [os.path.splitext(file)[0] + ".cpp" if file.endswith(".h") else file for file in given]
    return [file for file in dict.fromkeys(files) if file in compiled]


def flags(command):
    """What decides how a file is compiled: its command without the compiler, its own name and what is written."""
    words = iter(shlex.split(command)[1:])
    kept = []
    for word in words:
        if word in ("-o", "-c", "-MF", "-MT"):
            next(words)
        elif word not in ("-MD",):
            kept += [word, next(words)] if word == "-isystem" else [word]
    return kept


def joined_flags(commands):
    """The flags of all, each once, in the order of their first place."""
    pairs = []
    for command in commands:
        words = iter(flags(command))
        pairs += [(word, next(words)) if word == "-isystem" else (word,) for word in words]
    return [word for pair in dict.fromkeys(pairs) for word in pair]


class Unit:
    """Files as one text, which knows the place in its file of each of its lines."""

    def __init__(self, files, compiled):
        self.files, self.starts, lines = files, [], []
        for file in files:
            self.starts.append(len(lines))
            with open(os.path.join(ROOT, file), encoding="utf-8") as source:
                lines += source.read().split("\n")
        handle, self.path = tempfile.mkstemp(suffix=".cpp", dir=BUILD)
        with os.fdopen(handle, "w", encoding="utf-8") as text:
            text.write("\n".join(lines))
        # The text stands in another folder than the files.
        beside = [f"-iquote{os.path.join(ROOT, os.path.dirname(file))}" for file in files]
        self.flags = joined_flags(compiled[file] for file in files) + list(dict.fromkeys(beside))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.unlink(self.path)

    def run(self, *command):
        """(status, output) of a program, places in the text told as places in the files."""
        ended = subprocess.run(command, cwd=ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)
        return ended.returncode, re.sub(re.escape(self.path) + r":(\d+):", self.place, ended.stdout or ended.stderr)

    def place(self, match):
        index = bisect.bisect_right(self.starts, int(match[1]) - 1) - 1
        return f"{self.files[index]}:{int(match[1]) - self.starts[index]}:"


def complaints(files, compiled, checks):
    """[(files, what clang-tidy says of them; empty when they are clean)]."""
    # Files of one text include the same headers.
    together = ",-readability-duplicate-include" if len(files) > 1 else ""
    with Unit(files, compiled) as unit:
        if len(files) == 1 or unit.run("clang++-14", "-fsyntax-only", "-w", *unit.flags, unit.path)[0] == 0:
            status, output = unit.run("clang-tidy-14", "--quiet", f"--config-file={ROOT}/.clang-tidy",
                                      f"--checks={checks}{together}", "--warnings-as-errors=*", unit.path, "--", *unit.flags)
            if status == 0 or len(files) == 1:
                return [(files, (output or f"clang-tidy ended with status {status}") if status else "")]
    # What is found may be of the joint alone: a name of one file that another has for something else.
    half = len(files) // 2
    return complaints(files[:half], compiled, checks) + complaints(files[half:], compiled, checks)


def main():
    parser = argparse.ArgumentParser(description="clang-tidy, warnings as errors")
    parser.add_argument("files", nargs="*", metavar="FILE")
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--done")
    parser.add_argument("--together", type=int, default=8, metavar="N", help="files in one text (8)")
    parser.add_argument("--no-analyzer", action="store_true", help="without the analyzer, which follows paths and is slow")
    given = parser.parse_args()
    end = time.monotonic() + given.seconds
    checks = "-clang-analyzer-*" if given.no_analyzer else ""
    compiled = prepared()
    files = sorted(compiled) if given.all else wanted(given.files, compiled)

    def mark(file):
        return os.path.join(given.done, file.replace("/", "_"))

    if given.done:
        os.makedirs(given.done, exist_ok=True)
        files = [file for file in files if not os.path.exists(mark(file))]
    for file in files:
        stand_in_for_moc(file, compiled[file])
    units = [files[first:first + given.together] for first in range(0, len(files), given.together)]
    left_out, n_bad = [], 0

    def look(unit):
        return complaints(unit, compiled, checks) if time.monotonic() < end else [(unit, None)]

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for seen, text in itertools.chain.from_iterable(pool.map(look, units)):
            if text is None:
                left_out += seen
            elif text:
                n_bad += len(seen)
                print(text, flush=True)
            elif given.done:
                for file in seen:
                    open(mark(file), "w", encoding="utf-8").close()
    if left_out:
        print(f"clang-tidy: no time for {len(left_out)} of {len(files)} files: {' '.join(left_out)}")
    print(f"clang-tidy: {len(files) - len(left_out) - n_bad} files clean, {n_bad} not")
    return 1 if n_bad else 0


if __name__ == "__main__":
    sys.exit(main())
