#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "acquisition/emulators/pose_source.h"
#include "calib/simulation/simulator.h"

namespace fieldtrue::acquisition {

/// How the emulated operator carries the jig.
struct OperatorHabits {
  double travel_s = 1.0;    ///< From one place to the next.
  double tremor_m = 0.004;  ///< Amplitude of the hand's tremor while carrying.
  double tremor_rad = 0.01;
  double tremor_hz = 8.0;
  double settle_s = 0.15;  ///< Time constant with which the tremor dies once the jig stands.
};

/// Carries the jig from place to place on a smooth path, sets it down with the rig's placing error, and lets go.
class VirtualOperator {
 public:
  /// @param rig placing tolerances; @param resting reference_from_sensor where the jig stands at first
  VirtualOperator(const simulation::RigModel& rig, const OperatorHabits& habits, const Pose& resting,
                  std::uint64_t seed);
  /// Sends the operator to a place. Sent where the jig is already going, nothing changes; sent again where it stands,
  /// it is lifted and set down anew.
  /// @param place reference_from_sensor as the rig says
  void guideTo(const Pose& place, double time_s);
  /// Where the sensor truly is: reference_from_sensor.
  Pose poseAt(double time_s) const;
  /// Whether the jig has been set down and the tremor has died to less than a micrometre.
  bool standing(double time_s) const;

 private:
  Pose placed(const Pose& place);

  simulation::RigModel rig_;
  OperatorHabits habits_;
  std::mt19937_64 random_;
  Pose asked_, from_, to_;
  double start_s_ = 0.0;
  double phase_[6] = {};
  bool relifted_ = false;
  bool moved_ = false;
};

/// The tracker of a scene with a jig in the hands of a virtual operator.
class SimulatedJig : public PoseSource {
 public:
  /// @param sensors on the jig, 4 cm apart along its y; the operator carries the first to the places
  SimulatedJig(simulation::TrackerSimulator simulator, const OperatorHabits& habits, std::uint64_t seed,
               int sensors = 1);
  void guideTo(const Pose& reference_from_sensor, double time_s);
  /// Lets the operator walk through places in a circle, standing a while at each, as long as nobody guides.
  void wander(std::vector<Pose> places, double stand_s);
  const VirtualOperator& virtualOperator() const { return operator_; }
  const simulation::Scene& scene() const { return simulator_.scene(); }

  unsigned sensors() const override;
  std::optional<double> due_s(std::uint64_t cycle, int active) const override;
  std::vector<Sample> read(std::uint64_t cycle, std::span<const int> sensors, double time_s) override;
  std::vector<Sample> readNow(std::span<const int> sensors, double time_s) override;

 private:
  void walk(double time_s);

  simulation::TrackerSimulator simulator_;
  VirtualOperator operator_;
  int sensors_;
  std::vector<Pose> tour_;
  double stand_s_ = 3.0;
  double leg_s_ = 4.0;
  std::size_t next_stop_ = 0;
};

}  // namespace fieldtrue::acquisition
