#include "calib/identify/unnamed.h"

#include <algorithm>
#include <numeric>
#include <optional>

namespace fieldtrue::identify {
namespace {

constexpr std::size_t kMostRows = 500;

std::vector<std::size_t> allOf(std::size_t n) {
  std::vector<std::size_t> rows(n);
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  return rows;
}

/// What a row's noise is multiplied by, so that one that stands far out under the law of the residuals counts as it
/// does there.
double inflation(const Eigen::Vector3d& left, const ResidualLaw& law) {
  return std::max(1.0, (law.degrees_of_freedom + left.squaredNorm()) / (law.degrees_of_freedom + 3.0));
}

}  // namespace

std::vector<FieldPoint> fieldPoints(const GapSearch& search, const GapAlignment& alignment) {
  const GapRows& rows = search.physics().rows();
  const std::vector<field::SensorSetting> settings = search.physics().settings(alignment);
  std::vector<FieldPoint> points;
  for (std::size_t i = 0; i < settings.size(); ++i)
    points.push_back(
        {settings[i].tracker_from_sensor.position_m, settings[i].tracker_from_sensor.orientation, rows.rows[i].time_s});
  return points;
}

Eigen::VectorXd noiseVariances(const GapSearch& search, bool rotation) {
  const GapRows& rows = search.physics().rows();
  const std::span<const Vector6d> left = search.noiseLeft();
  const int first = rotation ? 3 : 0;
  Eigen::VectorXd variances(static_cast<Eigen::Index>(rows.rows.size()));
  for (Eigen::Index i = 0; i < variances.size(); ++i) {
    const auto row = static_cast<std::size_t>(i);
    const Matrix6d noise = noiseOf(rows.rows[row], search.placingSd_m(), search.placingSd_rad());
    variances[i] = noise.block<3, 3>(first, first).trace() / 3.0 * inflation(left[row].segment<3>(first), search.law());
  }
  return variances;
}

UnnamedRival::UnnamedRival(const GapSearch& search)
    : rows_(search.physics().rows()),
      points_(fieldPoints(search, search.none().model.alignment)),
      variance_m2_(noiseVariances(search, false)),
      variance_rad2_(noiseVariances(search, true)),
      parts_{rows_.several_orientations, rows_.has_times} {}

Eigen::MatrixX3d UnnamedRival::valuesOf(std::span<const Vector6d> residuals, std::span<const std::size_t> rows,
                                        bool rotation) const {
  Eigen::MatrixX3d values(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Vector6d& r = residuals[rows[k]];
    values.row(static_cast<Eigen::Index>(k)) = rotation ? r.tail<3>() : r.head<3>();
  }
  return values;
}

Eigen::VectorXd UnnamedRival::variancesOf(std::span<const std::size_t> rows, bool rotation) const {
  const Eigen::VectorXd& all = rotation ? variance_rad2_ : variance_m2_;
  Eigen::VectorXd some(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t k = 0; k < rows.size(); ++k)
    some[static_cast<Eigen::Index>(k)] = all[static_cast<Eigen::Index>(rows[k])];
  return some;
}

std::vector<FieldPoint> UnnamedRival::pointsOf(std::span<const std::size_t> rows) const {
  std::vector<FieldPoint> some;
  for (const std::size_t row : rows) some.push_back(points_[row]);
  return some;
}

UnnamedLaws UnnamedRival::likeliestLaws(std::span<const Vector6d> residuals) const {
  const std::vector<std::size_t> rows = allOf(points_.size());
  UnnamedLaws laws;
  laws.position = likeliestLaw(points_, valuesOf(residuals, rows, false), variance_m2_, parts_);
  if (rows_.has_orientation)
    laws.rotation = likeliestLaw(points_, valuesOf(residuals, rows, true), variance_rad2_, parts_);
  return laws;
}

double UnnamedRival::logEvidence(std::span<const Vector6d> residuals, const UnnamedLaws& laws) const {
  const std::vector<std::size_t> rows = evenChoice(points_.size(), kMostRows);
  const auto of = [&](bool rotation) {
    return SmoothField(pointsOf(rows), valuesOf(residuals, rows, rotation), variancesOf(rows, rotation),
                       rotation ? laws.rotation : laws.position)
        .logEvidence();
  };
  const double sum = of(false) + (rows_.has_orientation ? of(true) : 0.0);
  return sum * static_cast<double>(points_.size()) / static_cast<double>(rows.size());
}

std::vector<Vector6d> UnnamedRival::foretold(const UnnamedLaws& laws, std::span<const Vector6d> residuals) const {
  const std::vector<std::size_t> some = evenChoice(points_.size(), kMostRows);
  std::vector<Vector6d> values(points_.size(), Vector6d::Zero());
  for (const bool rotation : {false, true}) {
    const SmoothLaw& law = rotation ? laws.rotation : laws.position;
    if (law.isNothing() || (rotation && !rows_.has_orientation)) continue;
    const SmoothField field(pointsOf(some), valuesOf(residuals, some, rotation), variancesOf(some, rotation), law);
    for (std::size_t i = 0; i < points_.size(); ++i) values[i].segment<3>(rotation ? 3 : 0) = field.at(points_[i]);
  }
  return values;
}

void UnnamedRival::takeAway(std::span<const UnnamedLaws> laws, std::span<const char> used,
                            std::vector<Vector6d>& residuals) const {
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < used.size(); ++i)
    if (used[i] != 0) known.push_back(i);
  std::vector<std::size_t> some;
  for (const std::size_t k : evenChoice(known.size(), kMostRows)) some.push_back(known[k]);
  for (const bool rotation : {false, true}) {
    if (rotation && !rows_.has_orientation) continue;
    std::optional<SmoothField> field;
    for (const UnnamedLaws& law : laws) {
      SmoothField tried(pointsOf(some), valuesOf(residuals, some, rotation), variancesOf(some, rotation),
                        rotation ? law.rotation : law.position);
      if (!field || tried.logEvidence() > field->logEvidence()) field = std::move(tried);
    }
    for (std::size_t i = 0; i < used.size() && field; ++i)
      if (used[i] == 0) residuals[i].segment<3>(rotation ? 3 : 0) -= field->at(points_[i]);
  }
}

}  // namespace fieldtrue::identify
