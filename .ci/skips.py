#!/usr/bin/env python3
"""ctest's output, with what was skipped and why, and what passed only when run again, before its closing lines.

ctest ... | skips.py BUILD/Testing/Temporary/LastTest.log [LIST]

A test says "SKIPPED what: why" on stderr for each thing that it skipped; ctest keeps that in its log. With a LIST, lines
"name-of-test beginning-of-what-and-why", a skip that no line of it allows gives status 1.
"""
import re
import signal
import sys


def reasons(log_path):
    """What the tests of a log said they skipped: [(test, "what: why")]."""
    found = []
    test = ""
    with open(log_path, encoding="utf-8", errors="replace") as log:
        for line in log:
            if begun := re.match(r"\d+/\d+ Testing: (\S+)", line):
                test = begun.group(1)
            elif said := re.match(r"SKIPPED (.+)", line):
                found.append((test, said.group(1).strip()))
    return found


def allowed(list_path):
    """The lines of the list as (test, beginning)."""
    with open(list_path, encoding="utf-8") as lines:
        kept = [line.split(None, 1) for line in lines if line.strip() and not line.startswith("#")]
    return [(entry[0], entry[1].strip() if len(entry) > 1 else "") for entry in kept]


def pass_on(lines):
    """Prints the lines up to ctest's closing ones; those, the tests that ctest calls skipped, and those that failed once."""
    closing = []
    skipped_tests = []
    failed_tests = []
    for line in lines:
        if closing or re.match(r"\d+% tests passed", line):
            closing.append(line)
            continue
        sys.stdout.write(line)
        sys.stdout.flush()
        if skipped := re.match(r" *\d+/\d+ Test +#\d+: (\S+) .*\*\*\*Skipped", line):
            skipped_tests.append(skipped.group(1))
        elif failed := re.match(r" *\d+/\d+ Test +#\d+: (\S+) .*\*\*\*", line):
            failed_tests.append(failed.group(1))
    return closing, skipped_tests, failed_tests


def main():
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # An interrupted ctest still has closing lines.
    sys.stdin.reconfigure(errors="replace")
    closing, skipped_tests, failed_tests = pass_on(sys.stdin)
    if not closing:
        return 0
    skips = reasons(sys.argv[1])
    silent = set(skipped_tests) - {test for test, _ in skips}
    skips += [(test, "all of it: no reason given") for test in sorted(silent)]
    print(f"Skipped: {len(skips) or 'nothing'}")
    for test, text in skips:
        print(f"  {test}: {text}")
    still = {named.group(1) for line in closing if (named := re.match(r"\s+\d+ - (\S+) \((?!Skipped)", line))}
    unsteady = [test for test in failed_tests if test not in still]
    if unsteady:
        print(f"Passed only when run again, to be made steady: {', '.join(unsteady)}")
    unlisted = []
    if len(sys.argv) > 2:
        known = allowed(sys.argv[2])
        unlisted = [skip for skip in skips if not any(skip[0] == t and skip[1].startswith(b) for t, b in known)]
    if unlisted:
        print(f"\nThese skips are not in {sys.argv[2]}, so this run counts as failed:")
        for test, text in unlisted:
            print(f"  {test}: {text}")
    print("\n" + "".join(closing), end="")
    return 1 if unlisted else 0


if __name__ == "__main__":
    sys.exit(main())
