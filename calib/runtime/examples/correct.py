"""The same as correct.c. python3 correct.py lab.ftcal.json < poses.txt"""
import sys

import fieldtrue_runtime

try:
    calibration = fieldtrue_runtime.Calibration(sys.argv[1])
except fieldtrue_runtime.Failure as failure:
    sys.exit(str(failure))
for line in sys.stdin:
    numbers = [float(text) for text in line.split()]
    position_m, orientation_wxyz = calibration.correct(numbers[:3], numbers[3:])
    inside = "inside" if calibration.is_inside(numbers[:3]) else "outside"
    print(*(f"{x:.17g}" for x in [*position_m, *orientation_wxyz]), inside)
