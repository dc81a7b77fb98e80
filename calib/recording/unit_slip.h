#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::recording {

/// Two units that are mixed up.
struct UnitSlip {
  double factor;
  const char* words;
};
inline constexpr std::array<UnitSlip, 7> kUnitSlips{{{1000.0, "millimetres for metres"},
                                                     {304.8, "millimetres for feet"},
                                                     {25.4, "millimetres for inches"},
                                                     {100.0, "centimetres for metres"},
                                                     {10.0, "millimetres for centimetres"},
                                                     {39.37, "inches for metres"},
                                                     {3.28, "feet for metres"}}};

/// Farther than any tracker reaches.
inline constexpr double kTrackerReach_m = 30.0;

/// Refuses a table whose positions cannot all be metres: places more than 30 m apart or all within 1 mm, or, from four
/// places on, distances between true places and between their readings (mirrored ones put back) that differ by more
/// than a factor of two in the median. Only distances count, so that neither an alignment nor mirrored axes, nor a
/// single bad layer, decide. A single reading that lies farther out than any tracker reaches is refused as well, unless
/// its row is skipped.
/// @param lines of the rows in their file, for messages; empty where they are of none
/// @error kBadInput: what was seen, and the nearest slip of units, or the row and column
Result<void> checkUnits(const CalibrationTable& table, std::span<const int> lines = {});

/// The same question for readings of unknown truth, one at a time: none lies in the calibrated region enlarged
/// threefold, but most would after one of the slips. Feet for metres hardly leave the enlarged region, so none in the
/// region itself and nine of ten after a slip is told as well, from ten readings on.
class ReadingUnits {
 public:
  /// @param tracked_m what the calibration was fitted on
  ReadingUnits(const Region& region, std::span<const Eigen::Vector3d> tracked_m);
  void add(const Eigen::Vector3d& reading_m);
  /// @error kBadInput: what was seen, and the slip
  Result<void> check() const;

 private:
  bool isNear(const Eigen::Vector3d& reading_m) const;

  Region region_;
  Eigen::Vector3d center_m_ = Eigen::Vector3d::Zero();
  bool is_settled_ = false;  ///< A reading lies in the region, or nothing is known of it.
  std::size_t n_readings_ = 0;
  std::size_t n_near_ = 0;
  /// Readings that each slip would bring into the region and into the enlarged one, multiplied and divided.
  struct Hits {
    std::size_t inside = 0;
    std::size_t near = 0;
  };
  std::array<std::array<Hits, 2>, kUnitSlips.size()> hits_{};
};

}  // namespace fieldtrue::recording
