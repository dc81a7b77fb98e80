#include "calib/evaluation/sensor_scores.h"

#include <map>
#include <utility>

#include "calib/evaluation/folds.h"
#include "calib/evaluation/place_scores.h"

namespace fieldtrue::evaluation {

std::vector<SensorScore> scoresBySensor(std::span<const Node> nodes, std::span<const RowScore> scores,
                                        const FitFreedom& freedom) {
  struct Rows {
    std::vector<Node> nodes;
    std::vector<RowScore> scores;
  };
  std::map<int, Rows> by_sensor;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    Rows& rows = by_sensor[nodes[i].sensor];
    rows.nodes.push_back(nodes[i]);
    rows.scores.push_back(scores[i]);
  }
  std::vector<SensorScore> all;
  if (by_sensor.size() < 2) return all;
  for (const auto& [sensor, rows] : by_sensor) {
    SensorScore score;
    score.sensor = sensor;
    score.places = placesOf(rows.nodes);
    score.place_errors = gatherByPlace(score.places, rows.nodes, rows.scores).errors;
    score.stats = errorStats(score.place_errors, freedom);
    all.push_back(std::move(score));
  }
  return all;
}

}  // namespace fieldtrue::evaluation
