#include "calib/importers/averaging.h"

#include <cstdio>
#include <map>
#include <tuple>

namespace fieldtrue::importers {

namespace {

std::string noteOn(const NodeStatistics& statistics, const std::string& place, std::size_t n_samples) {
  char figures[128];
  std::snprintf(figures, sizeof figures, ", autocorrelation %.2f, worth %.1f independent samples",
                statistics.autocorrelation, statistics.n_effective);
  std::string note =
      place + ": " + std::to_string(statistics.n_used) + " of " + std::to_string(n_samples) + " samples used" + figures;
  for (const Rejection& rejection : statistics.rejections) {
    note += (&rejection == &statistics.rejections.front() ? "; rejected: sample " : ", sample ") +
            std::to_string(rejection.sample + 1) + " " + rejection.text;
  }
  return note;
}

}  // namespace

void markMissing(Sample& sample) {
  const Eigen::Vector3d& p_m = sample.tracker_from_sensor.position_m;
  if (sample.status.empty() && isMissingMark(p_m.cwiseAbs().maxCoeff())) sample.status = "missing";
}

Result<AveragedNodes> averageRows(std::span<const SampleRow> rows, const AveragingOptions& options,
                                  bool has_orientation, const std::string& place_word) {
  std::map<std::tuple<int, int, int>, std::vector<Sample>> takes;
  for (const SampleRow& row : rows) {
    if (row.node >= 0) takes[{row.node, row.sample.sensor, row.visit}].push_back(row.sample);
  }
  AveragedNodes averaged;
  for (const auto& [key, samples] : takes) {
    Node node;
    std::tie(node.node, node.sensor, node.visit) = key;
    node.has_orientation = has_orientation;
    const std::string place = place_word + " " + std::to_string(node.node);
    const Result<NodeStatistics> statistics = averageSamples(samples, options);
    if (!statistics) return fail(statistics.error().code, place + ": " + statistics.error().message);
    setStatistics(node, *statistics);
    node.t_start_s = samples.front().time_s;
    node.t_end_s = samples.back().time_s;
    averaged.nodes.push_back(node);
    averaged.notes.push_back(noteOn(*statistics, place, samples.size()));
  }
  return averaged;
}

}  // namespace fieldtrue::importers
