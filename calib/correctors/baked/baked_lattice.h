#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/json_reader.h"
#include "calib/correctors/baked/baked_lattice_kernel.h"
#include "calib/correctors/base/position_model.h"
#include "calib/correctors/numerics/aligned_vector.h"

namespace fieldtrue::correctors {

/// What a lattice consists of. Coefficient (i, j, k) is four floats at 4 (k + counts[2] (j + counts[1] i)).
struct LatticeParts {
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< Of coefficient (0, 0, 0), tracker frame.
  double spacing_m = 1.0;
  std::array<int, 3> counts = {4, 4, 4};
  AlignedVector<float> coefficients;  ///< Displacement [m], and uncertainty [m] or 0.
  bool has_uncertainty = false;
  /// One a cell, (counts - 3)^3 in the order of the coefficients: whether the baked method reaches into it. Empty =
  /// into all.
  std::vector<bool> covered;
  std::string note;
};

/// A position correction baked to a cubic B-spline of its displacement on a dense lattice: 64 coefficients a sample,
/// whatever the method was, with two continuous derivatives.
class BakedLattice : public PositionModel {
 public:
  explicit BakedLattice(LatticeParts parts);

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override;
  void correct(std::span<const Eigen::Vector3d> p_tracked_m, std::span<Eigen::Vector3d> p_corrected_m) const override;
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override;
  std::optional<double> uncertainty_m(const Eigen::Vector3d& p_tracked_m) const override;
  /// Inside the lattice, and in a cell that the baked method reaches into.
  bool covers(const Eigen::Vector3d& p_tracked_m) const override;
  std::string note() const override { return parts_.note; }
  nlohmann::json parameters() const override;

  const LatticeParts& parts() const { return parts_; }

  static std::unique_ptr<PositionModel> fromJson(const JsonReader& parameters);

 private:
  LatticeParts parts_;
  LatticeArrays arrays_;
  Eigen::Vector3d low_m_, high_m_;  ///< Where all 64 coefficients around a position are there.
};

/// Cells along an axis: those that have all their coefficients.
inline int latticeCells(const LatticeParts& parts, std::size_t axis) { return parts.counts[axis] - 3; }

/// Place of a cell in `covered`.
inline std::size_t latticeCellIndex(const LatticeParts& parts, const std::array<int, 3>& cell) {
  const std::ptrdiff_t n1 = latticeCells(parts, 1);
  const std::ptrdiff_t n2 = latticeCells(parts, 2);
  return static_cast<std::size_t>(cell[2] + n2 * (cell[1] + n1 * cell[0]));
}

/// The most coefficients a lattice may have: 2,000,000, which are 32 MB in memory and as much in a file.
inline constexpr std::size_t kMostLatticeCoefficients = 2'000'000;

}  // namespace fieldtrue::correctors
