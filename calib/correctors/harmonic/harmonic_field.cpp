#include <algorithm>
#include <cmath>

#include "calib/core/declare.h"
#include "calib/core/json_reader.h"
#include "calib/core/memory_limit.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/base/soft_box.h"
#include "calib/correctors/harmonic/harmonic_field_fit.h"

namespace fieldtrue::correctors {
namespace {

constexpr const char* kName = "The harmonic field";
/// How far beyond the places' box the field is asked at most: a share of its longest side, and of the way to the
/// nearest source, near which the field varies on that scale.
constexpr double kReachOfSide = 0.1;
constexpr double kReachOfSourceDistance = 0.2;

/// What the SD given the sources is multiplied by, since others might have been chosen: such that nine errors in ten
/// are within its 90 % in three rooms of tests/studies/uncertainty_coverage.py; in the three others 0.95 were.
constexpr double kOfChoice = 1.4;

/// A shift that is larger than any at the places fitted comes from near a source, where the field is least known: what
/// is beyond counts less and less, up to twice the largest.
constexpr double kMostOfLargest = 2.0;

Eigen::Vector3d believed_m(const Eigen::Vector3d& shift_m, double largest_m) {
  const double size_m = shift_m.norm();
  if (!(size_m > largest_m)) return shift_m;
  if (!(largest_m > 0.0)) return Eigen::Vector3d::Zero();
  const double beyond = std::exp(1.0 - size_m / largest_m);
  return largest_m * (kMostOfLargest - beyond) / size_m * shift_m;
}

class HarmonicField : public PositionModel {
 public:
  /// @param largest_m distance of a reading from the truth, at the places fitted
  /// @param unmodelled_m RMS of what noise and tolerance leave unexplained there
  HarmonicField(HeldField field, const Pose& field_from_truth, double largest_m, double unmodelled_m,
                FieldPosterior posterior, std::string note)
      : field_(std::move(field)),
        field_from_truth_(field_from_truth),
        truth_from_field_(inverse(field_from_truth)),
        largest_m_(largest_m),
        unmodelled_m_(unmodelled_m),
        posterior_(std::move(posterior)),
        note_(std::move(note)) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    const Eigen::Vector3d shift_m = believed_m(field_.truePosition_m(p_tracked_m) - p_tracked_m, largest_m_);
    return truth_from_field_ * (p_tracked_m + shift_m) - p_tracked_m;
  }

  /// Beyond the box that of the position held at it; no more than that of a shift of which nothing is known but how
  /// large it may be.
  std::optional<double> uncertainty_m(const Eigen::Vector3d& p_tracked_m) const override {
    const Eigen::Vector3d p_m = field_.truePosition_m(p_tracked_m);
    const Eigen::Vector3d shift_m = p_m - p_tracked_m;
    const double disbelieved_m = (shift_m - believed_m(shift_m, largest_m_)).norm();
    const PlaceDerivative place = PlaceDerivative::at(field_.field(), field_.heldPosition_m(p_m));
    return std::min(std::hypot(kOfChoice * posterior_.sd_m(place), disbelieved_m, unmodelled_m_),
                    kOfChoice * std::hypot(posterior_.sdOfMotion_m(p_m), kMostOfLargest * largest_m_));
  }

  std::string note() const override { return note_; }

  nlohmann::json parameters() const override {
    Eigen::MatrixXd sources(static_cast<Eigen::Index>(field_.field().sources().size()), 12);
    for (Eigen::Index k = 0; k < sources.rows(); ++k) {
      const FieldSource& source = field_.field().sources()[static_cast<std::size_t>(k)];
      sources.row(k).head<3>() = source.at_m.transpose();
      sources.row(k).tail<9>() = Eigen::Map<const Eigen::RowVector<double, 9>>(source.response.data());
    }
    nlohmann::json root = nlohmann::json::array();
    for (Eigen::Index row = 0; row < posterior_.root.rows(); ++row)
      for (Eigen::Index column = row; column < posterior_.root.cols(); ++column)
        root.push_back(posterior_.root(row, column));
    nlohmann::json stored = {{"sources", jsonOf(sources)},
                             {"field_from_truth", jsonOf(field_from_truth_)},
                             {"turned_about_m", jsonOf(posterior_.about_m)},
                             {"covariance_root", std::move(root)},
                             {"largest_m", largest_m_},
                             {"low_m", jsonOf(field_.box().low_m)},
                             {"high_m", jsonOf(field_.box().high_m)},
                             {"reach_m", field_.box().reach_m},
                             {"note", note_}};
    if (unmodelled_m_ > 0.0) stored["unmodelled_m"] = unmodelled_m_;
    return stored;
  }

 private:
  HeldField field_;
  Pose field_from_truth_;
  Pose truth_from_field_;
  double largest_m_;
  double unmodelled_m_;
  FieldPosterior posterior_;
  std::string note_;
};

/// The design, three rows a place by the unknowns of every candidate source, and the normal equations with their copy.
double memory_bytes(std::size_t n_rows) {
  constexpr double kUnknowns = 2000.0;  // The lattices of candidates hold at most about 300 sources of six.
  return 8.0 * kUnknowns * (3.0 * static_cast<double>(n_rows) + 2.0 * kUnknowns);
}

constexpr const char* kNoDisturbance = "No disturbance stands out from the noise: only the alignment is corrected";
constexpr const char* kNoSuchField =
    "No field of sources outside the places was found that leaves less than none: only the alignment is corrected";

/// @param without_sources what is said where there are none
std::string noteOf(const FitData& data, const HarmonicFit& fit, const char* without_sources) {
  const std::string plane = planeNote(data, "nothing is claimed off it");
  if (!plane.empty() || !fit.field.sources().empty()) return plane;
  return without_sources;
}

double largestError_m(const FitData& data, const Pose& field_from_truth) {
  double largest_m = 0.0;
  for (std::size_t i = 0; i < data.size(); ++i)
    largest_m = std::max(largest_m, (field_from_truth * data.p_true_m[i] - data.p_tracked_m[i]).norm());
  return largest_m;
}

/// Of the places as they stand in the transmitter's frame.
SoftBox boxOf(const FitData& data, const HarmonicFit& fit) {
  std::vector<Eigen::Vector3d> p_m;
  for (const Eigen::Vector3d& p_true_m : data.p_true_m) p_m.push_back(fit.field_from_truth * p_true_m);
  SoftBox box = SoftBox::around(p_m, kReachOfSide);
  for (const FieldSource& source : fit.field.sources())
    if (!source.at_m.isZero())
      box.reach_m = std::min(box.reach_m, kReachOfSourceDistance * box.distance_m(source.at_m));
  return box;
}

/// What a field leaves at the places beyond what their noise and tolerance allow, as an RMS: by the distance below
/// which nine in ten are, so that a few slips of the hand do not count. Nothing where no tolerance is stated, nor where
/// it is no more than places of so many scatter by.
double unmodelled_m(const FitData& data, const HarmonicFit& fit, const HeldField& field) {
  constexpr double kNineInTen = 6.2514 / 3.0;  // Quantile of chi-square of three over three.
  constexpr double kStandsOut = 2.0;           // Of the variance.
  if (!(data.jig_sd_m > 0.0)) return 0.0;
  std::vector<double> squares_m2;
  double noise_m2 = 3.0 * data.jig_sd_m * data.jig_sd_m;
  for (std::size_t i = 0; i < data.size(); ++i) {
    squares_m2.push_back(
        (field.truePosition_m(data.p_tracked_m[i]) - fit.field_from_truth * data.p_true_m[i]).squaredNorm());
    if (!data.noise_m2.empty()) noise_m2 += data.noise_m2[i].trace() / static_cast<double>(data.size());
  }
  const auto ninth = squares_m2.begin() + static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(squares_m2.size()));
  std::nth_element(squares_m2.begin(), ninth, squares_m2.end());
  const double left_m2 = *ninth / kNineInTen;
  return left_m2 > kStandsOut * noise_m2 ? std::sqrt(left_m2 - noise_m2) : 0.0;
}

/// @param without_sources what is said where there are none
std::unique_ptr<PositionModel> modelOf(const FitData& data, const HarmonicFit& fit, const char* without_sources) {
  HeldField field(fit.field, boxOf(data, fit));
  const double more_m = unmodelled_m(data, fit, field);
  const char* const why = more_m > 0.0 ? kNoSuchField : without_sources;
  return std::make_unique<HarmonicField>(std::move(field), fit.field_from_truth,
                                         largestError_m(data, fit.field_from_truth), more_m, fit.posterior,
                                         noteOf(data, fit, why));
}

/// Of what a model leaves at the places; of what there is, without one.
double squaresLeft_m2(const FitData& data, const PositionModel* model) {
  double sum_m2 = 0.0;
  for (std::size_t i = 0; i < data.size(); ++i) {
    const Eigen::Vector3d& p_m = data.p_tracked_m[i];
    const Eigen::Vector3d move_m = model == nullptr ? Eigen::Vector3d::Zero() : model->displacement_m(p_m);
    sum_m2 += (p_m + move_m - data.p_true_m[i]).squaredNorm();
  }
  return sum_m2;
}

Result<std::unique_ptr<PositionModel>> fitHarmonic(const FitData& data, const Settings& settings,
                                                   const RunControl& control) {
  FT_TRY_VOID(checkPositions(data, kName));
  FT_TRY_VOID(checkSpread(kName, data.size(), std::min(data.dimension, pointSpread(data.p_tracked_m).dimension)));
  FT_TRY_VOID(MemoryBooking::book(std::string(kName) + " on " + std::to_string(data.size()) + " rows",
                                  memory_bytes(data.size()), control.stop));
  const HarmonicOptions options{numberSetting(settings, "least_gain"),
                                static_cast<std::size_t>(integerSetting(settings, "most_sources"))};
  FT_TRY(const auto fit, fitHarmonicField(data, options, control));
  auto model = modelOf(data, fit, kNoDisturbance);
  if (fit.field.sources().empty() || squaresLeft_m2(data, model.get()) <= squaresLeft_m2(data, nullptr)) return model;
  // Readings that no dipole tracker gives can lead the fit to a field that folds back over most of them.
  HarmonicOptions without = options;
  without.most_sources = 0;
  FT_TRY(const auto rigid, fitHarmonicField(data, without, control));
  return modelOf(data, rigid, kNoSuchField);
}

FieldPosterior posteriorFrom(const JsonReader& parameters, const std::vector<FieldSource>& sources) {
  FieldPosterior posterior;
  for (const FieldSource& source : sources) posterior.sources.emplace_back(source);
  posterior.about_m = parameters["turned_about_m"].vector3();
  const auto packed = parameters["covariance_root"].numbers();
  const auto n = kPerChosen * static_cast<Eigen::Index>(sources.size()) + 6;
  if (packed.size() != static_cast<std::size_t>(n * (n + 1) / 2))
    parameters["covariance_root"].refuse(std::to_string(n * (n + 1) / 2) + " numbers");
  posterior.root = Eigen::MatrixXd::Zero(n, n);
  auto next = packed.begin();
  for (Eigen::Index row = 0; row < n; ++row)
    for (Eigen::Index column = row; column < n; ++column) posterior.root(row, column) = *next++;
  return posterior;
}

}  // namespace

std::unique_ptr<PositionModel> readHarmonicFieldPosition(const JsonReader& parameters) {
  const Eigen::MatrixXd rows = parameters["sources"].matrix(12);
  std::vector<FieldSource> sources(static_cast<std::size_t>(rows.rows()));
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    const Eigen::Matrix<double, 9, 1> response = rows.row(k).tail<9>().transpose();
    sources[static_cast<std::size_t>(k)] = {rows.row(k).head<3>().transpose(),
                                            Eigen::Map<const Eigen::Matrix3d>(response.data())};
  }
  const SoftBox box{parameters["low_m"].vector3(), parameters["high_m"].vector3(), parameters["reach_m"].number()};
  if (!(box.reach_m >= 0.0)) parameters["reach_m"].refuse("0 or above");
  const double largest_m = parameters["largest_m"].number();
  if (!(largest_m >= 0.0)) parameters["largest_m"].refuse("0 or above");
  const auto more = parameters.find("unmodelled_m");
  const double more_m = more ? more->number() : 0.0;
  if (!(more_m >= 0.0)) more->refuse("0 or above");
  FieldPosterior posterior = posteriorFrom(parameters, sources);
  return std::make_unique<HarmonicField>(HeldField(DisturbedField(std::move(sources)), box),
                                         parameters["field_from_truth"].pose(), largest_m, more_m, std::move(posterior),
                                         parameters["note"].text());
}

/// A correction that knows what the error is made of. Metal near a tracker adds to each transmitter coil's field one
/// that has neither divergence nor curl where the sensor goes, so its potential obeys Laplace's equation there and can
/// be made by sources outside. The tracker solves the sum for a pose as if the transmitter were alone. So the model is
/// the field itself, a few dipoles outside the measured box, each answering the transmitter's field there through a
/// symmetric tensor (reciprocity), and not the displacement: it is put through the tracker's own solution, and a
/// tracked position is corrected by finding the place that would be tracked there.
///
/// Where the sources stand, how many there are and how strong they may be is decided by the marginal likelihood, given
/// the tolerance of the jig and the noise of each place. A rigid motion of the truth is fitted with them, since the
/// alignment was found from disturbed positions. Trackers that are not dipole trackers get a poor model and, by the
/// same likelihood, few sources; choose by held-out error.
/// @source Jackson 1999, Classical Electrodynamics, sections 5.4 and 1.8 (harmonic potentials from exterior sources);
/// Raab, Blood, Steiner, Jones 1979 (dipole tracker, induced dipoles); Tipping and Faul 2003 (choice of the sources)
PositionMethod harmonicFieldPosition() {
  const Setting least_gain = declare::number("least_gain", "Evidence a source must add", {0.5, 50.0, "nats"}, 6.0,
                                             "A further source of disturbance is believed in when it raises the "
                                             "logarithm of the marginal likelihood by this; larger is smoother.");
  const Setting most_sources =
      declare::integer("most_sources", "Most sources", {0, 80}, 40,
                       "No more sources of disturbance than this are placed outside the region.");
  PositionMethod method;
  method.id = "harmonic_field";
  method.label = "Harmonic field";
  method.source =
      "Jackson 1999, sections 1.8 and 5.4; Raab, Blood, Steiner, Jones 1979; sources chosen as in Tipping and Faul "
      "2003";
  method.settings = {least_gain, most_sources};
  method.fit = fitHarmonic;
  method.read = readHarmonicFieldPosition;
  method.cost = FitCost::kCostly;
  method.tuning = Tuning::kAlways;
  method.origin = MethodOrigin::kLater;
  method.tries = {{"", simplicity::kPhysical}};
  return method;
}

}  // namespace fieldtrue::correctors
