#include "calib/identify/shared_field.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/identify/unnamed.h"

namespace fieldtrue::identify {
namespace {

constexpr double kFreeSd = 0.1;  ///< Of a refitted alignment, metres or radians: so wide that it says nothing.

double logDeterminant(const Eigen::LLT<Eigen::MatrixXd>& factor) {
  return 2.0 * factor.matrixLLT().diagonal().array().log().sum();
}

/// Columns of one vector that the rows of one group have in common, turned by each row or not.
void addFree(FieldReadings& readings, const std::vector<Eigen::Matrix3d>& by_row) {
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::MatrixX3d column(static_cast<Eigen::Index>(by_row.size()), 3);
    for (std::size_t i = 0; i < by_row.size(); ++i)
      column.row(static_cast<Eigen::Index>(i)) = by_row[i].col(axis).transpose();
    readings.free.push_back(std::move(column));
  }
}

/// v -> v x p as a matrix.
Eigen::Matrix3d crossWith(const Eigen::Vector3d& p) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, p.z(), -p.y(), -p.z(), 0.0, p.x(), p.y(), -p.x(), 0.0;
  return matrix;
}

void addAlignment(const GapSearch& search, const GapAlignment& alignment, bool rotation, FieldReadings& readings) {
  const GapRows& rows = search.physics().rows();
  const std::vector<field::SensorSetting> settings = search.physics().settings(alignment);
  std::vector<Eigen::Matrix3d> same(readings.size(), Eigen::Matrix3d::Identity());
  addFree(readings, same);
  if (!rotation) {
    std::vector<Eigen::Matrix3d> turned;
    for (const FieldPoint& point : readings.points) turned.push_back(crossWith(point.place_m));
    addFree(readings, turned);
  }
  if (!rows.several_orientations) return;
  for (std::size_t sensor = 0; sensor < rows.sensors.size(); ++sensor) {
    std::vector<Eigen::Matrix3d> mount;
    for (std::size_t i = 0; i < settings.size(); ++i) {
      const bool own = rows.rows[i].sensor == sensor;
      mount.push_back(own ? settings[i].tracker_from_sensor.orientation.toRotationMatrix() : Eigen::Matrix3d::Zero());
    }
    addFree(readings, mount);
  }
}

/// Of the readings of one component, alignments apart; the lower half alone.
Eigen::MatrixXd covarianceOf(const FieldReadings& readings, const SharedLaw& law,
                             const std::optional<ChangeLaw>& change) {
  const auto n = static_cast<Eigen::Index>(readings.size());
  Eigen::MatrixXd K(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto a = static_cast<std::size_t>(i);
    const double factor = law.noiseFactor(readings.is_later[a] != 0);
    for (Eigen::Index j = 0; j <= i; ++j) {
      const auto b = static_cast<std::size_t>(j);
      K(i, j) = covariance(law.field, readings.points[a], readings.points[b]);
      if (i != j && readings.places[a] == readings.places[b])
        K(i, j) += law.rig_share * factor * law.noiseFactor(readings.is_later[b] != 0) *
                   std::sqrt(readings.rig_variances[i] * readings.rig_variances[j]);
      if (change && readings.sees_change[a] != 0 && readings.sees_change[b] != 0)
        K(i, j) += covariance(*change, readings.points[a], readings.points[b]);
    }
    K(i, i) += factor * factor * readings.variances[i];
  }
  return K;
}

}  // namespace

double covariance(const ChangeLaw& law, const FieldPoint& a, const FieldPoint& b) {
  const double apart2 = (a.place_m - law.middle_m).squaredNorm() + (b.place_m - law.middle_m).squaredNorm();
  return covariance(law.field, a, b) * std::exp(-0.5 * apart2 / (law.reach_m * law.reach_m));
}

FieldReadings FieldReadings::only(std::span<const std::size_t> rows) const {
  FieldReadings some;
  some.free_of_earlier = free_of_earlier;
  const auto n = static_cast<Eigen::Index>(rows.size());
  some.values.resize(n, 3);
  some.variances.resize(n);
  some.rig_variances.resize(n);
  some.free.assign(free.size(), Eigen::MatrixX3d(n, 3));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto from = static_cast<Eigen::Index>(rows[k]);
    const auto to = static_cast<Eigen::Index>(k);
    some.points.push_back(points[rows[k]]);
    some.places.push_back(places[rows[k]]);
    some.is_later.push_back(is_later[rows[k]]);
    some.sees_change.push_back(sees_change[rows[k]]);
    some.values.row(to) = values.row(from);
    some.variances[to] = variances[from];
    some.rig_variances[to] = rig_variances[from];
    for (std::size_t c = 0; c < free.size(); ++c) some.free[c].row(to) = free[c].row(from);
  }
  return some;
}

FieldReadings readingsOf(const GapSearch& search, const GapAlignment& alignment, bool rotation) {
  const GapRows& rows = search.physics().rows();
  FieldReadings readings;
  readings.points = fieldPoints(search, alignment);
  readings.variances = noiseVariances(search, rotation);
  const auto n = static_cast<Eigen::Index>(readings.size());
  const double placing = rotation ? search.placingSd_rad() : search.placingSd_m();
  readings.rig_variances = Eigen::VectorXd::Constant(n, placing * placing).cwiseMin(readings.variances);
  readings.is_later.assign(readings.size(), 0);
  readings.sees_change.assign(readings.size(), 0);
  readings.values.resize(n, 3);
  const std::vector<Vector6d> residuals = search.physics().residuals({alignment, {}});
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    readings.places.push_back(static_cast<int>(rows.rows[i].place));
    readings.values.row(static_cast<Eigen::Index>(i)) = residuals[i].segment<3>(rotation ? 3 : 0).transpose();
  }
  addAlignment(search, alignment, rotation, readings);
  return readings;
}

FieldReadings joined(const FieldReadings& earlier, const FieldReadings& later, std::span<const int> places_of_later) {
  FieldReadings both = earlier;
  both.free_of_earlier = earlier.free.size();
  both.points.insert(both.points.end(), later.points.begin(), later.points.end());
  both.places.insert(both.places.end(), places_of_later.begin(), places_of_later.end());
  both.is_later.insert(both.is_later.end(), later.size(), char{1});
  both.sees_change = both.is_later;
  const auto a = static_cast<Eigen::Index>(earlier.size());
  const auto b = static_cast<Eigen::Index>(later.size());
  const auto stack = [&](auto& to, const auto& below) {
    to.conservativeResize(a + b, Eigen::NoChange);
    to.bottomRows(b) = below;
  };
  stack(both.values, later.values);
  stack(both.variances, later.variances);
  stack(both.rig_variances, later.rig_variances);
  for (Eigen::MatrixX3d& column : both.free) stack(column, Eigen::MatrixX3d::Zero(b, 3));
  for (const Eigen::MatrixX3d& column : later.free) {
    Eigen::MatrixX3d own = Eigen::MatrixX3d::Zero(a + b, 3);
    own.bottomRows(b) = column;
    both.free.push_back(std::move(own));
  }
  return both;
}

SharedField::SharedField(const FieldReadings& readings, const SharedLaw& law, const std::optional<ChangeLaw>& change)
    : readings_(readings), law_(law), change_(change) {
  factor_.compute(covarianceOf(readings, law, change));
  if (factor_.info() == Eigen::Success) {
    refit();
    return;
  }
  log_evidence_ = -std::numeric_limits<double>::infinity();
  weights_ = Eigen::MatrixX3d::Zero(static_cast<Eigen::Index>(readings.size()), 3);
  refitted_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(readings.free.size()));
}

void SharedField::refit() {
  const auto n = static_cast<Eigen::Index>(readings_.size());
  const auto columns = static_cast<Eigen::Index>(readings_.free.size());
  Eigen::MatrixXd right(n, 3 + 3 * columns);
  right.leftCols<3>() = readings_.values;
  for (Eigen::Index c = 0; c < columns; ++c)
    right.middleCols<3>(3 + 3 * c) = readings_.free[static_cast<std::size_t>(c)];
  const Eigen::MatrixXd solved = factor_.solve(right);
  Eigen::MatrixXd A = Eigen::MatrixXd::Identity(columns, columns) / (kFreeSd * kFreeSd);
  Eigen::VectorXd b(columns);
  for (Eigen::Index c = 0; c < columns; ++c) {
    const auto own = right.middleCols<3>(3 + 3 * c);
    b[c] = own.cwiseProduct(solved.leftCols<3>()).sum();
    for (Eigen::Index d = 0; d < columns; ++d) A(c, d) += own.cwiseProduct(solved.middleCols<3>(3 + 3 * d)).sum();
  }
  const Eigen::LLT<Eigen::MatrixXd> small(A);
  refitted_ = small.solve(b);
  weights_ = solved.leftCols<3>();
  for (Eigen::Index c = 0; c < columns; ++c) weights_ -= refitted_[c] * solved.middleCols<3>(3 + 3 * c);
  const double squares = readings_.values.cwiseProduct(solved.leftCols<3>()).sum() - b.dot(refitted_);
  log_evidence_ = -0.5 * (squares + 3.0 * logDeterminant(factor_) + logDeterminant(small) +
                          2.0 * static_cast<double>(columns) * std::log(kFreeSd) +
                          3.0 * static_cast<double>(n) * std::log(2.0 * std::numbers::pi));
}

Eigen::VectorXd SharedField::sharedWith(const FieldPoint& point, int place) const {
  Eigen::VectorXd with(static_cast<Eigen::Index>(readings_.size()));
  for (std::size_t i = 0; i < readings_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    with[row] = covariance(law_.field, readings_.points[i], point);
    if (readings_.places[i] == place)
      with[row] +=
          law_.rig_share * std::pow(law_.noiseFactor(readings_.is_later[i] != 0), 2) * readings_.rig_variances[row];
  }
  return with;
}

Eigen::Vector3d SharedField::sharedAt(const FieldPoint& point, int place) const {
  return weights_.transpose() * sharedWith(point, place);
}

double SharedField::sharedVarianceAt(const FieldPoint& point, int place) const {
  const Eigen::VectorXd with = sharedWith(point, place);
  const double rig = law_.rig_share * std::pow(law_.noise_factor[0], 2) * readings_.rig_variances.mean();
  return std::max(0.0, covariance(law_.field, point, point) + rig - with.dot(factor_.solve(with)));
}

Eigen::Vector3d SharedField::changeAt(const FieldPoint& point) const {
  Eigen::Vector3d change = Eigen::Vector3d::Zero();
  if (!change_) return change;
  for (std::size_t i = 0; i < readings_.size(); ++i)
    if (readings_.sees_change[i] != 0)
      change +=
          covariance(*change_, readings_.points[i], point) * weights_.row(static_cast<Eigen::Index>(i)).transpose();
  return change;
}

Eigen::ArrayXd SharedField::visibilityOf(const ChangeLaw& change) const {
  const auto n = static_cast<Eigen::Index>(readings_.size());
  Eigen::MatrixXd of_change = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j <= i; ++j)
      if (readings_.sees_change[static_cast<std::size_t>(i)] != 0 &&
          readings_.sees_change[static_cast<std::size_t>(j)] != 0)
        of_change(i, j) = of_change(j, i) = covariance(change, readings_.points[static_cast<std::size_t>(i)],
                                                       readings_.points[static_cast<std::size_t>(j)]);
  const auto L = factor_.matrixL();
  const Eigen::MatrixXd white = L.solve(L.solve(of_change).transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(white, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues().array().max(0.0);
}

}  // namespace fieldtrue::identify
