#include "calib/correctors/baked/imported_lattice.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/correctors/baked/base64.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"

namespace fieldtrue::correctors {
namespace {

/// A point on the last face may lie beyond it by rounding.
constexpr double kOnFace = 1e-9;

std::size_t pointCount(const std::array<int, 3>& counts) {
  return static_cast<std::size_t>(counts[0]) * static_cast<std::size_t>(counts[1]) *
         static_cast<std::size_t>(counts[2]);
}

class ImportedPosition : public PositionModel {
 public:
  ImportedPosition(LatticeVectors displacements, std::string note)
      : displacements_(std::move(displacements)), note_(std::move(note)) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return displacements_.valueAt(p_tracked_m);
  }
  bool covers(const Eigen::Vector3d& p_tracked_m) const override { return displacements_.covers(p_tracked_m); }
  std::string note() const override { return note_; }
  nlohmann::json parameters() const override {
    nlohmann::json json = displacements_.toJson();
    json["note"] = note_;
    return json;
  }

 private:
  LatticeVectors displacements_;
  std::string note_;
};

class ImportedOrientation : public OrientationModel {
 public:
  explicit ImportedOrientation(LatticeVectors turns) : turns_(std::move(turns)) {}

  Eigen::Quaterniond correct(const Eigen::Vector3d& p_tracked_m, const Eigen::Quaterniond& q_tracked) const override {
    return rotationFromVector(turns_.valueAt(p_tracked_m)) * q_tracked;
  }
  bool covers(const Eigen::Vector3d& p_tracked_m) const override { return turns_.covers(p_tracked_m); }
  nlohmann::json parameters() const override { return turns_.toJson(); }

 private:
  LatticeVectors turns_;
};

template <class Model>
Result<std::unique_ptr<Model>> fitNothing(const FitData&, const Settings&, const RunControl&) {
  return fail(ErrorCode::kUnsupported,
              "An imported correction came from another program and cannot be fitted; choose a method of the list");
}

}  // namespace

Eigen::Vector3d LatticeVectors::stepsTo(const Eigen::Vector3d& p_m) const {
  return (axes.transpose() * (p_m - origin_m)).cwiseQuotient(pitch_m);
}

std::array<LatticeVectors::Corner, 8> LatticeVectors::cornersAt(const Eigen::Vector3d& steps) const {
  std::array<std::size_t, 3> cell;
  std::array<double, 3> u;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double t = std::clamp(steps[static_cast<Eigen::Index>(axis)], 0.0, double(counts[axis] - 1));
    const double lower = std::min(std::floor(t), double(counts[axis] - 2));
    cell[axis] = static_cast<std::size_t>(lower);
    u[axis] = t - lower;
  }
  const std::size_t row = static_cast<std::size_t>(counts[0]);
  const std::size_t layer = row * static_cast<std::size_t>(counts[1]);
  std::array<Corner, 8> corners;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::size_t a = corner & 1U, b = corner >> 1U & 1U, c = corner >> 2U;
    corners[corner].point = cell[0] + a + row * (cell[1] + b) + layer * (cell[2] + c);
    corners[corner].weight = (a ? u[0] : 1.0 - u[0]) * (b ? u[1] : 1.0 - u[1]) * (c ? u[2] : 1.0 - u[2]);
  }
  return corners;
}

bool LatticeVectors::covers(const Eigen::Vector3d& p_m) const {
  const Eigen::Vector3d steps = stepsTo(p_m);
  for (int axis = 0; axis < 3; ++axis)
    if (!(steps[axis] >= -kOnFace && steps[axis] <= counts[static_cast<std::size_t>(axis)] - 1 + kOnFace)) return false;
  const auto counts_there = [&](const Corner& corner) { return inside[corner.point] != 0 || corner.weight <= kOnFace; };
  return inside.empty() || std::ranges::all_of(cornersAt(steps), counts_there);
}

Eigen::Vector3d LatticeVectors::valueAt(const Eigen::Vector3d& p_m) const {
  const Eigen::Vector3d steps = stepsTo(p_m);
  if (!steps.allFinite()) return steps;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  for (const auto& [point, weight] : cornersAt(steps))
    value += weight * Eigen::Vector3f::Map(&values[3 * point]).cast<double>();
  return value;
}

nlohmann::json LatticeVectors::toJson() const {
  nlohmann::json json = {{"origin_m", jsonOf(origin_m)},
                         {"axes", jsonOf(Eigen::MatrixXd(axes))},
                         {"pitch_m", jsonOf(pitch_m)},
                         {"counts", counts},
                         {"values_base64", toBase64(littleEndianBytes(values))}};
  if (!inside.empty()) json["inside_base64"] = toBase64(inside);
  return json;
}

LatticeVectors LatticeVectors::fromJson(const JsonReader& json) {
  LatticeVectors lattice;
  lattice.origin_m = json["origin_m"].vector3();
  lattice.axes = json["axes"].matrix3();
  lattice.pitch_m = json["pitch_m"].vector3();
  lattice.counts = json["counts"].integers3();
  const auto in_range = [](int count) { return count >= 2 && count <= static_cast<int>(kMostImportedPoints); };
  if (!std::all_of(lattice.counts.begin(), lattice.counts.end(), in_range) ||
      double(lattice.counts[0]) * lattice.counts[1] * lattice.counts[2] > double(kMostImportedPoints) ||
      !(lattice.pitch_m.minCoeff() > 0.0) ||
      !(lattice.axes.transpose() * lattice.axes).isApprox(Eigen::Matrix3d::Identity(), 1e-6))
    json.fail("needs orthonormal axes, pitches above 0, counts of 2 and more along each axis and at most " +
              std::to_string(kMostImportedPoints) + " points in all.");
  const auto bytes = fromBase64(json["values_base64"].text());
  if (!bytes || bytes->size() != 3 * sizeof(float) * pointCount(lattice.counts))
    json["values_base64"].refuse("base64 text of three numbers a point");
  lattice.values = fromLittleEndianBytes(*bytes);
  if (!std::all_of(lattice.values.begin(), lattice.values.end(), [](float value) { return std::isfinite(value); }))
    json["values_base64"].refuse("finite numbers only");
  if (const auto inside = json.find("inside_base64")) {
    const auto read = fromBase64(inside->text());
    if (!read || read->size() != pointCount(lattice.counts)) inside->refuse("base64 text of one byte a point");
    lattice.inside = *read;
  }
  return lattice;
}

std::unique_ptr<PositionModel> makeImportedPosition(LatticeVectors displacements, std::string note) {
  return std::make_unique<ImportedPosition>(std::move(displacements), std::move(note));
}

std::unique_ptr<OrientationModel> makeImportedOrientation(LatticeVectors turns) {
  return std::make_unique<ImportedOrientation>(std::move(turns));
}

std::unique_ptr<PositionModel> readImportedPosition(const JsonReader& parameters) {
  return makeImportedPosition(LatticeVectors::fromJson(parameters), parameters["note"].text());
}

std::unique_ptr<OrientationModel> readImportedOrientation(const JsonReader& parameters) {
  return makeImportedOrientation(LatticeVectors::fromJson(parameters));
}

PositionMethod importedPosition() {
  return {.id = "imported",
          .label = "Imported lattice",
          .source = "Another program's lattice of displacements",
          .settings = {},
          .fit = fitNothing<PositionModel>,
          .read = readImportedPosition,
          .origin = MethodOrigin::kLater};
}

OrientationMethod importedOrientation() {
  return {.id = "imported",
          .label = "Imported lattice",
          .source = "Another program's lattice of rotations",
          .settings = {},
          .fit = fitNothing<OrientationModel>,
          .read = readImportedOrientation,
          .origin = MethodOrigin::kLater};
}

}  // namespace fieldtrue::correctors
