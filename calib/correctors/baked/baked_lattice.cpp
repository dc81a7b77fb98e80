#include "calib/correctors/baked/baked_lattice.h"

#include <algorithm>
#include <cmath>

#include "calib/core/json_reader.h"
#include "calib/correctors/baked/base64.h"
#include "calib/correctors/numerics/aligned_vector.h"

namespace fieldtrue::correctors {
namespace {

constexpr std::size_t kNumbers = 4;  // A displacement and an uncertainty.

std::size_t coefficientCount(const LatticeParts& parts) {
  return static_cast<std::size_t>(parts.counts[0]) * static_cast<std::size_t>(parts.counts[1]) *
         static_cast<std::size_t>(parts.counts[2]);
}

std::size_t cellCount(const LatticeParts& parts) {
  std::size_t count = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) count *= static_cast<std::size_t>(latticeCells(parts, axis));
  return count;
}

/// Weights of the four coefficients around a position, and their derivatives by the fraction.
struct AxisWeights {
  std::array<double, 4> value;
  std::array<double, 4> slope;
};

AxisWeights axisWeights(double u) {
  const double v = 1.0 - u;
  return {{v * v * v / 6.0, 2.0 / 3.0 - u * u * (1.0 - 0.5 * u), 2.0 / 3.0 - v * v * (1.0 - 0.5 * v), u * u * u / 6.0},
          {-0.5 * v * v, u * (1.5 * u - 2.0), v * (2.0 - 1.5 * v), 0.5 * u * u}};
}

std::vector<std::uint8_t> packed(const std::vector<bool>& bits) {
  std::vector<std::uint8_t> bytes((bits.size() + 7) / 8);
  for (std::size_t i = 0; i < bits.size(); ++i)
    if (bits[i]) bytes[i / 8] = static_cast<std::uint8_t>(bytes[i / 8] | 1U << (i % 8));
  return bytes;
}

std::vector<std::uint8_t> bytesOf(const JsonReader& json, std::size_t size) {
  const auto bytes = fromBase64(json.text());
  if (!bytes || bytes->size() != size) json.refuse("base64 text of " + std::to_string(size) + " bytes");
  return *bytes;
}

/// Only the numbers that say something: three a coefficient without an uncertainty.
AlignedVector<float> coefficientsFrom(const JsonReader& json, std::size_t count, std::size_t stored) {
  const std::vector<float> values = fromLittleEndianBytes(bytesOf(json, count * stored * sizeof(float)));
  AlignedVector<float> coefficients(kNumbers * count, 0.0F);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) json.refuse("finite numbers only");
    coefficients[i / stored * kNumbers + i % stored] = values[i];
  }
  return coefficients;
}

LatticeParts partsFrom(const JsonReader& json) {
  LatticeParts parts;
  parts.origin_m = json["origin_m"].vector3();
  parts.spacing_m = json["spacing_m"].number();
  parts.counts = json["counts"].integers3();
  parts.has_uncertainty = json["has_uncertainty"].flag();
  parts.note = json["note"].text();
  const auto in_range = [](int count) { return count >= 4 && count <= static_cast<int>(kMostLatticeCoefficients); };
  if (!std::all_of(parts.counts.begin(), parts.counts.end(), in_range) ||
      double(parts.counts[0]) * parts.counts[1] * parts.counts[2] > double(kMostLatticeCoefficients) ||
      !(parts.spacing_m > 0.0))
    json.fail("needs a positive spacing_m, counts of 4 and more along each axis and at most " +
              std::to_string(kMostLatticeCoefficients) + " coefficients in all.");
  parts.coefficients =
      coefficientsFrom(json["coefficients_base64"], coefficientCount(parts), parts.has_uncertainty ? 4 : 3);
  const JsonReader covered = json["covered_base64"];
  if (covered.isNull()) return parts;
  const std::size_t n_cells = cellCount(parts);
  const std::vector<std::uint8_t> bytes = bytesOf(covered, (n_cells + 7) / 8);
  for (std::size_t i = 0; i < n_cells; ++i) parts.covered.push_back((bytes[i / 8] >> (i % 8) & 1U) != 0);
  return parts;
}

}  // namespace

BakedLattice::BakedLattice(LatticeParts parts) : parts_(std::move(parts)) {
  FT_CHECK(parts_.coefficients.size() == kNumbers * coefficientCount(parts_) && parts_.spacing_m > 0.0);
  FT_CHECK(parts_.covered.empty() || parts_.covered.size() == cellCount(parts_));
  arrays_.coefficients = parts_.coefficients.data();
  arrays_.spacing_m = parts_.spacing_m;
  for (int axis = 0; axis < 3; ++axis) {
    FT_CHECK(parts_.counts[static_cast<std::size_t>(axis)] >= 4);
    arrays_.origin_m[axis] = parts_.origin_m[axis];
    arrays_.counts[axis] = parts_.counts[static_cast<std::size_t>(axis)];
    low_m_[axis] = parts_.origin_m[axis] + parts_.spacing_m;
    high_m_[axis] = parts_.origin_m[axis] + parts_.spacing_m * (arrays_.counts[axis] - 2);
  }
}

Eigen::Vector3d BakedLattice::displacement_m(const Eigen::Vector3d& p_tracked_m) const {
  std::array<float, kNumbers> values;
  latticeValues(arrays_, p_tracked_m.data(), 1, values.data());
  return Eigen::Vector3f::Map(values.data()).cast<double>();
}

void BakedLattice::correct(std::span<const Eigen::Vector3d> p_tracked_m,
                           std::span<Eigen::Vector3d> p_corrected_m) const {
  FT_CHECK(p_tracked_m.size() == p_corrected_m.size());
  constexpr std::size_t kBlock = 64;
  std::array<float, kNumbers * kBlock> values;
  for (std::size_t start = 0; start < p_tracked_m.size(); start += kBlock) {
    const std::size_t count = std::min(kBlock, p_tracked_m.size() - start);
    latticeValues(arrays_, p_tracked_m[start].data(), count, values.data());
    for (std::size_t i = 0; i < count; ++i)
      p_corrected_m[start + i] = p_tracked_m[start + i] + Eigen::Vector3f::Map(&values[kNumbers * i]).cast<double>();
  }
}

Eigen::Matrix3d BakedLattice::jacobian(const Eigen::Vector3d& p_tracked_m) const {
  std::array<int, 3> cell;
  std::array<AxisWeights, 3> weights;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double u = 0.0;
    cell[axis] = latticeCell(arrays_, static_cast<int>(axis), p_tracked_m[static_cast<Eigen::Index>(axis)], &u);
    weights[axis] = axisWeights(u);
  }
  Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t b = 0; b < 4; ++b)
      for (std::size_t c = 0; c < 4; ++c) {
        const std::size_t node =
            (static_cast<std::size_t>(cell[0] - 1) + a) * static_cast<std::size_t>(parts_.counts[1]) +
            static_cast<std::size_t>(cell[1] - 1) + b;
        const std::size_t at =
            node * static_cast<std::size_t>(parts_.counts[2]) + static_cast<std::size_t>(cell[2] - 1) + c;
        const Eigen::RowVector3d slope(weights[0].slope[a] * weights[1].value[b] * weights[2].value[c],
                                       weights[0].value[a] * weights[1].slope[b] * weights[2].value[c],
                                       weights[0].value[a] * weights[1].value[b] * weights[2].slope[c]);
        gradient += Eigen::Vector3f::Map(&parts_.coefficients[kNumbers * at]).cast<double>() * slope;
      }
  return Eigen::Matrix3d::Identity() + gradient / parts_.spacing_m;
}

std::optional<double> BakedLattice::uncertainty_m(const Eigen::Vector3d& p_tracked_m) const {
  if (!parts_.has_uncertainty) return std::nullopt;
  std::array<float, kNumbers> values;
  latticeValues(arrays_, p_tracked_m.data(), 1, values.data());
  return std::max(0.0, static_cast<double>(values[3]));
}

bool BakedLattice::covers(const Eigen::Vector3d& p_tracked_m) const {
  const auto is_within = [&](int axis) {
    return p_tracked_m[axis] >= low_m_[axis] && p_tracked_m[axis] <= high_m_[axis];
  };
  if (!(is_within(0) && is_within(1) && is_within(2))) return false;
  if (parts_.covered.empty()) return true;
  std::array<int, 3> cell;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double u = 0.0;
    cell[axis] = latticeCell(arrays_, static_cast<int>(axis), p_tracked_m[static_cast<Eigen::Index>(axis)], &u) - 1;
  }
  return parts_.covered[latticeCellIndex(parts_, cell)];
}

nlohmann::json BakedLattice::parameters() const {
  const std::size_t stored = parts_.has_uncertainty ? 4 : 3;
  std::vector<float> values;
  for (std::size_t i = 0; i < parts_.coefficients.size(); ++i)
    if (i % kNumbers < stored) values.push_back(parts_.coefficients[i]);
  nlohmann::json json = {{"origin_m", jsonOf(parts_.origin_m)},
                         {"spacing_m", parts_.spacing_m},
                         {"counts", parts_.counts},
                         {"has_uncertainty", parts_.has_uncertainty},
                         {"coefficients_base64", toBase64(littleEndianBytes(values))},
                         {"note", parts_.note}};
  json["covered_base64"] = parts_.covered.empty() ? nlohmann::json() : nlohmann::json(toBase64(packed(parts_.covered)));
  return json;
}

std::unique_ptr<PositionModel> BakedLattice::fromJson(const JsonReader& parameters) {
  return std::make_unique<BakedLattice>(partsFrom(parameters));
}

}  // namespace fieldtrue::correctors
