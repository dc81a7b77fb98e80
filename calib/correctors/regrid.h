#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/pose.h"
#include "calib/core/settings.h"

namespace fieldtrue {

/// How error vectors of scattered places are brought to the nodes of a grid in tracked space.
enum class RegridMethod {
  kBriggs,  ///< The surrounding tetrahedron of smallest volume, inverse squared distance (survey, section 5, eq. 12).
  kLivingston,   ///< Gaussian kernel, cut off at three times the pitch (survey, section 5).
  kCzernuszenko  ///< Inverse squared distance to all places (survey, eq. 19).
};

/// @error kBadInput naming the known methods
Result<RegridMethod> findRegridMethod(std::string_view id);
std::string regridMethodId(RegridMethod method);

/// The Gaussian kernel of kLivingston: its width is not published; one pitch is ours.
struct RegridOptions {
  RegridMethod method = RegridMethod::kBriggs;
  double pitch_m = 0.3048;     ///< Of the target grid; the kernel's cut-off is three of it.
  double width_pitches = 1.0;  ///< SD of the Gaussian kernel, in pitches.
};

/// A place's share in the value at a target.
struct RegridWeight {
  std::size_t place = 0;
  double weight = 0.0;
};

/// For each target the shares that make its value, adding up to 1; empty where the target has no support: values are
/// never extrapolated.
/// @param p_tracked_m of the distinct places, tracker frame [m]
/// @param targets_m in the same frame [m]
std::vector<std::vector<RegridWeight>> regridWeights(std::span<const Eigen::Vector3d> p_tracked_m,
                                                     std::span<const Eigen::Vector3d> targets_m,
                                                     const RegridOptions& options);

}  // namespace fieldtrue
