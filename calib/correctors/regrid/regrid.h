#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/pose.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::correctors {

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

/// Finds, for targets in tracked space, the places whose values make the value there. A target outside the convex hull
/// of the places has no support, whatever the method: values are never extrapolated. Places that lie in one plane
/// support nothing.
class Regridder {
 public:
  /// The tetrahedra tried are those of the so many nearest places; twice and four times as many where none of them
  /// surrounds the target.
  static constexpr std::size_t kTetrahedronCandidates = 16;

  /// @param p_tracked_m of the distinct places, tracker frame [m], finite
  Regridder(std::span<const Eigen::Vector3d> p_tracked_m, const RegridOptions& options);

  /// The shares that make the value at a target, adding up to 1; empty where it has no support. A target that coincides
  /// with a place takes that place's value alone, except under the Gaussian kernel, which smooths everywhere alike.
  /// @param target_m tracker frame [m]
  /// @param left_out a place that counts as not measured
  std::vector<RegridWeight> weightsAt(const Eigen::Vector3d& target_m,
                                      std::optional<std::size_t> left_out = std::nullopt) const;

 private:
  using Neighbour = std::pair<double, std::size_t>;  ///< Squared distance [m2] and place.

  std::vector<Neighbour> neighbours(const Eigen::Vector3d& target_m, std::optional<std::size_t> left_out) const;
  bool inHull(const Eigen::Vector3d& target_m, std::optional<std::size_t> left_out,
              std::span<const Neighbour> nearest_first) const;
  std::vector<RegridWeight> tetrahedronWeights(const Eigen::Vector3d& target_m,
                                               std::span<const Neighbour> nearest_first) const;
  std::vector<RegridWeight> gaussianWeights(std::span<const Neighbour> nearest_first) const;

  std::vector<Eigen::Vector3d> p_tracked_m_;
  RegridOptions options_;
  Region hull_;  ///< Empty where the places span no volume.
};

/// For each target the shares that make its value, adding up to 1; empty where the target has no support: values are
/// never extrapolated.
/// @param p_tracked_m of the distinct places, tracker frame [m]
/// @param targets_m in the same frame [m]
std::vector<std::vector<RegridWeight>> regridWeights(std::span<const Eigen::Vector3d> p_tracked_m,
                                                     std::span<const Eigen::Vector3d> targets_m,
                                                     const RegridOptions& options);

}  // namespace fieldtrue::correctors
