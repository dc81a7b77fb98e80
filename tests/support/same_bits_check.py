#!/usr/bin/env python3
"""same_bits_check.py SAME_BITS.SH: two fake builds that differ in one thing, and what same_bits.sh says of it."""
import base64
import os
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

SAME_BITS = sys.argv.pop()

# Lists nothing, simulates one table, compares with one number, one page and one picture.
PROGRAM = """#!/bin/sh
case "$1" in
  '?') echo "there is no command '?'; known: simulate, compare, report" >&2; exit 2 ;;
  --version) echo '{software}'; exit ;;
  methods|effects|formats) echo '{{"position": [], "orientation": [], "effects": [], "export": []}}'; exit ;;
esac
command="$1"
while [ $# -gt 0 ]; do
  case "$1" in --nodes) nodes="$2" ;; --html) html="$2" ;; esac
  shift
done
if [ $command = simulate ]; then printf 'node,x_m,y_m,z_m,role\\n1,0.5,0,0,fit\\n' >"$nodes"; fi
if [ -n "$html" ]; then echo '<p>Page</p><img src="data:image/png;base64,{picture}"/>' >"$html"; fi
[ $command = simulate ] || cat <<'END'
{{
  "software": "{software}",
  "position": [{{"method": "affine", "rms": {rms}, "fit_s": {fit_s}}}],
  "verdict": {{"text": "{verdict}"}}
}}
END
exit {status}
"""
PIXELS = [[(10, 20, 30), (40, 50, 60)], [(11, 19, 33), (250, 5, 60)], [(1, 2, 3), (200, 100, 0)]]


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(rows, kind=0, level=9):
    """A PNG whose rows are all filtered in one of the five ways, as the format's description has it."""
    data, above = b"", [0] * 6
    for pixels in rows:
        row = [value for pixel in pixels for value in pixel]
        left = [0, 0, 0] + row[:-3]
        corner = [0, 0, 0] + above[:-3]
        foretold = {0: [0] * 6, 1: left, 2: above, 3: [(a + b) // 2 for a, b in zip(left, above)],
                    4: [min((a, b, c), key=lambda one, p=a + b - c: abs(p - one)) for a, b, c in
                        zip(left, above, corner)]}[kind]
        data += bytes([kind]) + bytes((value - guess) % 256 for value, guess in zip(row, foretold))
        above = row
    header = struct.pack(">IIBBBBB", 2, len(rows), 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(data, level)) + chunk(b"IEND", b"")


class SameBitsCheck(unittest.TestCase):
    def compared(self, *options, **changed):
        """The lines that are printed about two builds of which the second differs, and the exit status."""
        with tempfile.TemporaryDirectory() as folder:
            same = {"software": "Fake 1", "rms": 1.25, "fit_s": 0.5, "verdict": "Apply.", "status": 0, "picture": png(PIXELS)}
            for name, values in (("old", same), ("new", {**same, **changed})):
                os.makedirs(f"{folder}/{name}/app")
                values = {**values, "picture": base64.b64encode(values["picture"]).decode()}
                with open(f"{folder}/{name}/app/fieldtrue-cli", "w") as program:
                    program.write(PROGRAM.format(**values))
                os.chmod(program.name, 0o755)
            run = subprocess.run([SAME_BITS, f"{folder}/old", f"{folder}/new", "--only", "compare", *options],
                                 stdout=subprocess.PIPE, check=False)
        return run.stdout.decode().splitlines(), run.returncode

    def assert_same(self, **changed):
        lines, status = self.compared(**changed)
        self.assertTrue(lines[-1].startswith("No differences in 0 of "), lines)
        self.assertEqual(status, 0)

    def test_the_same_is_the_same(self):
        self.assert_same()

    def test_one_digit(self):
        lines, status = self.compared(rms=1.26)
        at = lines.index("compare.loo.json, line 3:")
        self.assertEqual(lines[at + 1 : at + 3],
                         ['  - ' + '  "position": [{"method": "affine", "rms": 1.25, "fit_s": *}],',
                          '  + ' + '  "position": [{"method": "affine", "rms": 1.26, "fit_s": *}],'])
        self.assertEqual(status, 1)

    def test_one_pixel(self):
        other = [list(row) for row in PIXELS]
        other[1][0] = (11, 19, 34)
        lines, status = self.compared(picture=png(other))
        at = lines.index("compare.poses.html, picture 1:")
        self.assertEqual(lines[at + 1], "  - 1 of 6 pixels differ, the first at column 0, row 1")
        self.assertEqual(status, 1)

    def test_the_same_pixels_written_in_another_way(self):
        for kind in range(5):
            with self.subTest(kind=kind):
                self.assert_same(picture=png(PIXELS, kind, level=1))

    def test_times_and_software_are_masked(self):
        self.assert_same(fit_s=0.75, software="Fake 2")

    def test_exit_status(self):
        lines, status = self.compared(status=1)
        self.assertIn("  + status 1", lines)
        self.assertEqual(status, 1)

    def test_largest_change_of_a_number(self):
        lines, status = self.compared("--largest-change", rms=1.250000125)
        self.assertIn("   1.00e-07  compare.position[affine].rms  1.25 -> 1.250000125  (compare.curve.txt)", lines)
        self.assertEqual(status, 0)

    def test_largest_change_names_a_verdict(self):
        lines, status = self.compared("--largest-change", verdict="Do not apply.")
        at = lines.index("  compare.verdict.text  (compare.loo.json)")
        self.assertEqual(lines[at + 1 : at + 3], ["    - Apply.", "    + Do not apply."])
        self.assertEqual(status, 1)

    def test_a_build_without_programs_is_refused(self):
        run = subprocess.run([SAME_BITS, "/nowhere", "/nowhere"], stderr=subprocess.PIPE, check=False)
        self.assertEqual(run.returncode, 2)
        self.assertIn(b"/nowhere/app/fieldtrue-cli is not built", run.stderr)


unittest.main()
