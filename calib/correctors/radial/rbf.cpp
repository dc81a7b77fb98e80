#include <array>
#include <cmath>
#include <cstdio>

#include "calib/core/declare.h"
#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_memory.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/radial/field_position.h"
#include "calib/correctors/radial/rbf_system.h"
#include "calib/correctors/radial/rbf_tuning.h"
#include "calib/geometry/spacing.h"

namespace fieldtrue::correctors {
namespace {

constexpr std::size_t kMaxPlaces = 10000;  // 800 MB for the matrix.
/// Places on which shape and smoothing are chosen; beyond, the decompositions would take longer than everything else.
constexpr std::size_t kTuningPlaces = 800;
/// A place is never taken for more than this much better than the average.
constexpr double kSmallestNoiseWeight = 1e-4;
const std::string kName = "Radial basis functions";

using RbfPosition = FieldPosition<RadialField>;

/// Everything a fit and its hold-outs share: merged places, kernel, frame and the system's matrix.
struct RbfSystem {
  Places places;
  RadialKernel kernel = RadialKernel::kMultiquadric;
  double c2 = 0.0;
  FieldFrame frame;
  MemoryBooking memory;    ///< Of the matrix, of its projection and of what is factorised; later of the inverse.
  Eigen::MatrixXd matrix;  ///< Phi + lambda diag(noise weights), lower triangle.
  std::string note;
};

std::optional<double> autoNumber(const Settings& settings, const std::string& key) {
  const SettingValue& value = settings.at(key);
  return std::holds_alternative<double>(value) ? std::optional(std::get<double>(value)) : std::nullopt;
}

std::string noteOf(const FitData& data, const RbfChoice& choice, RadialKernel kernel, double unit_m, std::size_t n_used,
                   bool is_chosen) {
  std::string note = planeNote(data, "fitted in the plane, and nothing is claimed off it");
  if (!is_chosen) return note;
  const std::size_t n_places = mergePlaces(data).size();
  if (!note.empty()) note += ' ';
  if (hasShape(kernel)) note += "Shape " + std::to_string(std::lround(1000.0 * choice.shape * unit_m)) + " mm, ";
  note += hasShape(kernel) ? "smoothing " : "Smoothing ";
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2g", choice.smoothing);
  note +=
      std::string(text.data()) + ", by leave-one-out on " +
      (n_used == n_places ? "all places." : std::to_string(n_used) + " of " + std::to_string(n_places) + " places.");
  return note;
}

Eigen::VectorXd noiseWeights(const FitData& data, const Places& places) {
  const Eigen::VectorXd noise_m2 = placeNoise_m2(data, places);
  const double mean_m2 = noise_m2.mean();
  if (!(mean_m2 > 0.0)) return Eigen::VectorXd::Ones(noise_m2.size());
  return (noise_m2 / mean_m2).cwiseMax(kSmallestNoiseWeight);
}

/// Shape and smoothing: as set, or chosen on (some of) the places.
Result<RbfChoice> choose(const RbfSystem& system, const Eigen::VectorXd& weights, std::span<const std::size_t> used,
                         std::optional<double> shape, std::optional<double> smoothing, const RunControl& control) {
  if ((shape || !hasShape(system.kernel)) && smoothing) return RbfChoice{shape.value_or(1.0), *smoothing, 0.0};
  std::vector<Eigen::Vector3d> p_m;
  const Eigen::MatrixXd y = displacementMatrix(system.places);
  RbfProblem problem{system.kernel, system.frame, {}, {}, {}};
  problem.y.resize(static_cast<Eigen::Index>(used.size()), 3);
  problem.noise_weight.resize(problem.y.rows());
  for (std::size_t i = 0; i < used.size(); ++i) {
    p_m.push_back(system.places.p_tracked_m[used[i]]);
    problem.y.row(static_cast<Eigen::Index>(i)) = y.row(static_cast<Eigen::Index>(used[i]));
    problem.noise_weight[static_cast<Eigen::Index>(i)] = weights[static_cast<Eigen::Index>(used[i])];
  }
  problem.p_m = p_m;
  const auto choice = chooseRbf(problem, shape, smoothing, control);
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
  if (!choice) return tl::unexpected(degenerateTail(kName, system.places.size()));
  return *choice;
}

Result<RbfSystem> buildSystem(const FitData& data, const Settings& settings, const RunControl& control) {
  auto places = smoothFitPlaces(data, kName);
  if (!places) return tl::unexpected(places.error());
  if (places->size() > kMaxPlaces)
    return fail(ErrorCode::kUnsupported, kName + " take at most " + std::to_string(kMaxPlaces) + " places, got " +
                                             std::to_string(places->size()) + "; use a polynomial or B-splines");
  RbfSystem system;
  system.places = *std::move(places);
  auto memory = bookSquareMatrices(kName, 3.0, system.places.size(), control);
  if (!memory) return tl::unexpected(memory.error());
  system.memory = *std::move(memory);
  system.kernel = *radialKernelFrom(choiceSetting(settings, "kernel"));
  const double unit_m = rmsSpread_m(system.places.p_tracked_m);
  system.frame = FieldFrame::around(system.places.p_tracked_m, data.dimension, unit_m);
  const Eigen::VectorXd weights = noiseWeights(data, system.places);
  auto shape = autoNumber(settings, "shape_mm");
  if (shape) *shape *= 1e-3 / unit_m;
  const auto smoothing = autoNumber(settings, "smoothing");
  const std::vector<std::size_t> used = spreadPlaces(system.places.p_tracked_m, kTuningPlaces);
  FT_TRY(const auto choice, choose(system, weights, used, shape, smoothing, control));
  system.c2 = choice.shape * choice.shape;
  system.matrix = kernelMatrix(system.kernel, system.c2, system.frame, system.places.p_tracked_m);
  system.matrix.diagonal() += choice.smoothing * weights;
  const bool is_chosen = (hasShape(system.kernel) && !shape) || !smoothing;
  system.note = noteOf(data, choice, system.kernel, unit_m, used.size(), is_chosen);
  return system;
}

tl::unexpected<Error> notSolvable(const RbfSystem& system) {
  if (!TailProjection::of(system.frame.tail(system.places.p_tracked_m)))
    return tl::unexpected(degenerateTail(kName, system.places.size()));
  return fail(ErrorCode::kDegenerate,
              kName +
                  ": some places stand so close together that rounding spoils the solution; use more smoothing, or "
                  "a smaller shape");
}

std::unique_ptr<PositionModel> modelOf(const RbfSystem& system, std::span<const Eigen::Vector3d> centers_m,
                                       const RadialSolution& solution) {
  return std::make_unique<RbfPosition>(RadialField(system.kernel, system.c2, system.frame, centers_m, solution),
                                       system.note);
}

Result<std::unique_ptr<PositionModel>> fitRbf(const FitData& data, const Settings& settings,
                                              const RunControl& control) {
  FT_TRY(const auto system, buildSystem(data, settings, control));
  const auto projection = TailProjection::of(system.frame.tail(system.places.p_tracked_m));
  if (!projection) return notSolvable(system);
  const auto solution = solveRadial(*projection, system.matrix, displacementMatrix(system.places));
  if (!solution) return notSolvable(system);
  return modelOf(system, system.places.p_tracked_m, *solution);
}

class RbfHoldOut : public HoldOutFits<PositionModel> {
 public:
  RbfHoldOut(RbfSystem system, RadialHoldOut solutions) : system_(std::move(system)), solutions_(std::move(solutions)) {
    system_.matrix.resize(0, 0);
  }

  Result<std::unique_ptr<PositionModel>> without(std::span<const std::size_t> rows,
                                                 const Pose& fold_from_data) const override {
    FT_TRY(const auto out, placesOfRows(system_.places, rows));
    const auto solution = solutions_.without(out, fold_from_data);
    if (!solution) return tl::unexpected(degenerateTail(kName, system_.places.size() - out.size()));
    return modelOf(system_, withoutPlaces(system_.places.p_tracked_m, out), *solution);
  }

 private:
  RbfSystem system_;
  RadialHoldOut solutions_;
};

Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutRbf(const FitData& data, const Settings& settings,
                                                               const RunControl& control) {
  FT_TRY(auto system, buildSystem(data, settings, control));
  const auto projection = TailProjection::of(system.frame.tail(system.places.p_tracked_m));
  if (!projection) return notSolvable(system);
  auto solutions =
      RadialHoldOut::of(*projection, system.matrix, displacementMatrix(system.places), positionMatrix(system.places));
  if (!solutions) return notSolvable(system);
  return std::make_unique<RbfHoldOut>(std::move(system), *std::move(solutions));
}

/// Cubic and thin plate have no shape that could be chosen.
bool usesSetting(const Settings& settings, const std::string& key) {
  return key != "shape_mm" || hasShape(*radialKernelFrom(choiceSetting(settings, "kernel")));
}

std::vector<Setting> rbfSettings() {
  return {
      declare::choice("kernel", "Kernel", {"multiquadric", "inverse_multiquadric", "cubic", "thin_plate"},
                      "multiquadric", "The function of distance that is summed; cubic and thin plate have no shape."),
      declare::autoNumber(
          "shape_mm", "Shape", {1.0, 100000.0, "mm"}, "auto",
          "Distance over which a multiquadric is rounded off: larger is smoother; auto chooses by leave-one-out."),
      declare::autoNumber(
          "smoothing", "Smoothing", {0.0, 1e6}, "auto",
          "Added to the kernel matrix's diagonal in proportion to each place's noise, lengths in root mean squared "
          "distances of the places from their centre; 0 passes through every place, auto chooses by leave-one-out.")};
}

}  // namespace

std::unique_ptr<PositionModel> readRbfPosition(const JsonReader& parameters) {
  return std::make_unique<RbfPosition>(RadialField::fromJson(parameters), parameters["note"].text());
}

/// Radial basis functions with a linear tail and noise-weighted smoothing, shape and smoothing by leave-one-out.
PositionMethod rbfPosition() {
  return {.id = "rbf",
          .label = "Radial basis functions",
          .source = "Hardy 1971; Duchon 1977; shape and smoothing by leave-one-out: Rippa 1999, eq. 17",
          .settings = rbfSettings(),
          .fit = fitRbf,
          .read = readRbfPosition,
          .hold_out = holdOutRbf,
          .keeps_scales = true,
          .origin = MethodOrigin::kLater,
          .tries = {{"", simplicity::kSmoothing}, {"kernel=thin_plate", simplicity::kSmoothing}},
          .uses = usesSetting};
}

}  // namespace fieldtrue::correctors
