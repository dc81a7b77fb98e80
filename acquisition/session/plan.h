#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"

namespace fieldtrue {

enum class PlanOrder { kSerpentine, kRandom };

/// Where the jig is to stand, and in which order. Metres, true (rig) frame.
struct Plan {
  std::array<int, 3> counts{5, 5, 4};
  Eigen::Vector3d pitch_m{0.3048, 0.3048, 0.3048};
  std::optional<Eigen::Vector3d> origin_m;  ///< Of node (0,0,0). None: centred in front of the transmitter, first column 1.5 pitches along +X.
  PlanOrder order = PlanOrder::kSerpentine;
  std::uint64_t seed = 1;
  int orientations = 1;  ///< Visits at other sensor orientations: 1 = only identity.
  int reseat = 1;        ///< Visits of each place at the same orientation.
  double pipe_base_m = 0.0;  ///< Height (true z) of the lowest level's pipe foot: pipe length of level k = z(k) - pipe_base_m.
  std::vector<PlannedPlace> explicit_places;  ///< Used instead of the grid when not empty.
};

/// Reads `grid:NXxNYxNZ@PX[xPYxPZ][:origin=x,y,z][:order=serpentine|random][:seed=n][:orientations=k][:reseat=m]`, or the
/// path of a `*.plan.json` with the same keys plus `nodes`.
/// @error kBadInput, kIo
Result<Plan> readPlan(const std::string& text_or_path);
Result<Plan> planFromJson(const nlohmann::json& json, const std::string& name);
nlohmann::json toJson(const Plan& plan);

/// The places in the order they are to be visited; every node appears orientations x reseat times with counting visits.
std::vector<PlannedPlace> places(const Plan& plan);

/// The origin used: the one given, or the default.
Eigen::Vector3d origin_m(const Plan& plan);

/// What a person reads on a place: column letter, row number, level ("C4, pipe 3"); "P17" for scattered places.
std::string placeName(const PlannedPlace& place);

}  // namespace fieldtrue
