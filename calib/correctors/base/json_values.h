#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/pose.h"

namespace fieldtrue::correctors {

/// Vectors and matrices as JSON arrays of numbers. A double is written with enough digits to read back to the same
/// bits.
nlohmann::json jsonOf(const Eigen::Vector3d& v);
/// Scalar first: [w, x, y, z].
nlohmann::json jsonOf(const Eigen::Quaterniond& q);
/// {"t_m": [3], "q_wxyz": [4]}
nlohmann::json jsonOf(const Pose& pose);
/// Rows as arrays.
nlohmann::json jsonOf(const Eigen::MatrixXd& matrix);

/// The inverses. They throw nlohmann::json::exception when the JSON has another form: call them inside `guarded`.
Eigen::Vector3d vectorFrom(const nlohmann::json& json);
Eigen::Quaterniond quaternionFrom(const nlohmann::json& json);
Pose poseFrom(const nlohmann::json& json);
/// @param columns how many numbers every row must have
Eigen::MatrixXd matrixFrom(const nlohmann::json& json, Eigen::Index columns);

/// Stops reading with a sentence of our own: thrown as nlohmann does, so that `guarded` turns it into an Error.
[[noreturn]] void throwMalformed(const std::string& message);

/// Runs a reader of JSON and turns what it throws into one sentence.
/// @param what the thing read, e.g. "parameters of hmq"
/// @error kBadInput when the JSON lacks a key or holds a value of another kind
template <class T>
Result<T> guarded(const std::string& what, const std::function<Result<T>()>& read) {
  try {
    return read();
  } catch (const nlohmann::json::exception& e) {
    return fail(ErrorCode::kBadInput, "The " + what + " cannot be read: " + e.what());
  }
}

}  // namespace fieldtrue::correctors
