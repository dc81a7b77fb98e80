#pragma once

#include <QDateTime>
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "acquisition/session/acquisition_controller.h"

namespace fieldtrue::testing {

inline constexpr double kRate_hz = 120.0;

/// A tracker whose every reading is the test's: the jig is carried, set down and unplugged by calls.
class FakeTracker : public acquisition::TrackerDevice {
 public:
  Pose reference_from_tracker{{0.1, -0.2, 0.05}, rotationFromVector({0.0, 0.0, 0.3})};
  Pose true_pose{{-1.0, -1.0, -1.0}, Eigen::Quaterniond::Identity()};
  std::vector<Pose> guided;
  QString tracker_name = QStringLiteral("fake");
  std::vector<std::string> names;  ///< Of the sensors, where it tells them.
  /// A sensor on the jig.
  struct OnJig {
    Pose jig_from_sensor;
    double noise_m = 1e-4;  ///< Bounded: nothing of it is ever an outlier.
    bool is_plugged = true;
    bool lies_in_room = false;  ///< Where it was taken off the jig, and not carried along.
    std::uint64_t every = 1;    ///< Of so many readings it makes one.
  };
  std::map<int, OnJig> on_jig{{0, {}}};
  double rate_hz = kRate_hz;

  void start() override { emit stateChanged(acquisition::DeviceState::kRunning, "running"); }
  void stop() override {}
  void guideTo(const Pose& pose) override { guided.push_back(pose); }
  TableMetadata describe() const override {
    TableMetadata metadata;
    metadata.tracker = tracker_name.toStdString();
    metadata.rate_hz = kRate_hz;
    for (std::size_t i = 0; i < names.size(); ++i) metadata.other["fake_sensor_" + std::to_string(i + 1)] = names[i];
    return metadata;
  }

  void restartClock() { n_ = 0; }
  /// Time in which nothing is sent.
  void pass(double seconds) { n_ += static_cast<std::uint64_t>(seconds * rate_hz); }
  void send(const Pose& pose, const std::string& status = {}) {
    const double time_s = static_cast<double>(n_++) / rate_hz;
    std::vector<Sample> samples;
    for (const auto& [number, sensor] : on_jig) {
      if (!sensor.is_plugged || n_ % sensor.every != 0) continue;
      const Pose at = sensor.lies_in_room ? sensor.jig_from_sensor : pose * sensor.jig_from_sensor;
      Sample sample{time_s, number, inverse(reference_from_tracker) * at, status};
      for (double& x : sample.tracker_from_sensor.position_m) x += sensor.noise_m * uniform_(random_);
      samples.push_back(sample);
    }
    emit samplesReceived(samples);
  }
  void stand(double seconds, const std::string& status = {}) {
    for (int n = 0; n < seconds * rate_hz; ++n) send(true_pose, status);
  }
  void carryTo(const Pose& place, double seconds = 0.8) {
    const Pose from = true_pose;
    const int steps = static_cast<int>(seconds * rate_hz);
    for (int n = 1; n <= steps; ++n) {
      const double s = n / double(steps);
      true_pose = {from.position_m + s * (place.position_m - from.position_m), place.orientation};
      send(true_pose);
    }
  }
  /// Carried there, and at rest for as long as it takes to see that.
  void setDownAt(const Pose& place) {
    carryTo(place);
    stand(0.6);
  }
  void lose() { emit stateChanged(acquisition::DeviceState::kFailed, "The cable was pulled."); }
  void comeBack() {
    restartClock();
    emit stateChanged(acquisition::DeviceState::kRunning, "running");
  }

 private:
  std::uint64_t n_ = 0;
  std::mt19937_64 random_{5};
  std::uniform_real_distribution<double> uniform_{-1.0, 1.0};
};

inline acquisition::Plan planOf(std::array<int, 3> counts) {
  acquisition::Plan plan;
  plan.counts = counts;
  plan.pitch_m = {0.3, 0.3, 0.3};
  return plan;
}

/// One controller with its fake tracker and everything it said.
struct Bench {
  explicit Bench(const QString& path, const acquisition::Plan& plan = planOf({3, 3, 2}), bool create = true,
                 double after_s = 0.0)
      : now(QDateTime({2024, 2, 29}, {12, 0}).toUTC().addMSecs(std::llround(1000.0 * after_s))) {
    controller.setWallClock([this] { return now; });
    QObject::connect(&controller, &acquisition::AcquisitionController::nodesStored,
                     [this](int place, const std::vector<Node>& rows, const QString& suspicious) {
                       stored.push_back(place);
                       nodes.insert(nodes.end(), rows.begin(), rows.end());
                       suspicions << suspicious;
                     });
    QObject::connect(&controller, &acquisition::AcquisitionController::takeFailed,
                     [this](const QString& text) { take_failures << text; });
    QObject::connect(&controller, &acquisition::AcquisitionController::takeRefused,
                     [this](int place, double) { refused.push_back(place); });
    QObject::connect(&controller, &acquisition::AcquisitionController::failed,
                     [this](const QString& text) { failures << text; });
    QObject::connect(&controller, &acquisition::AcquisitionController::deviceFailed,
                     [this](const QString& text) { device_failures << text; });
    QObject::connect(&controller, &acquisition::AcquisitionController::remarked,
                     [this](const QString& text) { remarks << text; });
    QObject::connect(&controller, &acquisition::AcquisitionController::deviceBack, [this] { ++n_back; });
    QObject::connect(&controller, &acquisition::AcquisitionController::finished, [this] { ++n_finished; });
    QObject::connect(&controller, &acquisition::AcquisitionController::sessionOpened,
                     [this](const QString&, const QString& page, const QString& plan_json) {
                       opened_page = page;
                       opened_plan = plan_json;
                     });
    QObject::connect(&controller, &acquisition::AcquisitionController::tablesReady,
                     [this](const CalibrationTable& nodes_now, const SampleTable& samples_now) {
                       table = nodes_now;
                       samples = samples_now;
                     });
    auto device = std::make_unique<FakeTracker>();
    tracker = device.get();
    controller.adoptDevice(std::move(device));
    controller.openSession(path, create ? QString::fromStdString(toJson(plan).dump()) : QString());
  }
  Pose placePose(std::size_t place) const {
    return controller.status().session->places.at(place).reference_from_sensor;
  }
  /// Carries the jig to the current place and takes it as an operator does with the space bar.
  void takeHere() {
    tracker->setDownAt(placePose(*controller.status().current));
    controller.take();
    tracker->stand(0.51);
  }
  void readTables() { controller.requestTables(); }
  /// Rows of the sample table that belong to a place.
  std::size_t readingsAtPlaces() const {
    return static_cast<std::size_t>(
        std::count_if(samples.rows.begin(), samples.rows.end(), [](const SampleRow& row) { return row.node >= 0; }));
  }

  QDateTime now;  ///< What the wall clock says: it stands still unless it is set.
  acquisition::AcquisitionController controller;
  FakeTracker* tracker = nullptr;
  std::vector<int> stored, refused;
  std::vector<Node> nodes;
  QStringList suspicions, take_failures, failures, device_failures, remarks;
  int n_finished = 0, n_back = 0;
  QString opened_page, opened_plan;
  CalibrationTable table;
  SampleTable samples;
};

}  // namespace fieldtrue::testing
