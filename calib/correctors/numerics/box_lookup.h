#pragma once

#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

namespace fieldtrue::correctors {

/// Finds the boxes that may hold a point: a regular grid of bins over all of them, each with a list of its boxes.
class BoxLookup {
 public:
  BoxLookup() = default;
  explicit BoxLookup(std::span<const Eigen::AlignedBox3d> boxes);

  /// Numbers of the boxes whose bin holds the point, ascending; the point need not lie in them. Empty outside all.
  std::span<const int> near(const Eigen::Vector3d& point_m) const;

 private:
  using Bin = std::array<std::size_t, 3>;

  Bin binOf(const Eigen::Vector3d& point_m) const;
  std::size_t flat(const Bin& bin) const { return (bin[0] * counts_[1] + bin[1]) * counts_[2] + bin[2]; }

  Eigen::AlignedBox3d bounds_;
  Eigen::Vector3d bins_per_m_ = Eigen::Vector3d::Zero();
  Bin counts_ = {0, 0, 0};
  std::vector<std::size_t> starts_;  ///< Of each bin's list in `items_`, and the end of the last.
  std::vector<int> items_;
};

}  // namespace fieldtrue::correctors
