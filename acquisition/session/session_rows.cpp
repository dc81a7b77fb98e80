#include "acquisition/session/session_rows.h"

#include <algorithm>
#include <limits>

namespace fieldtrue::acquisition {

namespace {

constexpr double kNoTimes_s = -1.0;

void append(QVariantList& values, const Pose& pose) {
  const Eigen::Quaterniond& q = pose.orientation;
  for (const double part :
       {pose.position_m.x(), pose.position_m.y(), pose.position_m.z(), q.w(), q.x(), q.y(), q.z()}) {
    values << part;
  }
}

QVariantList takeValues(const Node& mean, double autocorrelation, double quantum_m) {
  QVariantList values{mean.sensor};
  Pose pose = mean.tracker_from_sensor;
  if (!mean.has_orientation) pose.orientation.coeffs().setZero();
  append(values, pose);
  const Eigen::Matrix3d c = mean.covariance_m2.value_or(Eigen::Matrix3d::Zero());
  for (const double part : {c(0, 0), c(1, 1), c(2, 2), c(0, 1), c(0, 2), c(1, 2), mean.sd_rot_rad.value_or(0.0),
                            autocorrelation, mean.n_effective, quantum_m}) {
    values << part;
  }
  const bool has_times = mean.t_start_s && mean.t_end_s;
  values << mean.n_used << mean.n_rejected << (has_times ? *mean.t_start_s : 0.0)
         << (has_times ? *mean.t_end_s : kNoTimes_s);
  return values;
}

/// SQLite keeps a NaN as NULL.
double number(const QSqlQuery& row, int column) {
  return row.isNull(column) ? std::numeric_limits<double>::quiet_NaN() : row.value(column).toDouble();
}

Pose readPose(const QSqlQuery& row, int first) {
  Pose pose;
  pose.position_m = {number(row, first), number(row, first + 1), number(row, first + 2)};
  pose.orientation = Eigen::Quaterniond(number(row, first + 3), number(row, first + 4), number(row, first + 5),
                                        number(row, first + 6));
  return pose;
}

}  // namespace

QVariantList placeValues(const PlannedPlace& place) {
  QVariantList values{place.node, place.visit};
  for (std::size_t axis = 0; axis < 3; ++axis) values << (place.index ? QVariant((*place.index)[axis]) : QVariant());
  append(values, place.reference_from_sensor);
  values << (place.role == NodeRole::kValidation ? QStringLiteral("validation") : QStringLiteral("fit"));
  return values;
}

PlannedPlace readPlace(const QSqlQuery& row, int first) {
  PlannedPlace place;
  place.node = row.value(first).toInt();
  place.visit = row.value(first + 1).toInt();
  if (!row.isNull(first + 2)) {
    place.index = {row.value(first + 2).toInt(), row.value(first + 3).toInt(), row.value(first + 4).toInt()};
  }
  place.reference_from_sensor = readPose(row, first + 5);
  place.role = row.value(first + 12).toString() == QLatin1String("validation") ? NodeRole::kValidation : NodeRole::kFit;
  return place;
}

QVariantList takeValues(const std::vector<Sample>& samples, const NodeStatistics& statistics) {
  FT_CHECK(!samples.empty());
  Node mean;
  mean.sensor = samples.front().sensor;
  setStatistics(mean, statistics);
  const auto [first, last] = std::minmax_element(samples.begin(), samples.end(),
                                                 [](const auto& a, const auto& b) { return a.time_s < b.time_s; });
  mean.t_start_s = first->time_s;
  mean.t_end_s = last->time_s;
  return takeValues(mean, statistics.autocorrelation, statistics.quantum_m);
}

QVariantList takeValues(const Node& mean) { return takeValues(mean, 0.0, 0.0); }

void readTake(const QSqlQuery& row, int first, Node& node) {
  node.sensor = row.value(first).toInt();
  node.tracker_from_sensor = readPose(row, first + 1);
  node.has_orientation = !node.tracker_from_sensor.orientation.coeffs().isZero(0.0);
  if (!node.has_orientation) node.tracker_from_sensor.orientation.setIdentity();
  const auto value = [&](int offset) { return row.value(first + offset).toDouble(); };
  Eigen::Matrix3d covariance;
  covariance << value(8), value(11), value(12), value(11), value(9), value(13), value(12), value(13), value(10);
  // Tables hold SDs. The square of the rounded root is what they read back, and so what every reader of a session gets.
  covariance.diagonal() = covariance.diagonal().cwiseSqrt().cwiseAbs2().eval();
  // A take has at least its floor.
  if (!covariance.isZero(0.0)) node.covariance_m2 = covariance;
  if (value(14) > 0.0) node.sd_rot_rad = value(14);
  node.n_effective = value(16);
  node.n_used = row.value(first + 18).toInt();
  node.n_rejected = row.value(first + 19).toInt();
  if (value(21) < value(20)) return;
  node.t_start_s = value(20);
  node.t_end_s = value(21);
}

QVariantList sampleValues(const Sample& sample) {
  QVariantList values{sample.sensor, sample.time_s};
  append(values, sample.tracker_from_sensor);
  values << QString::fromStdString(sample.status);
  return values;
}

Sample readSample(const QSqlQuery& row, int first) {
  Sample sample;
  sample.sensor = row.value(first).toInt();
  sample.time_s = row.value(first + 1).toDouble();
  sample.tracker_from_sensor = readPose(row, first + 2);
  sample.status = row.value(first + 9).toString().toStdString();
  return sample;
}

}  // namespace fieldtrue::acquisition
