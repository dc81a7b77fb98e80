#pragma once

#include <QString>
#include <QTemporaryDir>
#include <array>
#include <vector>

#include "acquisition/session/session_store.h"
#include "tests/support/synthetic.h"

namespace fieldtrue::testing {

/// The program's settings and data are in a folder of the test's own.
inline void keepIn(const QTemporaryDir& folder) {
  qputenv("XDG_DATA_HOME", folder.path().toUtf8());
  qputenv("XDG_CONFIG_HOME", folder.path().toUtf8());
}

/// A session with every place of a bent room taken.
inline void makeTakenSession(const QString& path, std::array<int, 3> counts) {
  SyntheticOptions options;
  options.counts = counts;
  options.smooth_distortion_m = 0.02;
  acquisition::Plan plan;
  plan.counts = counts;
  plan.pitch_m = options.pitch_m;
  plan.origin_m = options.origin_m;
  auto store = acquisition::SessionStore::create(path, plan, syntheticTable(options).metadata);
  if (!store) qFatal("%s", store.error().message.c_str());
  for (std::size_t place = 0; place < store->places().size(); ++place) {
    NodeStatistics statistics;
    statistics.mean = syntheticReading(options, store->places()[place].reference_from_sensor);
    statistics.covariance_m2 = 1e-8 * Eigen::Matrix3d::Identity();
    statistics.n_used = 2;
    statistics.n_effective = 2.0;
    std::vector<Sample> samples(2);
    for (Sample& sample : samples) sample.tracker_from_sensor = statistics.mean;
    if (!store->storeTake(place, {{samples, statistics}}, {})) qFatal("not stored");
  }
}

}  // namespace fieldtrue::testing
