#include "calib/evaluation/sensor_scores.h"

#include <cmath>
#include <map>
#include <optional>

#include "calib/core/number_text.h"
#include "calib/correctors/base/method_text.h"
#include "calib/evaluation/base/figures.h"
#include "calib/evaluation/folds.h"
#include "calib/evaluation/place_scores.h"
#include "calib/tables/table_sensors.h"

namespace fieldtrue::evaluation {

namespace {

/// Sums of squared errors of each place over its sensors, and how many there are.
class PlaceSquares {
 public:
  void add(const SensorScore& score) {
    for (std::size_t k = 0; k < score.places.size(); ++k) {
      Sum& sum = of_place_[score.places[k]];
      sum.squares += score.place_errors[k] * score.place_errors[k];
      ++sum.count;
    }
  }
  std::vector<double> rms() const {
    std::vector<double> values;
    for (const auto& [place, sum] : of_place_) values.push_back(std::sqrt(sum.squares / sum.count));
    return values;
  }

 private:
  struct Sum {
    double squares = 0.0;
    int count = 0;
  };
  std::map<int, Sum> of_place_;
};

std::string splitText(const SensorSplit& split) {
  const std::string figures = "corrected by itself, each sensor leaves " + errorText(split.separate_mm) +
                              " mm, with the correction that all share " + errorText(split.shared_mm) +
                              " mm (difference " + significantText(split.separate_less_shared_mm.low90) + " to " +
                              significantText(split.separate_less_shared_mm.high90) + " mm)";
  return split.is_better ? "The sensors err differently: " + figures + "; fit each with --sensor N."
                         : "The sensors share one correction: " + figures + ".";
}

}  // namespace

std::vector<SensorScore> scoresBySensor(std::span<const Node> nodes, std::span<const RowScore> scores, bool is_tuned) {
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
    score.stats = errorStats(score.place_errors, is_tuned);
    all.push_back(std::move(score));
  }
  return all;
}

Result<std::optional<SensorSplit>> splitOf(const Comparison& comparison, const CalibrationTable& table,
                                           const ComparisonOptions& options, const RunControl& control) {
  if (!comparison.best_position_row) return std::nullopt;
  const MethodScore& best = comparison.position[*comparison.best_position_row];
  if (best.sensors.empty()) return std::nullopt;
  ComparisonOptions alone = options;
  FT_TRY(const MethodText method, parseMethodText(correctors::methodText(best.method, best.settings)));
  alone.position_methods = {method};
  alone.orientation_methods = {{"none", {}}};
  alone.validation = comparison.validation;
  alone.align = comparison.align;
  alone.with_surroundings = false;
  PlaceSquares shared, separate;
  for (const SensorScore& together : best.sensors) {
    FT_TRY(const auto rows, rowsOfSensor(table, together.sensor));
    const auto compared = compareMethods(rows, alone, control);
    if (!compared && compared.error().code == ErrorCode::kCancelled) return tl::unexpected(compared.error());
    // A sensor that cannot be corrected by itself leaves nothing to choose.
    if (!compared || compared->position.front().skipped) return std::nullopt;
    shared.add(together);
    separate.add({together.sensor, compared->places, compared->position.front().place_errors, {}});
  }
  const std::vector<double> shared_mm = shared.rms(), separate_mm = separate.rms();
  if (shared_mm.size() != separate_mm.size()) return std::nullopt;
  SensorSplit split;
  split.shared_mm = rootMeanSquare(shared_mm);
  split.separate_mm = rootMeanSquare(separate_mm);
  split.separate_less_shared_mm = pairedDifference(separate_mm, shared_mm);
  split.is_better = split.separate_less_shared_mm.high90 < 0.0;
  split.text = splitText(split);
  return split;
}

}  // namespace fieldtrue::evaluation
