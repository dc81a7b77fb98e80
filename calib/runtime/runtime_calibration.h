#pragma once

#include <Eigen/Geometry>
#include <map>
#include <string>
#include <vector>

#include "calib/calibration/evaluator.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/core/setup.h"

namespace fieldtrue::runtime {

/// A calibration as programs that apply it hold it: no table, no settings, no fit.
class RuntimeCalibration {
 public:
  /// @error kBadInput for damaged content or a checksum that does not match; kNewerVersion
  static Result<RuntimeCalibration> fromText(const std::string& text, const std::string& name);

  /// With both parts on lattices, the orientation part only where it is costly.
  /// @param max_deviation_m of positions inside the region, positive [m]
  /// @param max_angle_rad of orientations there, positive [rad]
  /// @error kBadInput; kUnsupported when no lattice within the memory allowed stays within the bounds;
  ///        kDegenerate without a region
  Result<RuntimeCalibration> baked(double max_deviation_m, double max_angle_rad) const;

  /// Of one sensor alone. @error as Evaluator::partsOf
  Result<RuntimeCalibration> ofSensor(int sensor) const;

  const calibration::Evaluator& evaluator() const { return evaluator_; }
  const std::vector<Eigen::Quaterniond>& orientationsSeen() const { return orientations_seen_; }
  const Setup& setup() const { return setup_; }
  /// By key; null where the file does not tell.
  const std::string* fact(const std::string& key) const;

 private:
  explicit RuntimeCalibration(calibration::Evaluator evaluator) : evaluator_(std::move(evaluator)) {}
  static RuntimeCalibration fromJson(const JsonReader& content);
  /// What models prepare at their first use is prepared now, so that no thread waits for another later.
  void prepare() const;

  calibration::Evaluator evaluator_;
  std::vector<std::pair<int, Eigen::Vector3d>> places_m_;  ///< Tracked, of the fit, each with its sensor.
  std::vector<Eigen::Quaterniond> orientations_seen_;
  Setup setup_;
  std::map<std::string, std::string> facts_;
};

}  // namespace fieldtrue::runtime
