#pragma once

#include <optional>
#include <string>
#include <vector>

#include "acquisition/sampling/node_sampler.h"

namespace fieldtrue::acquisition {

/// Collects one take of one place of every sensor on the jig, each by a sampler of its own. Pure, as they are.
///
/// It is done when each of them is. The jig is rigid: what one sensor sees of its motion makes all start over, those
/// too that had enough: until the last one has, they go on watching. The time limit counts for all from the first
/// sample of any, so that one that is silent ends the take too.
class TakeSampler {
 public:
  struct OfSensor {
    int sensor = 0;
    NodeSampler sampler;
  };

  explicit TakeSampler(const SamplerOptions& options = {}) : options_(options) {}
  /// Begins a take. @param sensors the leading one first; empty = they are not known yet: start again when they are
  void start(const std::vector<int>& sensors);
  void cancel();
  /// Samples of other sensors are passed over.
  TakeState add(const Sample& sample);
  /// A reading of a jig that has not come to rest: no sensor takes it for a sample.
  TakeState passOver(const Sample& sample);
  TakeState passTime(double time_s);

  /// Of one that is held, as of each sensor's (NodeSampler).
  bool canKeep() const;
  void keep();
  void waitLonger();

  TakeState state() const;
  const std::vector<OfSensor>& ofSensors() const { return of_sensors_; }
  const NodeSampler* of(int sensor) const;  ///< Null where it takes no part.
  int collected() const { return farthestBehind().collected(); }
  int wanted() const { return farthestBehind().wanted(); }
  int restarts() const { return farthestBehind().restarts(); }
  /// Why it restarted, failed or is held: of each sensor that did, by its number where there are several.
  std::string message() const;
  /// A reason as it is told of one sensor: by its number where there are several.
  std::string told(const OfSensor& one, const std::string& reason) const;

 private:
  const NodeSampler& farthestBehind() const;
  /// Nothing came of any sensor for so long that the jig may have been anywhere: all begin again.
  void beginAgainAfterGap(double time_s);

  SamplerOptions options_;
  bool runs_ = false;
  NodeSampler none_{options_};  ///< Stands for those that are not known yet.
  std::vector<OfSensor> of_sensors_;
  std::optional<double> newest_s_;  ///< Of any sensor.
  double longest_step_s_ = 0.0;     ///< From reading to reading.
};

}  // namespace fieldtrue::acquisition
