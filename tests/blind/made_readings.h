#pragma once

#include "tests/blind/bare_alignment.h"

/// Made readings for tests.
namespace blind {

inline SolvedPose drawnPose(Random& random, double reach_m) {
  return {Vector3d(uniform(random, -reach_m, reach_m), uniform(random, -reach_m, reach_m),
                   uniform(random, -reach_m, reach_m)),
          rotation(random)};
}

/// Rows that a tracker without any fault reports: T * (place on the rig) * M.
inline SessionTable readings(const BareAlignment& truth, bool has_orientation, Random& random, int rows = 40) {
  SessionTable table;
  table.metadata = {"# alignment: unknown", "# jig_tolerance_m: 0.001", "# jig_tolerance_rad: 0.002"};
  table.columns = {"x_true_m", "y_true_m", "z_true_m", "qw_true", "qx_true", "qy_true", "qz_true",
                   "x_m",      "y_m",      "z_m",      "sd_x_m",  "sd_y_m",  "sd_z_m",  "n_effective"};
  if (has_orientation) table.columns.insert(table.columns.end(), {"qw", "qx", "qy", "qz", "sd_rot_rad"});
  for (int i = 0; i < rows; ++i) {
    const SolvedPose place = drawnPose(random, 1.0);
    const SolvedPose tracked = truth.reported(place);
    std::vector<double> numbers = {place.position_m.x(),
                                   place.position_m.y(),
                                   place.position_m.z(),
                                   place.orientation.w(),
                                   place.orientation.x(),
                                   place.orientation.y(),
                                   place.orientation.z(),
                                   tracked.position_m.x(),
                                   tracked.position_m.y(),
                                   tracked.position_m.z(),
                                   1e-4,
                                   1e-4,
                                   1e-4,
                                   20.0};
    if (has_orientation)
      numbers.insert(numbers.end(), {tracked.orientation.w(), tracked.orientation.x(), tracked.orientation.y(),
                                     tracked.orientation.z(), 1e-3});
    std::vector<std::string> row;
    for (const double number : numbers) row.push_back(exactText(number));
    table.rows.push_back(row);
  }
  return table;
}

}  // namespace blind
