#!/usr/bin/env python3
"""clang-tidy over files as the `tidy` preset compiles them; any warning is an error.

tidy.py [--seconds N] [--done FOLDER] [--no-analyzer] FILE... | --all

A header stands for the .cpp beside it. After --seconds nothing more is started, and what was left out is told. With --done,
a file that was clean leaves a mark in FOLDER and is not looked at again.
"""
import argparse
import concurrent.futures
import json
import os
import re
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
BUILD = os.path.join(ROOT, "build", "tidy")


def prepared():
    """Configures, and tells the files that are compiled: {file: command}."""
    if not os.path.exists(os.path.join(BUILD, "build.ninja")):
        subprocess.run(["cmake", "--preset", "tidy"], cwd=ROOT, stdout=subprocess.DEVNULL, check=True)
    with open(os.path.join(BUILD, "compile_commands.json"), encoding="utf-8") as commands:
        files = {os.path.relpath(one["file"], ROOT): one["command"] for one in json.load(commands)}
    return {file: files[file] for file in files if file.endswith(".cpp") and not file.startswith(("build", ".."))}


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


def complaints(file, checks):
    """What clang-tidy says of a file; empty when it is clean."""
    run = subprocess.run(["clang-tidy-14", "-p", BUILD, "--quiet", f"--checks={checks}", "--warnings-as-errors=*", file],
                         cwd=ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)
    return "" if run.returncode == 0 else run.stdout or run.stderr


def main():
    parser = argparse.ArgumentParser(description="clang-tidy, warnings as errors")
    parser.add_argument("files", nargs="*", metavar="FILE")
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--done")
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
    left_out, n_bad = [], 0

    def look(file):
        return (file, complaints(file, checks)) if time.monotonic() < end else (file, None)

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for file, text in pool.map(look, files):
            if text is None:
                left_out.append(file)
            elif text:
                n_bad += 1
                print(text, flush=True)
            elif given.done:
                open(mark(file), "w", encoding="utf-8").close()
    if left_out:
        print(f"clang-tidy: no time for {len(left_out)} of {len(files)} files: {' '.join(left_out)}")
    print(f"clang-tidy: {len(files) - len(left_out) - n_bad} files clean, {n_bad} not")
    return 1 if n_bad else 0


if __name__ == "__main__":
    sys.exit(main())
