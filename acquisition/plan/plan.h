#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/place_name.h"

namespace fieldtrue::acquisition {

enum class PlanOrder { kSerpentine, kRandom };

inline constexpr std::int64_t kMaxPlaces = 100000;
inline constexpr int kMaxOrientations = 24;

/// Where the jig is to stand, and in which order. Metres, true (rig) frame.
///
/// Serpentine order needs the fewest pipe changes: every place and visit of a level comes before the next level. Within
/// a level the columns run to and fro along the rows, and each further pass (the next visit, the next level) walks the
/// last one backwards, so the jig never travels back empty. Random order shuffles all stops with the seed, the same on
/// every platform. Explicit places are visited as listed, or shuffled.
///
/// Visit 0 has the identity orientation. All `reseat` visits of one orientation come before the sensor is turned to the
/// next (visit = orientation * reseat + repeat).
struct Plan {
  std::array<int, 3> counts{5, 5, 4};
  Eigen::Vector3d pitch_m{0.3048, 0.3048, 0.3048};
  std::optional<Eigen::Vector3d>
      origin_m;  ///< Of node (0,0,0). None: centred in front of the transmitter, first column 1.5 pitches along +X.
  PlanOrder order = PlanOrder::kSerpentine;
  std::uint64_t seed = 1;
  int orientations = 1;  ///< Visits at other sensor orientations: 1 = only identity.
  int reseat = 1;        ///< Visits of each place at the same orientation.
  /// Height (true z) of the lowest level's pipe foot: pipe length of level k = z(k) - pipe_base_m.
  double pipe_base_m = 0.0;
  std::vector<PlannedPlace> explicit_places;  ///< Used instead of the grid when not empty.
};

/// Reads `grid:NXxNYxNZ@PX[xPYxPZ][:origin=x,y,z][:order=serpentine|random][:seed=n][:orientations=k][:reseat=m]`, or
/// the path of a `*.plan.json` with the same keys plus `nodes`.
/// @error kBadInput quoting the part that is wrong and where it stands; kIo; kNewerVersion
Result<Plan> readPlan(const std::string& text_or_path);

/// Reads the keys `schema` ("fieldtrue.plan/1"), `grid` ("NXxNYxNZ@PX[xPYxPZ]"), `origin` ([x, y, z]), `order`, `seed`,
/// `orientations`, `reseat`, `pipe_base_m` and `nodes` (list of `node, x_m, y_m, z_m` with optional
/// `qw, qx, qy, qz, i, j, k, role, visit, t_s`); all optional, but without `grid` there must be `nodes`.
/// @param name stands in error messages ("lab.plan.json")
/// @error kBadInput naming the key, what was seen and what is needed; kNewerVersion
Result<Plan> planFromJson(const nlohmann::json& json, const std::string& name);
nlohmann::json toJson(const Plan& plan);

/// The places in the order they are to be visited; every node appears orientations x reseat times with counting visits.
std::vector<PlannedPlace> places(const Plan& plan);

/// The origin used: the one given, or the default.
Eigen::Vector3d origin_m(const Plan& plan);

/// One of the 24 right-angle orientations in which a cubic sensor block fits its seat.
///
/// Number 0 is the identity, 1 and 2 turn by 120 and 240 degrees about (1,1,1) and so permute the axes; the first 12
/// are the rotations of the tetrahedron, any two of them at least 120 degrees apart; all 24 at least 90 degrees.
/// @param number in [0, kMaxOrientations)
/// @return reference_from_sensor
Eigen::Quaterniond planOrientation(int number);

/// Pipe length of every level of the grid, lowest first [m]; empty when the pipe base is not below the lowest level,
/// for then the lengths are not known, and for scattered places.
std::vector<double> pipeLengths_m(const Plan& plan);

}  // namespace fieldtrue::acquisition
