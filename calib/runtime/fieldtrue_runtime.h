/* Fieldtrue's runtime: corrects the poses of an electromagnetic tracker by a calibration file (*.ftcal.json).
 *
 * Positions are in m, orientations unit quaternions w x y z. In goes tracker_from_sensor as tracked, out comes
 * reference_from_sensor as corrected. A calibration is read once and never changes: any number of threads may use one
 * at the same time. Correcting takes no lock, touches no file and, in baked form, allocates nothing. Nothing throws. */
#ifndef FIELDTRUE_RUNTIME_H
#define FIELDTRUE_RUNTIME_H

#include <stddef.h>

#if defined(__GNUC__)
#define FIELDTRUE_API __attribute__((visibility("default")))
#else
#define FIELDTRUE_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef struct fieldtrue_calibration fieldtrue_calibration;

/* An orientation of four zeros means that there is none: then position alone is corrected, a correction of whole poses
 * as the mean over the orientations that were calibrated, and four zeros come back. */
typedef struct fieldtrue_pose {
  double position_m[3];
  double orientation_wxyz[4]; /* Normalised here; comes back with w >= 0. */
} fieldtrue_pose;

typedef enum fieldtrue_status {
  FIELDTRUE_OK = 0,
  FIELDTRUE_UNREADABLE = 1, /* The file cannot be opened. */
  FIELDTRUE_BAD_FILE = 2,   /* Damaged, or no calibration. */
  FIELDTRUE_NEWER_FILE = 3, /* Written by a newer Fieldtrue. */
  FIELDTRUE_BAD_ARGUMENT = 4,
  FIELDTRUE_IMPOSSIBLE = 5 /* What was asked cannot be done here: no lattice within the bound, no memory. */
} fieldtrue_status;

typedef enum fieldtrue_match {
  FIELDTRUE_MATCH_UNKNOWN = 0,
  FIELDTRUE_MATCH_YES = 1,
  FIELDTRUE_MATCH_NO = 2
} fieldtrue_match;

/* In place of a sensor's number: the first one that was calibrated. */
#define FIELDTRUE_FIRST_SENSOR (-1)

/* "0.1.0" */
FIELDTRUE_API const char* fieldtrue_version(void);

/* Reads a calibration. On failure *calibration is NULL and fieldtrue_error tells. */
FIELDTRUE_API fieldtrue_status fieldtrue_load(const char* path, fieldtrue_calibration** calibration);
/* The same from memory. name stands in messages. */
FIELDTRUE_API fieldtrue_status fieldtrue_load_memory(const char* text, size_t size, const char* name,
                                                     fieldtrue_calibration** calibration);
/* NULL is allowed. No other thread may still use it. */
FIELDTRUE_API void fieldtrue_free(fieldtrue_calibration* calibration);

/* One sentence for the last failure in this thread; "" where nothing has failed. Stands until the next failure. */
FIELDTRUE_API const char* fieldtrue_error(void);

/* The same correction on a dense lattice, which costs the same whatever the method was and allocates nothing: within
 * max_deviation_um [um] of this one in position, and, where its orientation part is costly, within max_angle_deg [deg]
 * in orientation, both inside the calibrated region. A correction of whole poses keeps taking the orientation. */
FIELDTRUE_API fieldtrue_status fieldtrue_bake(const fieldtrue_calibration* calibration, double max_deviation_um,
                                              double max_angle_deg, fieldtrue_calibration** baked);

/* The calibration of one sensor alone, for what is asked without a sensor: positions, uncertainty, inside. Where each
 * sensor was given a correction of its own, those of the whole calibration speak of the first sensor. */
FIELDTRUE_API fieldtrue_status fieldtrue_of_sensor(const fieldtrue_calibration* calibration, int sensor,
                                                   fieldtrue_calibration** one);

/* Corrects one pose; tracked and corrected may be the same. Where the method does not reach, the alignment alone is
 * applied. sensor: a number of the calibrated table, or FIELDTRUE_FIRST_SENSOR. */
FIELDTRUE_API void fieldtrue_correct(const fieldtrue_calibration* calibration, int sensor,
                                     const fieldtrue_pose* tracked, fieldtrue_pose* corrected);
/* Corrects n poses of one sensor. */
FIELDTRUE_API void fieldtrue_correct_many(const fieldtrue_calibration* calibration, int sensor,
                                          const fieldtrue_pose* tracked, fieldtrue_pose* corrected, size_t n);

/* Corrects n positions, x y z one after the other [m]; a correction of whole poses as its mean over the orientations
 * that were calibrated. corrected_m may be tracked_m. */
FIELDTRUE_API void fieldtrue_correct_positions(const fieldtrue_calibration* calibration, const double* tracked_m,
                                               double* corrected_m, size_t n);

/* Standard deviation of the corrected position, 3-D [m]; NaN where the method knows none. Takes no lock; the exact form
 * of a Gaussian process allocates. */
FIELDTRUE_API double fieldtrue_uncertainty_m(const fieldtrue_calibration* calibration, const fieldtrue_pose* tracked);
/* 1 inside the calibrated region where the method reaches, else 0: the result is then an extrapolation. */
FIELDTRUE_API int fieldtrue_inside(const fieldtrue_calibration* calibration, const double position_m[3]);
/* Angle to the nearest orientation that was calibrated [deg]; NaN where none was. */
FIELDTRUE_API double fieldtrue_nearest_orientation_deg(const fieldtrue_calibration* calibration,
                                                       const double orientation_wxyz[4]);

/* 1 when the correction depends on how the sensor is turned, else 0. */
FIELDTRUE_API int fieldtrue_takes_orientation(const fieldtrue_calibration* calibration);

/* A fact of the file, NULL where it is not stated: "method", "orientation_method", "software", "direction", and what
 * the calibration is good for: "setup.room", "setup.tracker_serial", ... */
FIELDTRUE_API const char* fieldtrue_fact(const fieldtrue_calibration* calibration, const char* key);
/* Whether readings of another set-up would be corrected. facts: n texts like "room=Lab 2". text (may be NULL) gets what
 * differs, cut to size with its closing 0. A fact that no set-up has: FIELDTRUE_MATCH_UNKNOWN, and fieldtrue_error. */
FIELDTRUE_API fieldtrue_match fieldtrue_setup_matches(const fieldtrue_calibration* calibration,
                                                      const char* const* facts, size_t n, char* text, size_t size);

#ifdef __cplusplus
}
#endif
#endif
