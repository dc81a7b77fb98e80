#!/usr/bin/env python3
"""skips_check.py SKIPS.PY: holds .ci/skips.py to a real run of ctest."""
import os
import subprocess
import sys
import tempfile
import unittest

SKIPS = sys.argv.pop()
TESTS = """
add_test(a/pass sh -c "echo fine")
add_test(a/skip sh -c "echo 'SKIPPED A::b(c): no moon' >&2; exit 77")
add_test(a/silent sh -c "exit 77")
add_test(a/unsteady sh -c "test -f flag || { touch flag; exit 1; }")
add_test(a/both sh -c "echo 'SKIPPED A::c: no sun' >&2; exit 1")
set_tests_properties(a/pass a/skip a/silent a/both PROPERTIES SKIP_RETURN_CODE 77)
"""


class SkipsCheck(unittest.TestCase):
    def run_ctest(self, wanted, allowed=None, repeat=False):
        """The lines printed, and the exit status of skips.py."""
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "CTestTestfile.cmake"), "w") as tests:
                tests.write(TESTS)
            command = [SKIPS, os.path.join(folder, "Testing/Temporary/LastTest.log")]
            if allowed is not None:
                with open(os.path.join(folder, "list.txt"), "w") as list_file:
                    list_file.write(allowed)
                command.append(list_file.name)
            again = ["--repeat", "until-pass:2"] if repeat else []
            ctest = subprocess.run(["ctest", "--test-dir", folder, "-R", wanted] + again, stdout=subprocess.PIPE)
            told = subprocess.run(command, input=ctest.stdout, stdout=subprocess.PIPE, check=False)
            return told.stdout.decode().splitlines(), told.returncode

    def test_reasons_stand_before_the_closing_lines(self):
        lines, status = self.run_ctest("pass|skip|silent")
        closing = lines.index("100% tests passed, 0 tests failed out of 3")
        start = lines.index("Skipped: 2")
        self.assertEqual(lines[start + 1 : closing],
                         ["  a/skip: A::b(c): no moon", "  a/silent: all of it: no reason given", ""])
        self.assertEqual(lines[-1], "\t  3 - a/silent (Skipped)")
        self.assertEqual(status, 0)

    def test_skips_of_a_failed_test_are_told(self):
        lines, _ = self.run_ctest("both")
        self.assertIn("  a/both: A::c: no sun", lines)
        self.assertIn("0% tests passed, 1 tests failed out of 1", lines)

    def test_nothing_skipped_is_said(self):
        lines, status = self.run_ctest("pass", allowed="")
        self.assertIn("Skipped: nothing", lines)
        self.assertEqual(status, 0)

    def test_what_passes_only_when_run_again_is_told(self):
        lines, status = self.run_ctest("unsteady|both", repeat=True)
        self.assertIn("Passed only when run again, to be made steady: a/unsteady", lines)
        self.assertIn("50% tests passed, 1 tests failed out of 2", lines)
        self.assertEqual(status, 0)

    def test_only_what_the_list_names_may_be_skipped(self):
        for allowed, expected in [("# none\n", 1), ("a/skip A::b\n", 0), ("a/skip A::b(c): no moon\n", 0),
                                  ("a/skip A::b(c): no sun\n", 1), ("b/skip A::b\n", 1)]:
            lines, status = self.run_ctest("skip", allowed)
            self.assertEqual(status, expected, allowed)
            self.assertEqual(any("counts as failed" in line for line in lines), expected == 1)
            self.assertIn("100% tests passed, 0 tests failed out of 1", lines)


unittest.main()
