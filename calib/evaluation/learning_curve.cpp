#include "calib/evaluation/learning_curve.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>

#include "calib/calibration/alignment.h"
#include "calib/calibration/coincident_places.h"
#include "calib/core/statistics.h"
#include "calib/evaluation/base/index_source.h"
#include "calib/evaluation/base/intervals.h"
#include "calib/evaluation/base/progress_meter.h"
#include "calib/evaluation/held_out.h"
#include "calib/evaluation/held_out_job.h"
#include "calib/evaluation/place_scores.h"

namespace fieldtrue::evaluation {
namespace {

constexpr std::array<double, 5> kShares = {0.125, 0.25, 0.5, 0.75, 1.0};
constexpr std::size_t kDraws = 5;
constexpr std::size_t kCostlyDraws = 2;

void shuffle(std::vector<int>& places, IndexSource& source) {
  for (std::size_t i = places.size(); i > 1; --i) std::swap(places[i - 1], places[source.below(i)]);
}

/// The places that no fit sees, and those that fits may draw from.
struct HeldOutPlaces {
  std::vector<int> scored;
  std::vector<int> pool;
};

/// Validation places where the job has them, else a random fifth.
HeldOutPlaces splitPlaces(const HeldOutJob& job) {
  if (job.validation.kind == ValidationKind::kRole)
    return {placesOf(rowsOf(job, job.scored)), placesOf(rowsOf(job, job.fitted))};
  std::vector<int> places = placesOf(job.nodes);
  IndexSource source(job.seed);
  shuffle(places, source);
  const auto n_scored = static_cast<std::ptrdiff_t>(std::max<std::size_t>(1, places.size() / 5));
  return {{places.begin(), places.begin() + n_scored}, {places.begin() + n_scored, places.end()}};
}

/// Takes places from the pool at whose true position another sensor is scored.
void leaveSharedOut(HeldOutPlaces& places, std::span<const Node> nodes) {
  std::set<int> near;
  const auto shared = calibration::placesSharedBySensors(nodes);
  for (const int place : places.scored)
    if (const auto found = shared.find(place); found != shared.end())
      near.insert(found->second.begin(), found->second.end());
  std::erase_if(places.pool, [&](int place) { return near.contains(place); });
}

/// Rows that are fitted to and rows that are scored, of one draw.
struct Draw {
  std::size_t point = 0;
  std::vector<std::size_t> fitted;
};

/// Growing parts of the pool, each drawn several times; the whole pool only once.
std::vector<Draw> drawParts(const HeldOutJob& job, const std::vector<int>& pool, std::vector<LearningPoint>& points) {
  IndexSource source(job.seed + 1);
  std::vector<Draw> draws;
  for (const double share : kShares) {
    const auto n_places = static_cast<std::size_t>(std::lround(share * static_cast<double>(pool.size())));
    if (n_places == 0 || (!points.empty() && points.back().n_places == static_cast<int>(n_places))) continue;
    points.push_back({static_cast<int>(n_places)});
    for (std::size_t d = 0; d < (n_places == pool.size() ? 1 : kDraws); ++d) {
      std::vector<int> order = pool;
      shuffle(order, source);
      const std::set<int> drawn(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(n_places));
      Draw draw{points.size() - 1, {}};
      for (const std::size_t row : job.fitted)
        if (drawn.contains(job.nodes[row].node)) draw.fitted.push_back(row);
      draws.push_back(std::move(draw));
    }
  }
  return draws;
}

/// RMS of one candidate fitted to one draw; none where the draw is too little for it.
std::optional<double> heldOutRms(const HeldOutJob& job, const Candidate& candidate, const Draw& draw,
                                 const std::vector<Node>& scored, const std::vector<int>& places, int dimension,
                                 const RunControl& control) {
  const std::vector<Node> fitted = rowsOf(job, draw.fitted);
  const auto alignment = alignmentOf(job, fitted);
  if (!alignment) return std::nullopt;
  correctors::FitData data = calibration::makeFitData(fitted, job.metadata, *alignment);
  if (data.dimension == 2) data.dimension = dimension;
  const auto model = candidate.fit(data, control);
  if (!model) return std::nullopt;
  return rootMeanSquare(gatherByPlace(places, scored, scoreRows(scored, *alignment, model->score)).errors);
}

LearningCurve curveOf(const Candidate& candidate, std::vector<LearningPoint> points, const std::vector<Draw>& draws,
                      const std::vector<std::optional<double>>& rms) {
  LearningCurve curve{candidate.id, candidate.settings, {}};
  for (std::size_t p = 0; p < points.size(); ++p) {
    std::vector<double> values;
    bool is_enough = true;
    for (std::size_t d = 0; d < draws.size(); ++d) {
      if (draws[d].point != p) continue;
      const std::size_t n_wanted = candidate.is_costly ? kCostlyDraws : kDraws;
      if (values.size() >= n_wanted) continue;
      is_enough = is_enough && rms[d].has_value();
      if (rms[d]) values.push_back(*rms[d]);
    }
    if (!is_enough || values.empty()) continue;
    points[p].low = *std::min_element(values.begin(), values.end());
    points[p].high = *std::max_element(values.begin(), values.end());
    points[p].rms = median(values);
    curve.points.push_back(points[p]);
  }
  return curve;
}

}  // namespace

Result<std::vector<LearningCurve>> learningCurves(const CalibrationTable& table, const ComparisonOptions& options,
                                                  const RunControl& control) {
  ComparisonOptions position_only = options;
  position_only.orientation_methods = {{"none", {}}};
  FT_TRY(auto job, makeJob(table, position_only));
  job.candidates.pop_back();
  HeldOutPlaces split = splitPlaces(job);
  leaveSharedOut(split, job.nodes);
  const std::set<int> is_scored(split.scored.begin(), split.scored.end());
  std::vector<Node> scored;
  for (const std::size_t row : job.scored)
    if (is_scored.contains(job.nodes[row].node)) scored.push_back(job.nodes[row]);
  const std::vector<Node> all = rowsOf(job, job.fitted);
  FT_TRY(const auto alignment, alignmentOf(job, all));
  const int dimension = calibration::makeFitData(all, job.metadata, alignment).dimension;

  std::vector<LearningPoint> points;
  const std::vector<Draw> draws = drawParts(job, split.pool, points);
  const std::size_t n_candidates = job.candidates.size();
  std::vector<std::vector<std::optional<double>>> rms(n_candidates, std::vector<std::optional<double>>(draws.size()));
  RunControl inner;
  inner.stop = control.stop;
  ProgressMeter meter(control.progress, 0.0, 1.0, static_cast<double>(n_candidates * draws.size()));
  // The largest draws first: no thread is then left with a long fit at the end.
  control.parallel_for(n_candidates * draws.size(), [&](std::size_t task) {
    const std::size_t d = draws.size() - 1 - task / n_candidates;
    const std::size_t i = task % n_candidates;
    const Candidate& candidate = job.candidates[i];
    const bool is_wanted = !candidate.is_costly || draws[d].point + 1 == points.size() || d % kDraws < kCostlyDraws;
    if (is_wanted && !control.stop.stop_requested())
      rms[i][d] = heldOutRms(job, candidate, draws[d], scored, split.scored, dimension, inner);
    meter.add(1.0);
  });
  if (control.stop.stop_requested()) return comparisonStopped();
  std::vector<LearningCurve> curves;
  for (std::size_t i = 0; i < n_candidates; ++i) curves.push_back(curveOf(job.candidates[i], points, draws, rms[i]));
  return curves;
}

nlohmann::json toJson(const LearningCurve& curve) {
  nlohmann::json points = nlohmann::json::array();
  for (const LearningPoint& point : curve.points)
    points.push_back(
        {{"places", point.n_places}, {"rms_mm", point.rms}, {"low_mm", point.low}, {"high_mm", point.high}});
  return {{"method", curve.method}, {"settings", fieldtrue::toJson(curve.settings)}, {"points", std::move(points)}};
}

}  // namespace fieldtrue::evaluation
