#include "calib/evaluation/candidate.h"

#include <algorithm>
#include <map>
#include <utility>

#include "calib/calibration/alignment.h"
#include "calib/core/units.h"
#include "calib/correctors/base/method.h"
#include "calib/tables/table_sensors.h"

namespace fieldtrue::evaluation {
namespace {

RowScore positionScore(const Eigen::Vector3d& p_corrected_m, const Node& node,
                       const calibration::Alignment& alignment) {
  RowScore score;
  score.residual_m = alignment.reference_from_tracker * p_corrected_m - node.reference_from_sensor.position_m;
  score.error = 1000.0 * score.residual_m.norm();
  return score;
}

RowScore orientationScore(const Eigen::Quaterniond& q_corrected, const Node& node,
                          const calibration::Alignment& alignment) {
  const Eigen::Quaterniond reference_from_mount =
      alignment.reference_from_tracker.orientation * q_corrected * alignment.mountOf(node.sensor);
  RowScore score;
  score.error = kDegPerRad * angleBetween_rad(reference_from_mount, node.reference_from_sensor.orientation);
  return score;
}

RowScore scoreOf(const correctors::PositionModel& model, const Node& node, const calibration::Alignment& alignment) {
  const Eigen::Vector3d& p_tracked_m = node.tracker_from_sensor.position_m;
  const bool covered = model.covers(p_tracked_m);
  Eigen::Vector3d p_true_m = p_tracked_m;
  if (covered)
    p_true_m +=
        node.has_orientation ? model.displacementAt_m(node.tracker_from_sensor) : model.displacement_m(p_tracked_m);
  RowScore score = positionScore(p_true_m, node, alignment);
  score.covered = covered;
  return score;
}

RowScore scoreOf(const correctors::OrientationModel& model, const Node& node, const calibration::Alignment& alignment) {
  const Pose& tracked = node.tracker_from_sensor;
  const bool covered = model.covers(tracked.position_m);
  const Eigen::Quaterniond q_true =
      covered ? model.correct(tracked.position_m, tracked.orientation) : tracked.orientation;
  RowScore score = orientationScore(q_true, node, alignment);
  score.covered = covered;
  return score;
}

double evaluateOnce(const correctors::PositionModel& model, const Pose& tracked) {
  return model.displacementAt_m(tracked).x();
}

double evaluateOnce(const correctors::OrientationModel& model, const Pose& tracked) {
  return model.correct(tracked.position_m, tracked.orientation).w();
}

template <class Model>
FittedCandidate fittedCandidate(std::unique_ptr<Model> owned) {
  const std::shared_ptr<const Model> model = std::move(owned);
  return {
      [model](const Node& node, const calibration::Alignment& alignment) { return scoreOf(*model, node, alignment); },
      [model](const Node& node) {
        return model->covers(node.tracker_from_sensor.position_m) ? evaluateOnce(*model, node.tracker_from_sensor)
                                                                  : 0.0;
      },
      model->note(), model->coefficients()};
}

template <class Model>
FitsWithout fitsWithout(std::unique_ptr<correctors::HoldOutFits<Model>> owned) {
  const std::shared_ptr<const correctors::HoldOutFits<Model>> fits = std::move(owned);
  return {[fits](std::span<const std::size_t> rows, const Pose& fold_from_data) {
            return fits->without(rows, fold_from_data).map(fittedCandidate<Model>);
          },
          fits->ownVariance()};
}

template <class Model>
Candidate makeCandidate(const correctors::CorrectionMethod<Model>& method, Settings settings) {
  Candidate candidate;
  candidate.id = method.id;
  candidate.settings = settings;
  candidate.is_position = std::is_same_v<Model, correctors::PositionModel>;
  candidate.is_costly = method.isCostly();
  candidate.is_tuned = method.tunes(settings);
  if (method.holdsOutExactly(settings) || (method.hold_out && candidate.is_tuned))
    candidate.hold_out = [&method, settings](const correctors::FitData& data, const RunControl& control) {
      return method.hold_out(data, settings, control).map(fitsWithout<Model>);
    };
  candidate.holds_out = [&method, settings](const correctors::FitData& data) {
    return method.canHoldOut(data, settings);
  };
  candidate.fit = [&method, settings = std::move(settings)](const correctors::FitData& data,
                                                            const RunControl& control) {
    return method.fit(data, settings, control).map(fittedCandidate<Model>);
  };
  return candidate;
}

template <class Model>
Result<std::vector<Candidate>> makeCandidates(
    const std::vector<MethodText>& methods, std::span<const correctors::CorrectionMethod<Model>> registry,
    Result<const correctors::CorrectionMethod<Model>*> (*find)(std::string_view)) {
  std::vector<MethodText> wanted = methods;
  if (wanted.empty())
    for (const correctors::CorrectionMethod<Model>& method : registry) wanted.push_back({method.id, {}});
  std::vector<Candidate> candidates;
  for (const MethodText& text : wanted) {
    FT_TRY(const auto method, find(text.id));
    FT_TRY(auto settings, resolveSettings(text.id, method->settings, text.given));
    candidates.push_back(makeCandidate(*method, std::move(settings)));
  }
  return candidates;
}

correctors::FitData dataOfSensor(int sensor, std::span<const Node> rows, const TableMetadata& metadata,
                                 const calibration::Alignment& alignment, int dimension) {
  correctors::FitData data = calibration::makeFitData(nodesOfSensor(rows, sensor), metadata, alignment);
  if (data.dimension == 2) data.dimension = dimension;
  return data;
}

std::string whose(int sensor) { return "Sensor " + std::to_string(sensor) + ": "; }

tl::unexpected<Error> ofSensor(int sensor, const Error& error) {
  return fail(error.code, whose(sensor) + error.message);
}

/// One model of several sensors; rows of one that has none are the first's.
Result<FittedCandidate> joined(std::map<int, FittedCandidate> fits) {
  if (fits.empty()) return fail(ErrorCode::kTooFewNodes, "There are no rows to fit");
  FittedCandidate all;
  for (const auto& [sensor, fitted] : fits) {
    all.coefficients += fitted.coefficients;
    if (!fitted.note.empty()) all.note += (all.note.empty() ? "" : " ") + fitted.note;
  }
  const auto shared = std::make_shared<const std::map<int, FittedCandidate>>(std::move(fits));
  const auto of = [shared](const Node& node) -> const FittedCandidate& {
    const auto found = shared->find(node.sensor);
    return found == shared->end() ? shared->begin()->second : found->second;
  };
  all.score = [of](const Node& node, const calibration::Alignment& by) { return of(node).score(node, by); };
  all.evaluate = [of](const Node& node) { return of(node).evaluate(node); };
  return all;
}

}  // namespace

Result<std::vector<Candidate>> positionCandidates(const std::vector<MethodText>& methods) {
  return makeCandidates<correctors::PositionModel>(methods, correctors::positionMethods(),
                                                   correctors::findPositionMethod);
}

Result<std::vector<Candidate>> orientationCandidates(const std::vector<MethodText>& methods) {
  return makeCandidates<correctors::OrientationModel>(methods, correctors::orientationMethods(),
                                                      correctors::findOrientationMethod);
}

Result<FittedCandidate> fitSensorsApart(const Candidate& candidate, std::span<const Node> rows,
                                        const TableMetadata& metadata, const calibration::Alignment& alignment,
                                        int dimension, const RunControl& control) {
  std::map<int, FittedCandidate> fits;
  for (const int sensor : sensorsOf(rows)) {
    auto fitted = candidate.fit(dataOfSensor(sensor, rows, metadata, alignment, dimension), control);
    if (!fitted) return ofSensor(sensor, fitted.error());
    if (!fitted->note.empty()) fitted->note = whose(sensor) + fitted->note;
    fits.emplace(sensor, *std::move(fitted));
  }
  return joined(std::move(fits));
}

Result<FitsWithout> holdOutSensorsApart(const Candidate& candidate, std::span<const Node> rows,
                                        const TableMetadata& metadata, const calibration::Alignment& alignment,
                                        int dimension, const RunControl& control) {
  std::map<int, FitsWithout> fits;
  std::map<int, std::size_t> n_rows;
  std::vector<std::pair<int, std::size_t>> sensor_and_row;  // Of each row, and which of that sensor's rows it is.
  for (const Node& node : rows) sensor_and_row.emplace_back(node.sensor, n_rows[node.sensor]++);
  double own_variance = 0.0;
  for (const auto& [sensor, n] : n_rows) {
    const correctors::FitData data = dataOfSensor(sensor, rows, metadata, alignment, dimension);
    if (!candidate.holds_out(data)) return fail(ErrorCode::kUnsupported, "There is no closed form for these rows");
    auto of_sensor = candidate.hold_out(data, control);
    if (!of_sensor) return ofSensor(sensor, of_sensor.error());
    own_variance = std::max(own_variance, of_sensor->own_variance);
    fits.emplace(sensor, *std::move(of_sensor));
  }
  const auto without = [fits = std::move(fits), n_rows = std::move(n_rows), sensor_and_row = std::move(sensor_and_row)](
                           std::span<const std::size_t> out, const Pose& fold_from_data) -> Result<FittedCandidate> {
    std::map<int, std::vector<std::size_t>> out_of_sensor;
    for (const std::size_t row : out) out_of_sensor[sensor_and_row[row].first].push_back(sensor_and_row[row].second);
    std::map<int, FittedCandidate> models;
    for (const auto& [sensor, of_sensor] : fits) {
      if (out_of_sensor[sensor].size() == n_rows.at(sensor)) continue;  // As in fits anew, of the sensors with rows.
      auto model = of_sensor.fit(out_of_sensor[sensor], fold_from_data);
      if (!model) return ofSensor(sensor, model.error());
      models.emplace(sensor, *std::move(model));
    }
    return joined(std::move(models));
  };
  return FitsWithout{without, own_variance};
}

RowScore alignedPositionScore(const Node& node, const calibration::Alignment& alignment) {
  return positionScore(node.tracker_from_sensor.position_m, node, alignment);
}

RowScore alignedOrientationScore(const Node& node, const calibration::Alignment& alignment) {
  return orientationScore(node.tracker_from_sensor.orientation, node, alignment);
}

}  // namespace fieldtrue::evaluation
