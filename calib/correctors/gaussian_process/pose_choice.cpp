#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

#include "calib/core/units.h"
#include "calib/correctors/base/fit_memory.h"
#include "calib/correctors/gaussian_process/pose_process.h"
#include "calib/geometry/spacing.h"

namespace fieldtrue::correctors {
namespace {

/// A metal body turns the readings of a sensor that is set down in one orientation, some of them by several degrees;
/// such turns foretell its other errors there, and mislead in every other orientation.
constexpr double kTurnedAlike_rad = 15.0 * kRadPerDeg;
/// Where the rig states one orientation, or none, the tracked ones must tell, which metal turns by tens of degrees.
constexpr double kTrackedAlike_rad = 45.0 * kRadPerDeg;
constexpr double kShareTurnedAlike = 0.9;
constexpr std::size_t kMostPoses = 10000;  // 800 MB for the matrix.
constexpr std::size_t kPositionParameters = PoseLikelihood::kPositionParameters;
constexpr std::size_t kTurnParameters = PoseLikelihood::kParameters - kPositionParameters;
constexpr std::size_t kRowsOfPoseStarts = 200;
constexpr int kPoseStartIterations = 25;
constexpr int kPoseIterations = 40;
constexpr std::size_t kSearchesOfAll = 2;
constexpr std::array<double, 2> kPlainLengths = {0.7, 3.0};  // Of the spread.
constexpr double kLeastScatter = -9.0;                       // log 1e-4, beside what the trend leaves.
constexpr double kRowSd = 3.0;  // Of the logarithm of the rows' own SD about a tenth of what the trend leaves.

/// The weak prior of the part that turns: logarithms of its SD beside the signal's, of its stretch and of its length.
/// And a wall: what coils do is of low degree in the rotation (gains and skew of the second), so that no length is far
/// below a radian. Where only a few orientations were measured the likelihood cannot tell short lengths apart, and by
/// the shortest two readings in one orientation, which field and coils report turned a little differently, would have
/// nothing in common.
struct TurnPrior {
  static constexpr double kLeastLength = -0.7;  ///< log 0.5 [log rad]
  static constexpr double kMostSd = 0.4;        ///< log 1.5, beside what the trend leaves.
  static constexpr double kWallSd = 0.05;       ///< Of all places together.
  static constexpr std::array<double, kTurnParameters> kSd = {2.0, 1.0, 0.7};
  std::array<double, kTurnParameters> middle{};
  double most = 0.0;

  explicit TurnPrior(const WeakPrior& field)
      : middle{field.signal + std::log(0.5), 0.0, std::log(1.5)}, most(field.signal + kMostSd) {}

  /// Minus twice its logarithm. @param gradient added to, unless null
  double add(const double* point, double n_rows, double* gradient) const {
    double value = 0.0;
    for (std::size_t i = 0; i < kTurnParameters; ++i) {
      const double off = (point[i] - middle[i]) / kSd[i];
      value += off * off;
      if (gradient != nullptr) gradient[i] += 2.0 * off / kSd[i];
    }
    const double wall = std::sqrt(n_rows) / kWallSd;
    const double below = wall * std::min(0.0, point[kTurnParameters - 1] - kLeastLength);
    const double above = wall * std::max(0.0, point[0] - most);
    if (gradient != nullptr) {
      gradient[kTurnParameters - 1] += 2.0 * wall * below;
      gradient[0] += 2.0 * wall * above;
    }
    return value + below * below + above * above;
  }
};

/// What both kinds are fitted to while scales are sought.
struct Search {
  const PoseLikelihood& likelihood;
  const WeakPrior& field_prior;
  const TurnPrior& turn_prior;
  const RunControl& control;

  /// Minus twice the logarithm, prior included, per row. @param gradient out, unless null
  std::optional<double> cost(const double* point, std::size_t n_parameters, double* gradient) const {
    const auto n_rows = static_cast<double>(likelihood.size());
    const auto value = likelihood.evaluate({point, n_parameters}, gradient);
    if (!value) return std::nullopt;
    double sum = *value + field_prior.add(point, n_rows, gradient);
    const double off = (point[kFieldParameters] - field_prior.nugget) / kRowSd;
    sum += off * off;
    if (gradient != nullptr) gradient[kFieldParameters] += 2.0 * off / kRowSd;
    // Neither scatter is larger than the errors, nor so small that rounding decides.
    const double wall = std::sqrt(n_rows) / TurnPrior::kWallSd;
    for (const std::size_t scatter : {kFieldParameters - 1, kFieldParameters}) {
      const double inside = std::clamp(point[scatter], field_prior.signal + kLeastScatter, field_prior.signal);
      const double beyond = wall * (point[scatter] - inside);
      sum += beyond * beyond;
      if (gradient != nullptr) gradient[scatter] += 2.0 * wall * beyond;
    }
    if (n_parameters > kPositionParameters)
      sum += turn_prior.add(point + kPositionParameters, n_rows, gradient ? gradient + kPositionParameters : nullptr);
    for (std::size_t k = 0; gradient != nullptr && k < n_parameters; ++k) gradient[k] /= n_rows;
    return sum / n_rows;
  }

  std::optional<Optimum> from(std::span<const double> start, int iterations) const {
    return minimise([&](const double* point, double* gradient) { return cost(point, start.size(), gradient); }, start,
                    iterations, control);
  }
};

std::vector<double> logarithmsOf(const GaussianProcessScales& scales) {
  return {std::log(scales.length_m.x()), std::log(scales.length_m.y()), std::log(scales.length_m.z()),
          std::log(scales.signal_sd_m),  std::log(scales.nugget_sd_m),  std::log(scales.nugget_sd_m)};
}

/// Starts of poses from the best of position alone: what turns as large as half the residual, and smoother in space; as
/// large as what position left unexplained.
std::vector<std::vector<double>> startsOf(const std::vector<double>& position, const WeakPrior& prior) {
  std::vector<std::vector<double>> starts;
  const double unexplained = position[kFieldParameters];
  const std::array<std::array<double, kTurnParameters>, 3> turns = {
      {{prior.signal + std::log(0.5), 0.0, std::log(1.2)},
       {prior.signal, std::log(3.0), std::log(3.0)},
       {std::max(unexplained, prior.signal + std::log(0.05)), 0.0, std::log(1.0)}}};
  for (const auto& turn : turns) {
    starts.push_back(position);
    starts.back()[kFieldParameters] = unexplained - std::log(3.0);
    starts.back().insert(starts.back().end(), turn.begin(), turn.end());
  }
  return starts;
}

PoseRows rowsOf(const FitData& data, const Places& places) {
  PoseRows rows;
  rows.p_m = data.p_tracked_m;
  for (const Eigen::Quaterniond& q : data.q_tracked) rows.q.push_back(q.normalized());
  rows.place.resize(data.size());
  Places each;
  for (std::size_t place = 0; place < places.size(); ++place)
    for (const std::size_t row : places.rows[place]) rows.place[row] = place;
  for (std::size_t row = 0; row < data.size(); ++row) {
    each.node.push_back(data.node[row]);
    each.rows.push_back({row});
  }
  FitData reading = data;
  reading.jig_sd_m = 0.0;
  const Eigen::VectorXd noise_m2 = placeNoise_m2(reading, each);
  rows.noise_m2.assign(noise_m2.begin(), noise_m2.end());
  rows.placing_m2 = data.jig_sd_m * data.jig_sd_m;
  return rows;
}

Eigen::MatrixXd rowsOfMatrix(const Eigen::MatrixXd& all, std::span<const std::size_t> rows) {
  Eigen::MatrixXd some(static_cast<Eigen::Index>(rows.size()), all.cols());
  for (std::size_t i = 0; i < rows.size(); ++i)
    some.row(static_cast<Eigen::Index>(i)) = all.row(static_cast<Eigen::Index>(rows[i]));
  return some;
}

/// The same of the process over positions as it would be fitted instead: to the means of the places.
double heldOutRmsOfPosition_m(const FitData& data, const Places& places, const PoseSystem& system,
                              const GaussianProcessScales& scales, std::span<const std::size_t> used) {
  const Eigen::VectorXd all_noise_m2 = placeNoise_m2(data, places);
  const Eigen::MatrixXd displacement_m = rowsOfMatrix(displacementMatrix(places), used);
  const Eigen::VectorXd noise_m2 = rowsOfMatrix(all_noise_m2, used);
  std::vector<Eigen::Vector3d> p_m;
  for (const std::size_t place : used) p_m.push_back(places.p_tracked_m[place]);
  const auto projection = TailProjection::of(system.frame.tail(p_m));
  if (!projection) return HUGE_VAL;
  const auto solutions =
      RadialHoldOut::of(*projection, covarianceMatrix(system.kernel, system.frame, scales, p_m, noise_m2),
                        displacement_m, rowsOfMatrix(positionMatrix(places), used));
  if (!solutions) return HUGE_VAL;
  const Eigen::MatrixXd of_means_m = solutions->leaveOneOutErrors();
  double squares_m2 = 0.0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const std::vector<std::size_t>& rows = places.rows[used[i]];
    const auto place = static_cast<Eigen::Index>(i);
    for (const std::size_t row : rows)
      squares_m2 += (of_means_m.row(place) + system.displacement_m.row(static_cast<Eigen::Index>(row)) -
                     displacement_m.row(place))
                        .squaredNorm() /
                    static_cast<double>(rows.size());
  }
  return std::sqrt(squares_m2 / static_cast<double>(used.size()));
}

/// How poses compare with position alone on the same rows.
struct PoseGain {
  PoseScales scales;
  double nats = 0.0;
  double position_m = 0.0;  ///< Held out.
  double pose_m = 0.0;      ///< Held out.

  bool isGain() const {
    return nats >= kNatsAParameter * static_cast<double>(kTurnParameters) && pose_m < kClearlyLess * position_m;
  }
};

std::string describedGain(const PoseGain& gain) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                "%.0f nats over position alone (%.0f asked), held-out RMS %.3g mm against %.3g mm",
                std::round(gain.nats) + 0.0, kNatsAParameter * static_cast<double>(kTurnParameters),
                1000.0 * gain.pose_m, 1000.0 * gain.position_m);
  return text.data();
}

/// How much changes from one of the orientations to another, and over which angle.
std::string describedTurn(const PoseSystem& system, const PoseScales& scales) {
  const std::vector<Eigen::Quaterniond> seen = distinctRotations(system.rows.q, kSameOrientation_rad);
  double among = 0.0;
  for (const Eigen::Quaterniond& q : seen)
    among += turnCorrelation(system.kernel, scales.turn_length_rad, q, seen).mean() / static_cast<double>(seen.size());
  const double angle_deg = kDegPerRad * scales.turn_length_rad;
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "%.3g mm SD over %zu orientations, correlated over ",
                1000.0 * scales.turn_sd_m * std::sqrt(1.0 - among), seen.size());
  return text.data() + (angle_deg > 180.0 ? "all angles" : std::to_string(std::lround(angle_deg)) + " degrees");
}

/// The likeliest of both kinds for the same rows. The errors left out are for the caller to add.
/// @return none when no start leads anywhere, or on a request to stop
std::optional<PoseGain> gainOfPoses(const PoseSystem& system, const GaussianProcessScales& start,
                                    std::span<const std::size_t> used, std::span<const std::size_t> few,
                                    double spacing_m, const RunControl& control) {
  const auto full = PoseLikelihood::of(system.kernel, system.frame, system.rows.only(used),
                                       rowsOfMatrix(system.displacement_m, used));
  const auto small =
      PoseLikelihood::of(system.kernel, system.frame, system.rows.only(few), rowsOfMatrix(system.displacement_m, few));
  if (!full || !small) return std::nullopt;
  const WeakPrior field_prior(full->residualVariance_m2(), rmsSpread_m(system.rows.p_m), std::max(spacing_m, 1e-6));
  const TurnPrior turn_prior(field_prior);
  const Search of_all{*full, field_prior, turn_prior, control};
  const Search of_few{*small, field_prior, turn_prior, control};

  auto position = of_all.from(logarithmsOf(start), kPoseIterations);
  if (!position) return std::nullopt;
  // What is likely for a few rows may be far from it for all, and a search that begins there never comes back.
  std::vector<Optimum> begins;
  const auto begin = [&](const std::vector<double>& point) {
    if (const auto cost = of_all.cost(point.data(), point.size(), nullptr)) begins.push_back({point, *cost});
  };
  for (const std::vector<double>& one : startsOf(position->parameters, field_prior)) {
    begin(one);
    if (const auto optimum = of_few.from(one, kPoseStartIterations)) begin(optimum->parameters);
  }
  const auto less = [](const Optimum& a, const Optimum& b) { return a.cost < b.cost; };
  std::sort(begins.begin(), begins.end(), less);
  Optimum best{{}, HUGE_VAL};
  for (std::size_t i = 0; i < std::min(begins.size(), kSearchesOfAll); ++i) {
    const auto optimum = of_all.from(begins[i].parameters, kPoseIterations);
    best = std::min({best, begins[i], optimum.value_or(begins[i])}, less);
  }
  if (!std::isfinite(best.cost)) return std::nullopt;
  // What the search over poses found of the field alone is not orientation's merit.
  const auto again = of_all.from(std::span(best.parameters).first(kPositionParameters), kPoseIterations);
  if (again && again->cost < position->cost) position = again;
  const auto of_position = full->evaluate(position->parameters, nullptr);
  const auto of_pose = full->evaluate(best.parameters, nullptr);
  if (control.stop.stop_requested() || !of_position || !of_pose) return std::nullopt;
  return PoseGain{poseScalesOf(best.parameters), 0.5 * (*of_position - *of_pose)};
}

}  // namespace

std::vector<std::size_t> placesOfAbout(const Places& places, std::size_t n_rows, std::size_t most) {
  const double share = std::min(1.0, static_cast<double>(most) / static_cast<double>(n_rows));
  const auto n_places = static_cast<std::size_t>(share * static_cast<double>(places.size()));
  return spreadPlaces(places.p_tracked_m, std::max<std::size_t>(n_places, 5));
}

std::vector<std::size_t> rowsOfPlaces(const Places& places, std::span<const std::size_t> some) {
  std::vector<std::size_t> rows;
  for (const std::size_t place : some) rows.insert(rows.end(), places.rows[place].begin(), places.rows[place].end());
  std::sort(rows.begin(), rows.end());
  return rows;
}

double heldOutRms_m(const PoseSystem& system, const PoseScales& scales, std::span<const std::size_t> used) {
  const PoseRows rows = system.rows.only(used);
  const auto projection = TailProjection::of(system.frame.tail(rows.p_m));
  if (!projection) return HUGE_VAL;
  const auto solutions =
      RadialHoldOut::of(*projection, poseCovariance(system.kernel, system.frame, scales, rows),
                        rowsOfMatrix(system.displacement_m, used), rowsOfMatrix(system.tracked_m, used));
  if (!solutions) return HUGE_VAL;
  std::map<std::size_t, std::vector<std::size_t>> of_place;
  for (std::size_t row = 0; row < rows.size(); ++row) of_place[rows.place[row]].push_back(row);
  double squares_m2 = 0.0;
  for (const auto& [place, out] : of_place) {
    const auto errors_m = solutions->leftOutErrors(out);
    if (!errors_m) return HUGE_VAL;
    squares_m2 += errors_m->squaredNorm() / static_cast<double>(out.size());
  }
  return std::sqrt(squares_m2 / static_cast<double>(of_place.size()));
}

std::optional<PoseScales> rowScales(const PoseSystem& system, const GaussianProcessScales& start,
                                    std::span<const std::size_t> used, double spacing_m, const RunControl& control) {
  const auto likelihood = PoseLikelihood::of(system.kernel, system.frame, system.rows.only(used),
                                             rowsOfMatrix(system.displacement_m, used));
  if (!likelihood) return std::nullopt;
  const double spread_m = rmsSpread_m(system.rows.p_m);
  const WeakPrior prior(likelihood->residualVariance_m2(), spread_m, std::max(spacing_m, 1e-6));
  const TurnPrior turn_prior(prior);
  const Search search{*likelihood, prior, turn_prior, control};
  // Scales of other values than these may lie in a valley of their own.
  std::optional<Optimum> best = search.from(logarithmsOf(start), kPoseIterations);
  for (const double length : kPlainLengths) {
    const GaussianProcessScales plain{Eigen::Vector3d::Constant(length * spread_m), std::exp(prior.signal),
                                      std::exp(prior.nugget)};
    const auto other = search.from(logarithmsOf(plain), kPoseIterations);
    if (other && (!best || other->cost < best->cost)) best = other;
  }
  return best ? std::optional(poseScalesOf(best->parameters)) : std::nullopt;
}

Result<PoseSystem> poseSystemOf(const FitData& data, const Places& places, RadialKernel kernel, const FieldFrame& frame,
                                const RunControl& control) {
  PoseSystem system;
  system.kernel = kernel;
  system.frame = frame;
  FT_TRY(system.memory,
         bookSquareMatrices("A Gaussian process over poses", kGaussianProcessMatrices, data.size(), control));
  system.rows = rowsOf(data, places);
  const auto n = static_cast<Eigen::Index>(data.size());
  system.displacement_m.resize(n, 3);
  system.tracked_m.resize(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto row = static_cast<std::size_t>(i);
    system.tracked_m.row(i) = data.p_tracked_m[row].transpose();
    system.displacement_m.row(i) = (data.p_true_m[row] - data.p_tracked_m[row]).transpose();
  }
  return system;
}

bool hasSeveralOrientations(const FitData& data) {
  if (!data.hasOrientation()) return false;
  const bool is_stated = distinctRotations(data.q_true, kSameOrientation_rad).size() > 1;
  const std::vector<Eigen::Quaterniond>& turns = is_stated ? data.q_true : data.q_tracked;
  const double alike_rad = is_stated ? kTurnedAlike_rad : kTrackedAlike_rad;
  const auto n_alike = [&](const Eigen::Quaterniond& q) {
    return std::count_if(turns.begin(), turns.end(),
                         [&](const Eigen::Quaterniond& other) { return angleBetween_rad(q, other) < alike_rad; });
  };
  const auto most_alike = kShareTurnedAlike * static_cast<double>(turns.size());
  const std::vector<Eigen::Quaterniond> distinct = distinctRotations(turns, kSameOrientation_rad);
  return std::none_of(distinct.begin(), distinct.end(),
                      [&](const Eigen::Quaterniond& q) { return static_cast<double>(n_alike(q)) > most_alike; });
}

Result<PoseChoice> choosePoses(const FitData& data, const Places& places, RadialKernel kernel, const FieldFrame& frame,
                               const GaussianProcessScales& start, std::size_t tuning_places, bool must,
                               const RunControl& control) {
  if (!hasSeveralOrientations(data)) {
    if (must)
      return fail(
          ErrorCode::kUnsupported,
          "inputs=pose needs rows in several orientations, and " +
              (data.hasOrientation() ? "nine of ten of these " + std::to_string(data.size()) + " rows are turned alike"
                                     : std::string("these have none")));
    return PoseChoice{};
  }
  if (data.size() > kMostPoses) {
    const std::string most = "a Gaussian process over poses takes at most " + std::to_string(kMostPoses) +
                             " rows, and there are " + std::to_string(data.size());
    if (must) return fail(ErrorCode::kUnsupported, "inputs=pose: " + most);
    return PoseChoice{std::nullopt, "Position alone: " + most + "."};
  }
  auto made = poseSystemOf(data, places, kernel, frame, control);
  if (!made) {
    if (must || made.error().code == ErrorCode::kCancelled) return tl::unexpected(made.error());
    return PoseChoice{std::nullopt, "Position alone: " + made.error().message + "."};
  }
  PoseSystem system = *std::move(made);
  const std::vector<std::size_t> used_places = placesOfAbout(places, data.size(), tuning_places);
  const std::vector<std::size_t> used = rowsOfPlaces(places, used_places);
  const std::vector<std::size_t> few = rowsOfPlaces(places, placesOfAbout(places, data.size(), kRowsOfPoseStarts));
  auto gain = gainOfPoses(system, start, used, few, medianSpacing_m(places.p_tracked_m), control);
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
  if (!gain) {
    if (must)
      return fail(ErrorCode::kDegenerate, "inputs=pose: no scales fit these " + std::to_string(data.size()) + " rows");
    return PoseChoice{std::nullopt, "Position alone: no scales fit poses."};
  }
  gain->pose_m = heldOutRms_m(system, gain->scales, used);
  gain->position_m = heldOutRmsOfPosition_m(data, places, system, start, used_places);
  if (!must && !gain->isGain())
    return PoseChoice{std::nullopt, "Position alone: orientation brings " + describedGain(*gain) + "."};
  system.scales = gain->scales;
  system.note = "Takes orientation: what changes as the sensor turns has " + describedTurn(system, gain->scales) +
                "; " + describedGain(*gain) + ".";
  return PoseChoice{std::move(system), {}};
}

}  // namespace fieldtrue::correctors
