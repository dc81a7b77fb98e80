"""Fieldtrue's runtime for Python: corrects the poses of an electromagnetic tracker by a calibration file.

    import fieldtrue_runtime
    calibration = fieldtrue_runtime.Calibration("lab.ftcal.json")
    position_m, orientation_wxyz = calibration.correct([0.5, 0.1, 0.2], [1, 0, 0, 0])

Positions are in m, orientations unit quaternions w x y z; an orientation of four zeros means that there is none. The
shared library is looked for in FIELDTRUE_RUNTIME, beside this file, in the folders above it, and where the system looks.
"""
import ctypes
import math
import os
import pathlib

FIRST_SENSOR = -1


class Failure(RuntimeError):
    """What the library says in one sentence; `status` is its number."""

    def __init__(self, status, sentence):
        super().__init__(sentence)
        self.status = status


class _Pose(ctypes.Structure):
    _fields_ = [("position_m", ctypes.c_double * 3), ("orientation_wxyz", ctypes.c_double * 4)]


def _library():
    name = "libfieldtrue_runtime.so.0"
    here = pathlib.Path(__file__).resolve().parent
    candidates = [os.environ.get("FIELDTRUE_RUNTIME", "")]
    candidates += [str(folder / name) for folder in [here, *here.parents[:4]]]
    found = next((path for path in candidates if path and os.path.exists(path)), name)
    library = ctypes.CDLL(found)
    handle, pose = ctypes.c_void_p, ctypes.POINTER(_Pose)
    for function, result, arguments in [
            ("fieldtrue_version", ctypes.c_char_p, []),
            ("fieldtrue_error", ctypes.c_char_p, []),
            ("fieldtrue_load", ctypes.c_int, [ctypes.c_char_p, ctypes.POINTER(handle)]),
            ("fieldtrue_free", None, [handle]),
            ("fieldtrue_bake", ctypes.c_int, [handle, ctypes.c_double, ctypes.c_double, ctypes.POINTER(handle)]),
            ("fieldtrue_of_sensor", ctypes.c_int, [handle, ctypes.c_int, ctypes.POINTER(handle)]),
            ("fieldtrue_correct_many", None, [handle, ctypes.c_int, pose, pose, ctypes.c_size_t]),
            ("fieldtrue_uncertainty_m", ctypes.c_double, [handle, pose]),
            ("fieldtrue_inside", ctypes.c_int, [handle, ctypes.c_double * 3]),
            ("fieldtrue_nearest_orientation_deg", ctypes.c_double, [handle, ctypes.c_double * 4]),
            ("fieldtrue_takes_orientation", ctypes.c_int, [handle]),
            ("fieldtrue_fact", ctypes.c_char_p, [handle, ctypes.c_char_p])]:
        getattr(library, function).restype = result
        getattr(library, function).argtypes = arguments
    return library


_lib = _library()


def version():
    return _lib.fieldtrue_version().decode()


def _checked(status):
    if status != 0:
        raise Failure(status, _lib.fieldtrue_error().decode())


def _pose(position_m, orientation_wxyz):
    return _Pose((ctypes.c_double * 3)(*position_m), (ctypes.c_double * 4)(*orientation_wxyz))


class Calibration:
    """A calibration, read once. Any number of threads may use it."""

    def __init__(self, path):
        self._handle = ctypes.c_void_p()
        _checked(_lib.fieldtrue_load(os.fsencode(path), ctypes.byref(self._handle)))

    def __del__(self):
        if getattr(self, "_handle", None):
            _lib.fieldtrue_free(self._handle)
            self._handle = None

    def baked(self, max_deviation_um=50.0, max_angle_deg=0.01):
        """The same on a dense lattice, which is fast whatever the method was."""
        return self._made(_lib.fieldtrue_bake, max_deviation_um, max_angle_deg)

    def of_sensor(self, sensor):
        """One sensor's alone, for uncertainty_m and is_inside where each sensor has a correction of its own."""
        return self._made(_lib.fieldtrue_of_sensor, sensor)

    def _made(self, function, *arguments):
        made = Calibration.__new__(Calibration)
        made._handle = ctypes.c_void_p()
        _checked(function(self._handle, *arguments, ctypes.byref(made._handle)))
        return made

    def correct(self, position_m, orientation_wxyz=(0, 0, 0, 0), sensor=FIRST_SENSOR):
        """One pose: (position_m, orientation_wxyz) as corrected."""
        tracked, corrected = _pose(position_m, orientation_wxyz), _Pose()
        _lib.fieldtrue_correct_many(self._handle, sensor, ctypes.byref(tracked), ctypes.byref(corrected), 1)
        return list(corrected.position_m), list(corrected.orientation_wxyz)

    def correct_many(self, poses, sensor=FIRST_SENSOR):
        """Rows of x y z [m] qw qx qy qz: a NumPy array of n x 7 gives one, lists give lists."""
        try:
            import numpy
        except ImportError:
            return [[*position, *turn] for position, turn in (self.correct(row[:3], row[3:], sensor) for row in poses)]
        rows = numpy.ascontiguousarray(poses, dtype=numpy.float64)
        if rows.ndim != 2 or rows.shape[1] != 7:
            raise ValueError(f"poses need rows of 7 numbers, not the shape {rows.shape}")
        corrected = numpy.empty_like(rows)
        pointers = [ctypes.cast(array.ctypes.data, ctypes.POINTER(_Pose)) for array in (rows, corrected)]
        _lib.fieldtrue_correct_many(self._handle, sensor, *pointers, len(rows))
        return corrected

    def uncertainty_m(self, position_m, orientation_wxyz=(0, 0, 0, 0)):
        """3-D standard deviation of the corrected position [m]; None where the method knows none."""
        value = _lib.fieldtrue_uncertainty_m(self._handle, ctypes.byref(_pose(position_m, orientation_wxyz)))
        return None if math.isnan(value) else value

    def is_inside(self, position_m):
        return _lib.fieldtrue_inside(self._handle, (ctypes.c_double * 3)(*position_m)) == 1

    def nearest_orientation_deg(self, orientation_wxyz):
        value = _lib.fieldtrue_nearest_orientation_deg(self._handle, (ctypes.c_double * 4)(*orientation_wxyz))
        return None if math.isnan(value) else value

    def takes_orientation(self):
        return _lib.fieldtrue_takes_orientation(self._handle) == 1

    def fact(self, key):
        """"method", "orientation_method", "software", "direction", "setup.room", ...; None where it is not stated."""
        value = _lib.fieldtrue_fact(self._handle, key.encode())
        return None if value is None else value.decode()
