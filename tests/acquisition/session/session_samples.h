#pragma once

#include <cmath>
#include <random>

#include "acquisition/session/session_store.h"

namespace fieldtrue::testing {

inline constexpr int kSamples = 60;

inline acquisition::Plan smallPlan() {
  acquisition::Plan plan;
  plan.counts = {3, 2, 2};
  plan.pitch_m = {0.3, 0.3, 0.3};
  return plan;
}

inline TableMetadata fullMetadata() {
  TableMetadata metadata;
  metadata.frame = "room";
  metadata.tracker = "Fastrak \"one\"";
  metadata.rig = "wooden jig";
  metadata.date = "2024-05-01";
  metadata.excitation = "ac";
  metadata.carrier_hz = 10016.0;
  metadata.rate_hz = 120.0;
  metadata.quantum_m = 1e-5;
  metadata.jig_tolerance_m = 0.0007;
  metadata.jig_tolerance_rad = 0.002;
  metadata.alignment_known = true;
  metadata.alignment_tolerance_m = 0.001;
  metadata.alignment_tolerance_rad = 0.003;
  metadata.other = {{"operator", "Zoë"}, {"room", "cellar"}};
  return metadata;
}

/// Samples that tell which take they are: `take` is their x in metres. Every tenth carries an error status.
inline std::vector<Sample> samplesOf(int take) {
  std::mt19937_64 random(static_cast<std::uint64_t>(take) + 7);
  std::normal_distribution<double> noise(0.0, 1e-4);
  std::vector<Sample> samples;
  for (int n = 0; n < kSamples; ++n) {
    Sample sample;
    sample.time_s = take + n / 120.0;
    sample.sensor = 1;
    sample.tracker_from_sensor.position_m = {take + noise(random), noise(random), noise(random)};
    sample.tracker_from_sensor.orientation = rotationFromVector({noise(random), 0.2, noise(random)});
    if (n % 10 == 9) sample.status = "k";
    samples.push_back(sample);
  }
  samples.back().tracker_from_sensor.position_m.x() = std::nan("");
  return samples;
}

/// A new session of the small plan.
inline acquisition::SessionStore newStore(const QString& path) {
  auto store = acquisition::SessionStore::create(path, smallPlan(), fullMetadata());
  if (!store) qFatal("%s", store.error().message.c_str());
  return *std::move(store);
}

inline acquisition::SessionStore opened(const QString& path) {
  auto store = acquisition::SessionStore::open(path);
  if (!store) qFatal("%s", store.error().message.c_str());
  return *std::move(store);
}

inline Result<void> storeTake(acquisition::SessionStore& store, std::size_t place, int take,
                              const std::string& suspicious = {}) {
  const std::vector<Sample> samples = samplesOf(take);
  return store.storeTake(place, {{samples, averageSamples(samples).value()}}, suspicious);
}

inline bool sameSamples(const std::vector<Sample>& a, const std::vector<Sample>& b) {
  const auto same = [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](const Sample& x, const Sample& y) {
    const Pose &p = x.tracker_from_sensor, &q = y.tracker_from_sensor;
    return x.time_s == y.time_s && x.sensor == y.sensor && x.status == y.status &&
           same(p.position_m.x(), q.position_m.x()) && same(p.position_m.y(), q.position_m.y()) &&
           same(p.position_m.z(), q.position_m.z()) && p.orientation.coeffs() == q.orientation.coeffs();
  });
}

}  // namespace fieldtrue::testing
