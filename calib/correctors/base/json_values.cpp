#include "calib/correctors/base/json_values.h"

namespace fieldtrue::correctors {

nlohmann::json jsonOf(const Eigen::Vector3d& v) { return nlohmann::json::array({v.x(), v.y(), v.z()}); }

nlohmann::json jsonOf(const Eigen::Quaterniond& q) { return nlohmann::json::array({q.w(), q.x(), q.y(), q.z()}); }

nlohmann::json jsonOf(const Pose& pose) {
  return {{"t_m", jsonOf(pose.position_m)}, {"q_wxyz", jsonOf(pose.orientation)}};
}

nlohmann::json jsonOf(const Eigen::MatrixXd& matrix) {
  nlohmann::json rows = nlohmann::json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    nlohmann::json row = nlohmann::json::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(matrix(i, j));
    rows.push_back(std::move(row));
  }
  return rows;
}

void throwMalformed(const std::string& message) {
  throw nlohmann::json::other_error::create(599, message, static_cast<const nlohmann::json*>(nullptr));
}

namespace {

void needArray(const nlohmann::json& json, std::size_t size) {
  if (!json.is_array() || json.size() != size)
    throwMalformed("an array of " + std::to_string(size) + " numbers is needed, got " + json.dump().substr(0, 60));
}

}  // namespace

Eigen::Vector3d vectorFrom(const nlohmann::json& json) {
  needArray(json, 3);
  return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

Eigen::Quaterniond quaternionFrom(const nlohmann::json& json) {
  needArray(json, 4);
  const Eigen::Quaterniond q(json[0].get<double>(), json[1].get<double>(), json[2].get<double>(),
                             json[3].get<double>());
  // Not normalised here: that could change the last bit, and what was written is unit already.
  if (std::abs(q.norm() - 1.0) > 1e-6) throwMalformed("a unit quaternion is needed, got " + json.dump());
  return q;
}

Pose poseFrom(const nlohmann::json& json) { return {vectorFrom(json.at("t_m")), quaternionFrom(json.at("q_wxyz"))}; }

Eigen::MatrixXd matrixFrom(const nlohmann::json& json, Eigen::Index columns) {
  if (!json.is_array()) throwMalformed("an array of rows is needed, got " + json.dump().substr(0, 60));
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(json.size()), columns);
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    const nlohmann::json& row = json[static_cast<std::size_t>(i)];
    needArray(row, static_cast<std::size_t>(columns));
    for (Eigen::Index j = 0; j < columns; ++j) matrix(i, j) = row[static_cast<std::size_t>(j)].get<double>();
  }
  return matrix;
}

}  // namespace fieldtrue::correctors
