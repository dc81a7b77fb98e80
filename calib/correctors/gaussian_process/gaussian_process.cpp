#include "calib/correctors/gaussian_process/gaussian_process.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "calib/core/declare.h"
#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_memory.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/gaussian_process/coil_choice.h"
#include "calib/correctors/gaussian_process/gaussian_process_position.h"
#include "calib/correctors/gaussian_process/gaussian_process_tuning.h"
#include "calib/correctors/gaussian_process/pose_process.h"
#include "calib/correctors/radial/rbf_system.h"
#include "calib/geometry/spacing.h"

namespace fieldtrue::correctors {
namespace {

constexpr std::size_t kMaxPlaces = 10000;  // 800 MB for the matrix.
const std::string kName = "Gaussian process";
/// Displacements that a linear trend explains this well [m] leave nothing to find scales from.
constexpr double kNoResidual_m = 1e-9;

/// Everything a fit and its hold-outs share.
struct GaussianProcessSystem {
  Places places;
  RadialKernel kernel = RadialKernel::kMatern52;
  GaussianProcessScales scales;
  FieldFrame frame;  ///< In units of the lengths.
  std::vector<double> noise_m2;
  std::string note;
  MemoryBooking memory;
  std::optional<PoseSystem> poses;               ///< Where orientation is an input; it stands instead of all else.
  std::optional<SensorCoils> coils;              ///< All else is of the data without them.
  CoilDesign design;                             ///< Of what is fitted, where there are coils.
  std::vector<Eigen::Quaterniond> orientations;  ///< Of the rows, where there are coils.

  Eigen::VectorXd noise() const {
    return Eigen::Map<const Eigen::VectorXd>(noise_m2.data(), static_cast<Eigen::Index>(noise_m2.size()));
  }
};

std::string lengthText_mm(const GaussianProcessScales& scales, int dimension) {
  std::string text;
  for (int axis = 0; axis < dimension; ++axis)
    text += (axis == 0              ? ""
             : axis + 1 < dimension ? ", "
                                    : " and ") +
            std::to_string(std::lround(1000.0 * scales.length_m[axis]));
  return text + " mm";
}

std::string noteOf(const FitData& data, const GaussianProcessSystem& system, std::size_t n_used) {
  std::array<char, 96> sds{};
  std::snprintf(sds.data(), sds.size(), "field SD %.3g mm, unexplained SD %.2g mm", 1000.0 * system.scales.signal_sd_m,
                1000.0 * system.scales.nugget_sd_m);
  const std::string plane = planeNote(data, "fitted in the plane, and nothing is claimed off it");
  return plane + (plane.empty() ? "" : " ") + "Correlation lengths " + lengthText_mm(system.scales, data.dimension) +
         ", " + sds.data() + ", by restricted likelihood on " +
         (n_used == system.places.size()
              ? "all places."
              : std::to_string(n_used) + " of " + std::to_string(system.places.size()) + " places.");
}

/// Scales for displacements that have no residual to find them from: nothing but the trend is left.
GaussianProcessScales scalesOfTrend(double spread_m) {
  return {Eigen::Vector3d::Constant(spread_m), kNoResidual_m, kNoResidual_m};
}

Result<GaussianProcessScales> chooseScales(const GaussianProcessSystem& system, std::span<const std::size_t> used,
                                           int restarts, const RunControl& control) {
  const Eigen::MatrixXd all_y = displacementMatrix(system.places);
  std::vector<Eigen::Vector3d> p_m;
  Eigen::MatrixXd y(static_cast<Eigen::Index>(used.size()), 3);
  Eigen::VectorXd noise_m2(y.rows());
  for (std::size_t i = 0; i < used.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    p_m.push_back(system.places.p_tracked_m[used[i]]);
    y.row(row) = all_y.row(static_cast<Eigen::Index>(used[i]));
    noise_m2[row] = system.noise_m2[used[i]];
  }
  const auto projection = TailProjection::of(system.frame.tail(p_m));
  if (!projection) return tl::unexpected(degenerateTail(kName, system.places.size()));
  const Eigen::MatrixXd residual = projection->toComplement(y);
  if (residual.norm() <= kNoResidual_m * std::sqrt(static_cast<double>(residual.size())))
    return scalesOfTrend(rmsSpread_m(p_m));
  const auto scales = fitScales(system.kernel, system.frame, p_m, y, noise_m2, restarts, control);
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
  if (!scales)
    return fail(ErrorCode::kDegenerate, kName + ": no scales fit these " + std::to_string(p_m.size()) +
                                            " places; they may repeat, or hold one reading far off all others");
  return *scales;
}

/// Of rows, or of places, each the mean of its rows.
CoilDesign designOf(CoilEffect effect, const FitData& data, const Places& places, bool by_row) {
  CoilDesign of_rows(static_cast<Eigen::Index>(data.size()), 18);
  for (std::size_t row = 0; row < data.size(); ++row)
    of_rows.row(static_cast<Eigen::Index>(row)) =
        coilDerivative(effect, {data.p_tracked_m[row], data.q_tracked[row]}).reshaped().transpose();
  if (by_row) return of_rows;
  CoilDesign of_places = CoilDesign::Zero(static_cast<Eigen::Index>(places.size()), 18);
  for (std::size_t place = 0; place < places.size(); ++place)
    for (const std::size_t row : places.rows[place])
      of_places.row(static_cast<Eigen::Index>(place)) +=
          of_rows.row(static_cast<Eigen::Index>(row)) / static_cast<double>(places.rows[place].size());
  return of_places;
}

/// The coils of a sensor that was turned, where they explain what changes.
Result<CoilChoice> coilsOf(const FitData& data, const GaussianProcessSystem& system, CoilEffect effect,
                           std::size_t tuning_places, const RunControl& control) {
  if (!hasSeveralOrientations(data) || data.size() > kMaxPlaces) return CoilChoice{};
  const auto poses = poseSystemOf(data, system.places, system.kernel, system.frame, control);
  // Without the memory there is no choice, and what there is without orientation is told elsewhere.
  if (!poses && poses.error().code != ErrorCode::kCancelled) return CoilChoice{};
  if (!poses) return tl::unexpected(poses.error());
  const std::vector<std::size_t> used =
      rowsOfPlaces(system.places, placesOfAbout(system.places, data.size(), tuning_places));
  return chooseCoils(*poses, effect, system.scales, used, medianSpacing_m(system.places.p_tracked_m), control);
}

/// The same places with the truth of this data.
Places withTruthOf(const FitData& data, Places places) {
  for (std::size_t place = 0; place < places.size(); ++place) {
    places.p_true_m[place].setZero();
    for (const std::size_t row : places.rows[place])
      places.p_true_m[place] += data.p_true_m[row] / static_cast<double>(places.rows[place].size());
  }
  return places;
}

Result<GaussianProcessSystem> buildSystem(const FitData& data, Places places, const Settings& settings,
                                          const RunControl& control, std::optional<CoilEffect> coils);

/// The system of what is left without the coils, where they are found.
Result<std::optional<GaussianProcessSystem>> systemWithoutCoils(const FitData& data,
                                                                const GaussianProcessSystem& system, CoilEffect effect,
                                                                const Settings& settings, const RunControl& control) {
  const auto tuning_places = static_cast<std::size_t>(integerSetting(settings, "tuning_places"));
  FT_TRY(const CoilChoice choice, coilsOf(data, system, effect, tuning_places, control));
  if (!choice.coils) return std::nullopt;
  const FitData rest = withoutCoils(data, *choice.coils);
  FT_TRY(GaussianProcessSystem without, buildSystem(rest, withTruthOf(rest, system.places), settings, control, {}));
  without.coils = choice.coils;
  if (without.poses) without.coils->left_sd_m = 0.0;  // The process over poses has its own.
  without.design = designOf(effect, data, without.places, without.poses.has_value());
  without.orientations = data.q_tracked;
  (without.poses ? without.poses->note : without.note) += " " + choice.note;
  return without;
}

/// @param coils what they would do to the values, if they may be asked for
Result<GaussianProcessSystem> buildSystem(const FitData& data, Places places, const Settings& settings,
                                          const RunControl& control, std::optional<CoilEffect> coils) {
  if (places.size() > kMaxPlaces)
    return fail(ErrorCode::kUnsupported, "A Gaussian process takes at most " + std::to_string(kMaxPlaces) +
                                             " places, got " + std::to_string(places.size()) +
                                             "; use a polynomial or B-splines");
  GaussianProcessSystem system;
  system.places = std::move(places);
  auto memory = bookSquareMatrices(kName, kGaussianProcessMatrices, system.places.size(), control);
  if (!memory) return tl::unexpected(memory.error());
  system.memory = *std::move(memory);
  system.kernel = choiceSetting(settings, "nu") == "1.5" ? RadialKernel::kMatern32 : RadialKernel::kMatern52;
  const Eigen::VectorXd noise_m2 = placeNoise_m2(data, system.places);
  system.noise_m2.assign(noise_m2.begin(), noise_m2.end());
  const std::vector<Eigen::Vector3d>& p_m = system.places.p_tracked_m;
  system.frame = FieldFrame::around(p_m, data.dimension, rmsSpread_m(p_m));
  const auto used = spreadPlaces(p_m, static_cast<std::size_t>(integerSetting(settings, "tuning_places")));
  const auto scales = chooseScales(system, used, static_cast<int>(integerSetting(settings, "restarts")), control);
  if (!scales) return tl::unexpected(scales.error());
  system.scales = *scales;
  const std::string& inputs = choiceSetting(settings, "inputs");
  const auto tuning_places = static_cast<std::size_t>(integerSetting(settings, "tuning_places"));
  if (inputs != "position" && coils && choiceSetting(settings, "sensor_coils") == "auto") {
    FT_TRY(auto without, systemWithoutCoils(data, system, *coils, settings, control));
    if (without) return *std::move(without);
  }
  PoseChoice poses;
  if (inputs != "position") {
    FT_TRY(poses, choosePoses(data, system.places, system.kernel, system.frame, system.scales, tuning_places,
                              inputs == "pose", control));
  }
  system.frame = scaledFrame(system.frame, system.scales);
  system.note = noteOf(data, system, used.size()) + (poses.note.empty() ? "" : " ") + poses.note;
  system.poses = std::move(poses.system);
  if (system.poses) {
    const std::string plane = planeNote(data, "fitted in the plane, and nothing is claimed off it");
    system.poses->note = plane + (plane.empty() ? "" : " ") + system.poses->note;
  }
  return system;
}

Result<GaussianProcessSystem> systemOf(const FitData& data, const Settings& settings, const RunControl& control) {
  FT_TRY(auto places, smoothFitPlaces(data, kName));
  return buildSystem(data, std::move(places), settings, control, CoilEffect::kShift);
}

Eigen::MatrixXd matrixOf(const GaussianProcessSystem& system) {
  return covarianceMatrix(system.kernel, system.frame, system.scales, system.places.p_tracked_m, system.noise());
}

tl::unexpected<Error> notSolvable(const GaussianProcessSystem& system) {
  if (!TailProjection::of(system.frame.tail(system.places.p_tracked_m)))
    return tl::unexpected(degenerateTail(kName, system.places.size()));
  return fail(ErrorCode::kDegenerate, kName +
                                          ": rounding spoils the solution, since its noise is too small beside the "
                                          "field; state the places' noise or the jig's tolerance");
}

/// @param solution of the covariance matrix, so that its coefficients lack the signal's variance
std::unique_ptr<PositionModel> modelOf(const GaussianProcessSystem& system, std::span<const std::size_t> out,
                                       RadialSolution solution) {
  solution.coefficients *= system.scales.signal_sd_m * system.scales.signal_sd_m;
  const std::vector<double> kept_m2 = withoutPlaces(system.noise_m2, out);
  const Eigen::VectorXd noise_m2 =
      Eigen::Map<const Eigen::VectorXd>(kept_m2.data(), static_cast<Eigen::Index>(kept_m2.size()));
  return makeGaussianProcess(
      RadialField(system.kernel, 0.0, system.frame, withoutPlaces(system.places.p_tracked_m, out), solution),
      system.scales, noise_m2, system.note);
}

std::unique_ptr<PositionModel> withCoilsOf(const GaussianProcessSystem& system, std::unique_ptr<PositionModel> model) {
  if (!system.coils) return model;
  return withCoils(std::move(model), *system.coils, system.design, system.orientations);
}

Result<std::unique_ptr<PositionModel>> fitSystem(const GaussianProcessSystem& system) {
  if (system.poses)
    return fitPoses(*system.poses).map([&](std::unique_ptr<PositionModel> model) {
      return withCoilsOf(system, std::move(model));
    });
  const auto projection = TailProjection::of(system.frame.tail(system.places.p_tracked_m));
  if (!projection) return notSolvable(system);
  const auto solution = solveRadial(*projection, matrixOf(system), displacementMatrix(system.places));
  if (!solution) return notSolvable(system);
  return withCoilsOf(system, modelOf(system, {}, *solution));
}

Result<std::unique_ptr<PositionModel>> fitGaussianProcess(const FitData& data, const Settings& settings,
                                                          const RunControl& control) {
  FT_TRY(const auto system, systemOf(data, settings, control));
  return fitSystem(system);
}

class GaussianProcessHoldOut : public HoldOutFits<PositionModel> {
 public:
  GaussianProcessHoldOut(GaussianProcessSystem system, RadialHoldOut solutions)
      : system_(std::move(system)), solutions_(std::move(solutions)) {}

  Result<std::unique_ptr<PositionModel>> without(std::span<const std::size_t> rows,
                                                 const Pose& fold_from_data) const override {
    FT_TRY(const auto out, placesOfRows(system_.places, rows));
    auto solution = solutions_.without(out, fold_from_data);
    if (!solution) return tl::unexpected(degenerateTail(kName, system_.places.size() - out.size()));
    return modelOf(system_, out, *std::move(solution));
  }

 private:
  GaussianProcessSystem system_;
  RadialHoldOut solutions_;
};

/// Hold-outs of the data without the coils, whose strain stays as all rows gave it.
class CoilsHoldOut : public HoldOutFits<PositionModel> {
 public:
  CoilsHoldOut(std::unique_ptr<HoldOutFits<PositionModel>> fits, const SensorCoils& coils,
               std::vector<Eigen::Quaterniond> orientations)
      : fits_(std::move(fits)), coils_(coils), orientations_(std::move(orientations)) {}

  Result<std::unique_ptr<PositionModel>> without(std::span<const std::size_t> rows,
                                                 const Pose& fold_from_data) const override {
    return fits_->without(rows, fold_from_data).map([&](std::unique_ptr<PositionModel> model) {
      return withCoils(std::move(model), coils_, CoilDesign(0, 18), orientations_);
    });
  }

 private:
  std::unique_ptr<HoldOutFits<PositionModel>> fits_;
  SensorCoils coils_;
  std::vector<Eigen::Quaterniond> orientations_;
};

Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutSystem(GaussianProcessSystem system) {
  if (system.poses) return holdOutPoses(*std::move(system.poses));
  const auto projection = TailProjection::of(system.frame.tail(system.places.p_tracked_m));
  if (!projection) return notSolvable(system);
  auto solutions = RadialHoldOut::of(*projection, matrixOf(system), displacementMatrix(system.places),
                                     positionMatrix(system.places));
  if (!solutions) return notSolvable(system);
  return std::make_unique<GaussianProcessHoldOut>(std::move(system), *std::move(solutions));
}

Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutGaussianProcess(const FitData& data,
                                                                           const Settings& settings,
                                                                           const RunControl& control) {
  FT_TRY(auto system, systemOf(data, settings, control));
  const std::optional<SensorCoils> coils = system.coils;
  std::vector<Eigen::Quaterniond> orientations = std::move(system.orientations);
  auto fits = holdOutSystem(std::move(system));
  if (!fits || !coils) return fits;
  return std::make_unique<CoilsHoldOut>(*std::move(fits), *coils, std::move(orientations));
}

}  // namespace

Result<std::unique_ptr<PositionModel>> fitProcessOf(const FitData& data, std::span<const Eigen::Vector3d> values,
                                                    std::optional<CoilEffect> coils, const Settings& settings,
                                                    const RunControl& control) {
  FT_TRY(auto places, smoothFitPlaces(data, kName));
  FitData of_values = data;
  of_values.noise_m2.clear();
  of_values.jig_sd_m = 0.0;
  for (std::size_t row = 0; row < data.size(); ++row) of_values.p_true_m[row] = data.p_tracked_m[row] + values[row];
  FT_TRY(auto system, buildSystem(of_values, withTruthOf(of_values, std::move(places)), settings, control, coils));
  (system.poses ? system.poses->note : system.note).clear();  // It speaks of millimetres.
  return fitSystem(system);
}

std::vector<Setting> gaussianProcessSettings() {
  return {
      declare::choice("inputs", "Inputs", {"auto", "position", "pose"}, "auto",
                      "What the error is a function of: the tracked position, or the whole tracked pose. auto takes "
                      "the pose where rows are turned differently, the evidence gains 3 nats for each further "
                      "parameter and the error at places left out is 3 % less."),
      declare::choice(
          "sensor_coils", "Sensor's coils", {"auto", "none"}, "auto",
          "Where inputs may be the pose: auto first takes out what coils of unequal gain and skew would do, if "
          "the evidence gains 3 nats for each of their six parameters and the error at places left out is 3 % "
          "less."),
      declare::choice("nu", "Smoothness", {"1.5", "2.5"}, "2.5",
                      "Of the Matern kernel: fields with nu = 2.5 have two derivatives, with 1.5 one."),
      declare::integer("restarts", "Starts", {1, 20}, 3,
                       "Starting points from which the scales are sought; the most likely end is kept."),
      declare::integer(
          "tuning_places", "Places for the scales", {50, 3000}, 700,
          "With more places than these, the scales are found on a well-spread part of them; the fit takes all.")};
}

/// A Gaussian process with an anisotropic Matern kernel about a linear trend, each place with its own noise, scales by
/// restricted likelihood.
PositionMethod gaussianProcessPosition() {
  return {
      .id = "gaussian_process",
      .label = "Gaussian process",
      .source =
          "Universal kriging: Matheron 1969; Matern kernel and likelihood: Rasmussen and Williams 2006, eq. 4.14, 5.9; "
          "restricted likelihood: Patterson and Thompson 1971",
      .settings = gaussianProcessSettings(),
      .fit = fitGaussianProcess,
      .read = readGaussianProcessPosition,
      .hold_out = holdOutGaussianProcess,
      .tuning = Tuning::kAlways,
      .origin = MethodOrigin::kLater,
      .tries = {{"", simplicity::kSmoothing}}};
}

}  // namespace fieldtrue::correctors
