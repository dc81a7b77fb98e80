"""SciPy's multiquadric on the places of the benchmark, one thread; prints its CPU times as JSON.

Usage: scipy_peer.py FOLDER R_M, where FOLDER holds tracked.f64, true.f64 and points.f64 (x y z, doubles).
"""
import json
import os
import sys
import time
import warnings

# Before numpy is imported: its linear algebra reads them once.
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

import numpy
import scipy
from scipy.interpolate import RBFInterpolator


def read_points(folder, name):
    return numpy.fromfile(os.path.join(folder, name), dtype="<f8").reshape(-1, 3)


def shortest(action, repetitions):
    times = []
    for _ in range(repetitions):
        start = time.process_time()
        action()
        times.append(time.process_time() - start)
    return min(times)


def main():
    folder, r_m = sys.argv[1], float(sys.argv[2])
    tracked, true, points = (read_points(folder, name) for name in ("tracked.f64", "true.f64", "points.f64"))

    def fit():
        # degree -1: no polynomial tail, as in Hardy's method.
        return RBFInterpolator(tracked, true, kernel="multiquadric", epsilon=1.0 / r_m, degree=-1)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = fit()
        times_s = {"fit": shortest(fit, 3)}
    few = points[:200]
    times_s["one point"] = shortest(lambda: [model(point[None, :]) for point in few], 3) / len(few)
    times_s["100,000 points"] = shortest(lambda: model(points[:20000]), 2) * (100000 / min(20000, len(points)))
    print(json.dumps({"scipy": scipy.__version__, "times_s": times_s}))


main()
