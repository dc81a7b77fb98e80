// The C++ face of Fieldtrue's runtime: C++11, header only over fieldtrue_runtime.h.
#ifndef FIELDTRUE_RUNTIME_HPP
#define FIELDTRUE_RUNTIME_HPP

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "fieldtrue_runtime.h"

namespace fieldtrue_runtime {

using Pose = fieldtrue_pose;

/// What fieldtrue_error says, thrown.
class Failure : public std::runtime_error {
 public:
  explicit Failure(fieldtrue_status status) : std::runtime_error(fieldtrue_error()), status_(status) {}
  fieldtrue_status status() const { return status_; }

 private:
  fieldtrue_status status_;
};

/// Owns a calibration. Any number of threads may use one.
class Calibration {
 public:
  /// Reads a file. @throws Failure
  explicit Calibration(const std::string& path) { check(fieldtrue_load(path.c_str(), &calibration_)); }
  static Calibration fromMemory(const std::string& text, const std::string& name) {
    fieldtrue_calibration* made = nullptr;
    check(fieldtrue_load_memory(text.data(), text.size(), name.c_str(), &made));
    return Calibration(made);
  }
  Calibration(Calibration&& other) noexcept : calibration_(other.calibration_) { other.calibration_ = nullptr; }
  Calibration& operator=(Calibration&& other) noexcept {
    std::swap(calibration_, other.calibration_);
    return *this;
  }
  Calibration(const Calibration&) = delete;
  Calibration& operator=(const Calibration&) = delete;
  ~Calibration() { fieldtrue_free(calibration_); }

  /// The same on a dense lattice. @throws Failure
  Calibration baked(double max_deviation_um = 50.0, double max_angle_deg = 0.01) const {
    fieldtrue_calibration* made = nullptr;
    check(fieldtrue_bake(calibration_, max_deviation_um, max_angle_deg, &made));
    return Calibration(made);
  }

  /// One sensor's alone, for uncertainty_m and isInside where each sensor has a correction of its own. @throws Failure
  Calibration ofSensor(int sensor) const {
    fieldtrue_calibration* made = nullptr;
    check(fieldtrue_of_sensor(calibration_, sensor, &made));
    return Calibration(made);
  }

  Pose correct(const Pose& tracked, int sensor = FIELDTRUE_FIRST_SENSOR) const {
    Pose corrected;
    fieldtrue_correct(calibration_, sensor, &tracked, &corrected);
    return corrected;
  }
  std::vector<Pose> correct(const std::vector<Pose>& tracked, int sensor = FIELDTRUE_FIRST_SENSOR) const {
    std::vector<Pose> corrected(tracked.size());
    fieldtrue_correct_many(calibration_, sensor, tracked.data(), corrected.data(), tracked.size());
    return corrected;
  }
  double uncertainty_m(const Pose& tracked) const { return fieldtrue_uncertainty_m(calibration_, &tracked); }
  bool isInside(const Pose& tracked) const { return fieldtrue_inside(calibration_, tracked.position_m) != 0; }
  double nearestOrientation_deg(const Pose& tracked) const {
    return fieldtrue_nearest_orientation_deg(calibration_, tracked.orientation_wxyz);
  }
  bool takesOrientation() const { return fieldtrue_takes_orientation(calibration_) != 0; }
  /// Empty where the file does not tell.
  std::string fact(const std::string& key) const {
    const char* text = fieldtrue_fact(calibration_, key.c_str());
    return text == nullptr ? std::string() : std::string(text);
  }
  const fieldtrue_calibration* get() const { return calibration_; }

 private:
  explicit Calibration(fieldtrue_calibration* calibration) : calibration_(calibration) {}
  static void check(fieldtrue_status status) {
    if (status != FIELDTRUE_OK) throw Failure(status);
  }

  fieldtrue_calibration* calibration_ = nullptr;
};

}  // namespace fieldtrue_runtime
#endif
