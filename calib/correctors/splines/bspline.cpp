#include <array>
#include <cmath>
#include <cstdio>

#include "calib/core/declare.h"
#include "calib/core/json_reader.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/radial/field_position.h"
#include "calib/correctors/radial/rbf_system.h"
#include "calib/correctors/splines/bspline_fit.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::correctors {
namespace {

const std::string kName = "B-spline fit";
/// Beyond, one dense factorisation of the normal equations would take more than a second. In three dimensions their
/// band fills most of the matrix of so small a lattice, and a sparse solver gains nothing.
constexpr Eigen::Index kMostFunctions = 2000;
/// Edge of a span in mean spacings of the places. The penalty, not the lattice, decides how smooth the fit is.
constexpr double kSpanOfSpacing = 1.25;
constexpr double kSmallestNoiseWeight = 1e-4;

using BsplinePosition = FieldPosition<SplineField>;

/// A solved spline with what its hold-outs share.
struct BsplineSystem {
  Places places;
  SmoothingSpline spline;
  std::string note;
};

FieldFrame frameOf(const FitData& data, const Places& places) {
  return FieldFrame::around(places.p_tracked_m, data.dimension, 1.0);
}

/// Extents of the places along the frame's axes, longest first to count from [m].
double longestExtent_m(const FieldFrame& frame, std::span<const Eigen::Vector3d> p_m) {
  Eigen::Vector3d low_m = Eigen::Vector3d::Constant(HUGE_VAL);
  Eigen::Vector3d high_m = -low_m;
  for (const Eigen::Vector3d& place_m : p_m) {
    low_m = low_m.cwiseMin(frame.local(place_m));
    high_m = high_m.cwiseMax(frame.local(place_m));
  }
  return (high_m - low_m).maxCoeff();
}

SplineLattice latticeOf(const FieldFrame& frame, const Places& places, const Settings& settings) {
  const double longest_m = longestExtent_m(frame, places.p_tracked_m);
  const SettingValue& wanted = settings.at("spans");
  if (std::holds_alternative<double>(wanted))
    return SplineLattice::around(places.p_tracked_m, frame, longest_m / std::get<double>(wanted));
  double span_m = longest_m;
  SplineLattice lattice = SplineLattice::around(places.p_tracked_m, frame, span_m);
  // Finer until a span is as short as the places stand apart: volume per place, by counting cells.
  const auto n = static_cast<double>(places.size());
  for (int finer = 2; finer <= 40; ++finer) {
    const SplineLattice next = SplineLattice::around(places.p_tracked_m, frame, longest_m / finer);
    double cells = 1.0;
    for (int axis = 0; axis < frame.dimension; ++axis) cells *= next.spans()[static_cast<std::size_t>(axis)];
    if (cells > n / std::pow(kSpanOfSpacing, frame.dimension) || next.size() > kMostFunctions) break;
    lattice = next;
  }
  return lattice;
}

Eigen::VectorXd weightsOf(const FitData& data, const Places& places) {
  const Eigen::VectorXd noise_m2 = placeNoise_m2(data, places);
  const double mean_m2 = noise_m2.mean();
  if (!(mean_m2 > 0.0)) return Eigen::VectorXd::Ones(noise_m2.size());
  return (noise_m2 / mean_m2).cwiseMax(kSmallestNoiseWeight).cwiseInverse();
}

std::string noteOf(const FitData& data, const SplineLattice& lattice, double smoothing, double degrees_of_freedom) {
  const std::string plane = planeNote(data, "fitted in the plane, and nothing is claimed off it");
  std::string spans;
  for (int axis = 0; axis < lattice.frame().dimension; ++axis)
    spans += (axis == 0 ? "" : "x") + std::to_string(lattice.spans()[static_cast<std::size_t>(axis)]);
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "smoothing %.2g, worth %.0f parameters.", smoothing, degrees_of_freedom);
  return plane + (plane.empty() ? "" : " ") + "Spans " + spans + ", " + text.data();
}

Result<BsplineSystem> buildSystem(const FitData& data, const Settings& settings, const RunControl& control) {
  FT_TRY(auto places, smoothFitPlaces(data, kName));
  const FieldFrame frame = frameOf(data, places);
  // Before the lattice: places at one point have no extent to cut into spans.
  if (!TailProjection::of(frame.tail(places.p_tracked_m))) return tl::unexpected(degenerateTail(kName, places.size()));
  SplineLattice lattice = latticeOf(frame, places, settings);
  if (lattice.size() > 3 * kMostFunctions)
    return fail(ErrorCode::kUnsupported, kName + ": " + std::to_string(lattice.size()) +
                                             " functions are too many; at most " + std::to_string(3 * kMostFunctions) +
                                             " can be solved for, so use fewer spans");
  auto spline = SmoothingSpline::of({std::move(lattice), places.p_tracked_m, displacementMatrix(places),
                                     positionMatrix(places), weightsOf(data, places)});
  if (!spline) return tl::unexpected(degenerateTail(kName, places.size()));
  const SettingValue& wanted = settings.at("smoothing");
  const auto smoothing =
      std::holds_alternative<double>(wanted) ? std::optional(std::get<double>(wanted)) : spline->choose(control);
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
  if (!smoothing || !spline->solve(*smoothing))
    return fail(ErrorCode::kDegenerate, kName + ": " + std::to_string(places.size()) +
                                            " places are too few for its lattice at this smoothing; use fewer spans or "
                                            "more smoothing");
  const std::string note = noteOf(data, spline->lattice(), *smoothing, spline->degreesOfFreedom());
  return BsplineSystem{std::move(places), *std::move(spline), note};
}

Result<std::unique_ptr<PositionModel>> modelOf(const BsplineSystem& system, std::span<const std::size_t> out,
                                               const Pose& fold_from_data) {
  auto field = system.spline.without(out, fold_from_data);
  if (!field) return tl::unexpected(degenerateTail(kName, system.places.size() - out.size()));
  return std::make_unique<BsplinePosition>(*std::move(field), system.note);
}

Result<std::unique_ptr<PositionModel>> fitBspline(const FitData& data, const Settings& settings,
                                                  const RunControl& control) {
  FT_TRY(const auto system, buildSystem(data, settings, control));
  return modelOf(system, {}, Pose{});
}

class BsplineHoldOut : public HoldOutFits<PositionModel> {
 public:
  explicit BsplineHoldOut(BsplineSystem system) : system_(std::move(system)) {}

  Result<std::unique_ptr<PositionModel>> without(std::span<const std::size_t> rows,
                                                 const Pose& fold_from_data) const override {
    FT_TRY(const auto out, placesOfRows(system_.places, rows));
    return modelOf(system_, out, fold_from_data);
  }

 private:
  BsplineSystem system_;
};

Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutBspline(const FitData& data, const Settings& settings,
                                                                   const RunControl& control) {
  FT_TRY(auto system, buildSystem(data, settings, control));
  return std::make_unique<BsplineHoldOut>(std::move(system));
}

std::vector<Setting> bsplineSettings() {
  return {declare::autoNumber("spans", "Spans along the longest axis", {1.0, 40.0}, "auto",
                              "Knots of the lattice less one; the other axes get spans of the same length. Auto makes "
                              "a span a little longer than the places stand apart."),
          declare::autoNumber(
              "smoothing", "Smoothing", {1e-8, 1e8}, "auto",
              "Weight of the bending penalty beside the data; auto chooses by generalised cross-validation.")};
}

}  // namespace

std::unique_ptr<PositionModel> readBsplinePosition(const JsonReader& parameters) {
  return std::make_unique<BsplinePosition>(SplineField::fromJson(parameters), parameters["note"].text());
}

/// Tensor-product cubic B-splines fitted to scattered places with a bending penalty, smoothness by generalised
/// cross-validation.
PositionMethod bsplinePosition() {
  return {
      .id = "bspline",
      .label = "B-splines",
      .source = "Eilers and Marx 1996, penalised B-splines; generalised cross-validation: Golub, Heath and Wahba 1979",
      .settings = bsplineSettings(),
      .fit = fitBspline,
      .read = readBsplinePosition,
      .hold_out = holdOutBspline,
      .keeps_scales = true,
      .origin = MethodOrigin::kLater,
      .tries = {{"", simplicity::kSmoothing}}};
}

}  // namespace fieldtrue::correctors
