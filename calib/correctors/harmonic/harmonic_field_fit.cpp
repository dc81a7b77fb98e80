#include "calib/correctors/harmonic/harmonic_field_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "calib/correctors/harmonic/harmonic_field_choices.h"
#include "calib/correctors/harmonic/harmonic_field_evidence.h"
#include "calib/correctors/harmonic/harmonic_field_sites.h"
#include "calib/correctors/harmonic/harmonic_field_slips.h"
#include "calib/correctors/harmonic/harmonic_field_step.h"
#include "calib/field/dipole_field.h"
#include "calib/field/tracker_model.h"

namespace fieldtrue::correctors {
namespace {

constexpr int kMostSteps = 30;
constexpr int kStepsOnceFinal = 6;           ///< By then it has settled, or never will.
constexpr double kSettled = 0.04;            ///< Of the noise's SD.
constexpr std::size_t kCandidatesKept = 60;  ///< Of the first step's, by what each would still add.

/// How a fit goes from step to step. Neither way is the surer one: where one goes astray, the other may not.
enum class Way {
  kCareful,  ///< Holds on to what it has: takes no step that loses it, and no fewer sources than speak for themselves.
  kBold      ///< Begins anew where the linear model says so.
};

class Fitter {
 public:
  Fitter(const FitData& data, const HarmonicOptions& options, const RunControl& control, const Pose& field_from_truth,
         Way way)
      : data_(data), options_(options), control_(control), way_(way), field_from_truth_(field_from_truth) {
    double left_m2 = 0.0;
    for (std::size_t i = 0; i < data.size(); ++i)
      left_m2 += (field_from_truth * data.p_true_m[i] - data.p_tracked_m[i]).squaredNorm() /
                 (3.0 * static_cast<double>(data.size()));
    // Where no tolerance is stated the noise starts as all that the rigid motion leaves, and not below 10 nm.
    jig_sd_m_ = data.jig_sd_m > 0.0 ? data.jig_sd_m : std::max(1e-8, std::sqrt(left_m2));
    findBox();
    sites_ = candidateSites(box_);
  }

  Result<HarmonicFit> run() {
    take(rigidMisfit(DisturbedField()));
    without_sources_m2_ = misfit_m2_;
    int n_final = 0;
    for (int step = 0; step < kMostSteps && n_final < kStepsOnceFinal; ++step) {
      n_final += is_choice_final_ ? 1 : 0;
      if (control_.stop.stop_requested()) return fail(ErrorCode::kCancelled, "The harmonic field's fit was stopped");
      const double moved_m = improve(linearisedAt(step == 0 ? firstRows() : rowsAtField()), step);
      control_.progress(static_cast<double>(step + 1) / kMostSteps);
      // Where no tolerance is stated jig_sd_m_ is all that a rigid motion leaves, which is no measure of the noise.
      if (step > 0 && moved_m < kSettled * std::sqrt(std::min(1.0, noise_factor_)) * jig_sd_m_) break;
    }
    if (misfit_m2_ > without_sources_m2_) forgetSources();
    return HarmonicFit{DisturbedField(sources()), field_from_truth_, posterior(), jig_sd_m_, noise_factor_};
  }

  /// Whether a step promised far less than the field found leaves: then it went astray.
  bool isAstray() const {
    constexpr double kFarMore = 4.0;       // Of the mean square.
    constexpr double kClosest_m2 = 1e-10;  // (10 um)^2: no closer fit is asked of exact data.
    return misfit_m2_ > kFarMore * std::max(promised_m2_, kClosest_m2);
  }

  /// What the field leaves and what its sources cost [nats], less being better.
  /// @source Schwarz 1978, Annals of Statistics 6 461
  double cost_nats() const {
    const double n = 3.0 * static_cast<double>(data_.size());
    const double unknowns = static_cast<double>(kPerChosen) * static_cast<double>(chosen_.sites.size());
    return 0.5 * (n * std::log(misfit_m2_) + unknowns * std::log(n));
  }

 private:
  /// The places as they are believed to stand in the transmitter's frame.
  void findBox() {
    box_.low_m.setConstant(std::numeric_limits<double>::infinity());
    box_.high_m = -box_.low_m;
    center_m_.setZero();
    for (const Eigen::Vector3d& p_true_m : data_.p_true_m) {
      const Eigen::Vector3d p_m = field_from_truth_ * p_true_m;
      box_.low_m = box_.low_m.cwiseMin(p_m);
      box_.high_m = box_.high_m.cwiseMax(p_m);
      center_m_ += p_m / static_cast<double>(data_.size());
    }
  }

  /// Before anything is known the truth, not the tracked position, is near the place whose field counts.
  std::vector<PlaceRow> firstRows() const {
    std::vector<PlaceRow> rows(data_.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Eigen::Vector3d p_true_m = field_from_truth_ * data_.p_true_m[i];
      rows[i].derivative = {p_true_m, -field::solvedPositionDerivative(field::dipoleField(p_true_m, 1.0), p_true_m)};
      rows[i].true_minus_corrected_m = p_true_m - data_.p_tracked_m[i];
      rows[i].whitening = whiteningOf(i, Eigen::Matrix3d::Identity());
    }
    return rows;
  }

  std::vector<PlaceRow> rowsAtField() const {
    const DisturbedField field(sources());
    std::vector<PlaceRow> rows(data_.size());
    control_.parallel_for(rows.size(), [&](std::size_t i) {
      rows[i].derivative = PlaceDerivative::at(field, corrected_m_[i]);
      rows[i].true_minus_corrected_m = field_from_truth_ * data_.p_true_m[i] - corrected_m_[i];
      rows[i].whitening = whiteningOf(i, rows[i].derivative.by_tracked);
    });
    return rows;
  }

  Eigen::Matrix3d whiteningOf(std::size_t i, const Eigen::Matrix3d& true_by_tracked) const {
    Eigen::Matrix3d noise_m2 = jig_sd_m_ * jig_sd_m_ * Eigen::Matrix3d::Identity();
    if (!data_.noise_m2.empty()) noise_m2 += true_by_tracked * data_.noise_m2[i] * true_by_tracked.transpose();
    const Eigen::Matrix3d factor = noise_m2.llt().matrixL();
    return factor.inverse();
  }

  Linearisation linearisedAt(const std::vector<PlaceRow>& rows) const {
    return linearised(rows, sites_, chosen_, box_, center_m_, control_);
  }

  /// How far the truth is from the positions that a field corrects, after the best rigid motion.
  struct Misfit {
    Pose field_from_truth;
    std::vector<Eigen::Vector3d> corrected_m;
    double mean_square_m2 = 0.0;  ///< Per axis.
  };

  Misfit rigidMisfit(const DisturbedField& field) const {
    std::vector<Eigen::Vector3d> corrected_m(data_.size());
    control_.parallel_for(data_.size(),
                          [&](std::size_t i) { corrected_m[i] = field.truePosition_m(data_.p_tracked_m[i]); });
    Misfit misfit{fitRigid(data_.p_true_m, corrected_m).value_or(field_from_truth_), std::move(corrected_m)};
    for (std::size_t i = 0; i < data_.size(); ++i)
      misfit.mean_square_m2 += (misfit.field_from_truth * data_.p_true_m[i] - misfit.corrected_m[i]).squaredNorm() /
                               (3.0 * static_cast<double>(data_.size()));
    return misfit;
  }

  /// What the field found so far makes of the places.
  void take(Misfit misfit) {
    misfit_m2_ = misfit.mean_square_m2;
    corrected_m_ = std::move(misfit.corrected_m);
  }

  /// Variance below which no fit is closer than another, in units of the one stated.
  double leastNoise() const { return data_.jig_sd_m > 0.0 ? 1.0 : 0.0; }

  /// Variance of the noise, in units of the one stated, for one step's choice of sources: while the field is far off,
  /// what the linearisation misses counts as noise too, or sources would be placed to imitate it.
  double noiseForStep() const {
    constexpr double kMissed = 0.15;  // Of the misfit.
    return std::max(noise_factor_, kMissed * kMissed * misfit_m2_ / (jig_sd_m_ * jig_sd_m_));
  }

  /// As the residual shows it, where exact data leave none.
  static double noiseOf(const GroupSelection& selection) { return std::clamp(selection.noise_factor, 1e-16, 1e16); }

  /// The sources of one step: those that a search from none finds or, near enough for the linearisation to hold, the
  /// present ones where it misses what they do together.
  GroupSelection choose(const GroupedSystem& system, const Linearisation& linear) const {
    constexpr double kNear = 0.25;                                           // Of the mean square without sources.
    const auto n_present = static_cast<Eigen::Index>(chosen_.sites.size());  // The first candidates, see refine().
    GroupSelectionOptions options{
        options_.least_gain, options_.most_sources,
        noiseForStep(),      data_.jig_sd_m <= 0.0,
        n_present,           is_choice_final_ ? variancesIn(linear, chosen_) : std::vector<double>()};
    GroupSelection found = selectGroups(system, options, control_);
    const auto n_missed = n_present - static_cast<Eigen::Index>(found.groups.size());
    if (way_ == Way::kBold || is_choice_final_ || n_missed <= 0 || misfit_m2_ > kNear * without_sources_m2_)
      return found;
    options.chosen_variances = variancesIn(linear, chosen_);
    GroupSelection present = selectGroups(system, options, control_);
    const double gain_nats = 0.5 * system.n_rows() * std::log(noiseOf(found) / noiseOf(present));
    const double cost_nats = 0.5 * static_cast<double>(kPerChosen * n_missed) * std::log(system.n_rows());
    if (gain_nats <= cost_nats) return found;
    present.gain = std::move(found.gain);
    return present;
  }

  /// One step: chooses sources, moves the truth, refines the candidates. @return RMS change of the corrected positions
  double improve(const Linearisation& linear, int step) {
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(linear.rigid);
    const Eigen::MatrixXd basis = qr.householderQ() * Eigen::MatrixXd::Identity(linear.rigid.rows(), 6);
    const GroupedSystem system(linear.design, basis, linear.y, box_.extent_m());
    const GroupSelection selection = choose(system, linear);
    const bool may_lose = step == 0 || way_ == Way::kBold;
    const double noise_before = may_lose ? std::numeric_limits<double>::infinity() : noise_factor_;
    noise_factor_ = noiseOf(selection);
    promised_m2_ = std::min(promised_m2_, std::max(leastNoise(), noise_factor_) * jig_sd_m_ * jig_sd_m_);

    Eigen::VectorXd effect = Eigen::VectorXd::Zero(linear.y.size());
    for (std::size_t k = 0; k < selection.groups.size(); ++k)
      effect += linear.design.middleCols<kPerSource>(kPerSource * selection.groups[k]) *
                selection.amplitudes.segment<kPerSource>(kPerSource * static_cast<Eigen::Index>(k));
    const Eigen::VectorXd change = effect - linear.present_effect;
    const Eigen::Matrix<double, 6, 1> motion = qr.solve(linear.y - effect);
    moveTruth(motion);
    const bool whole = keep(selection, linear, noise_before);
    if (!whole) noise_factor_ = std::min(noise_factor_, noise_before);
    choices_.add(placesOfSources_m(), misfit_m2_);
    is_choice_final_ = is_choice_final_ || choices_.isLastFinal();
    refine(selection.gain, step);
    if (!whole) return std::numeric_limits<double>::infinity();
    // Whitened by about the jig's SD.
    const double moved = std::sqrt((change + linear.rigid * motion).squaredNorm() / static_cast<double>(change.size()));
    return moved * jig_sd_m_;
  }

  void moveTruth(const Eigen::Matrix<double, 6, 1>& motion) {
    const Eigen::Quaterniond turn = rotationFromVector(motion.tail<3>());
    const Pose about_center{center_m_ + motion.head<3>() - turn * center_m_, turn};
    field_from_truth_ = about_center * field_from_truth_;
    field_from_truth_.orientation.normalize();
  }

  /// Takes the sources chosen; or, where the corrected positions would come out farther from the truth than they are, a
  /// part of the way there. @param noise_before noise factor of the step before @return whether it went all the way
  bool keep(const GroupSelection& selection, const Linearisation& linear, double noise_before) {
    const Chosen before = std::move(chosen_);
    const Chosen after = chosenBy(selection, linear);
    chosen_ = after;
    Misfit misfit = rigidMisfit(DisturbedField(sources()));
    // Near the end the likelihood may well give up a little of the fit for fewer sources; but noise that a step finds
    // because a source came to stand among the places allows nothing.
    const double noise_m2 = std::min(noise_factor_, noise_before) * jig_sd_m_ * jig_sd_m_;
    const double enough_m2 = std::max(1.1 * misfit_m2_, 1.5 * noise_m2);
    bool whole = true;
    for (double share = 0.5; !(misfit.mean_square_m2 <= enough_m2) && share > 0.05; share *= 0.5) {
      chosen_ = blended(before, after, share);
      misfit = rigidMisfit(DisturbedField(sources()));
      whole = false;
    }
    if (!whole) field_from_truth_ = misfit.field_from_truth;
    take(std::move(misfit));
    return whole;
  }

  void forgetSources() {
    chosen_ = Chosen();
    Misfit misfit = rigidMisfit(DisturbedField());
    field_from_truth_ = misfit.field_from_truth;
    noise_factor_ = std::max(noise_factor_, misfit.mean_square_m2 / (jig_sd_m_ * jig_sd_m_));
    take(std::move(misfit));
  }

  /// Candidates of the next step: those chosen, their closer neighbours, and of the rest those that offered most; all
  /// of a new lattice when the places turn out to stand elsewhere. Once the choice is final, those chosen.
  void refine(const Eigen::VectorXd& gain, int step) {
    const Box before = box_;
    findBox();
    constexpr double kMoved = 0.02;  // Of the extent: by so much a lattice may be amiss.
    const bool has_moved =
        (box_.low_m - before.low_m).norm() + (box_.high_m - before.high_m).norm() > kMoved * box_.extent_m();
    std::vector<Site> next;
    for (const Eigen::Index site : chosen_.sites) next.push_back(sites_[static_cast<std::size_t>(site)]);
    if (is_choice_final_) {
      sites_ = std::move(next);
      std::iota(chosen_.sites.begin(), chosen_.sites.end(), Eigen::Index{0});
      return;
    }
    for (std::size_t k = 0; k < chosen_.sites.size(); ++k) {
      for (const Site& site : refinedSites(next[k], box_)) next.push_back(site);
      next[k].reach_m *= 0.5;
    }
    const bool is_new_lattice = step == 0 && has_moved;
    for (const Site& site : is_new_lattice ? candidateSites(box_) : bestOthers(gain)) next.push_back(site);
    sites_ = std::move(next);
    std::iota(chosen_.sites.begin(), chosen_.sites.end(), Eigen::Index{0});
  }

  std::vector<Site> bestOthers(const Eigen::VectorXd& gain) const {
    std::vector<Eigen::Index> order(sites_.size());
    std::iota(order.begin(), order.end(), Eigen::Index{0});
    std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return gain[a] > gain[b]; });
    order.resize(std::min(order.size(), kCandidatesKept));
    std::vector<Site> others;
    for (const Eigen::Index site : order)
      if (std::find(chosen_.sites.begin(), chosen_.sites.end(), site) == chosen_.sites.end())
        others.push_back(sites_[static_cast<std::size_t>(site)]);
    return others;
  }

  const Eigen::Vector3d& placeOf_m(std::size_t source) const {
    return sites_[static_cast<std::size_t>(chosen_.sites[source])].at_m;
  }

  std::vector<Eigen::Vector3d> placesOfSources_m() const {
    std::vector<Eigen::Vector3d> places_m;
    for (std::size_t k = 0; k < chosen_.sites.size(); ++k) places_m.push_back(placeOf_m(k));
    return places_m;
  }

  std::vector<FieldSource> sources() const {
    std::vector<FieldSource> sources;
    for (std::size_t k = 0; k < chosen_.sites.size(); ++k)
      sources.push_back(sourceOf(placeOf_m(k), chosen_.tensors[k]));
    return sources;
  }

  FieldPosterior posterior() const {
    constexpr double kPlaceShare = 0.5;  // SD of where a source stands, of its distance to the places.
    std::vector<SourcePrior> priors;
    for (std::size_t k = 0; k < chosen_.sites.size(); ++k) {
      const double sd_m = kPlaceShare * box_.distance_m(placeOf_m(k));
      priors.push_back({chosen_.variances[k], std::max(sd_m * sd_m, 1e-12)});
    }
    return posteriorOf(rowsAtField(), sources(), priors, center_m_, noise_factor_);
  }

  const FitData& data_;
  const HarmonicOptions& options_;
  const RunControl& control_;
  Way way_;
  Pose field_from_truth_;
  Box box_;
  Eigen::Vector3d center_m_ = Eigen::Vector3d::Zero();
  double jig_sd_m_ = 0.0;
  double noise_factor_ = 1.0;
  std::vector<Site> sites_;
  Chosen chosen_;
  HarmonicChoices choices_;  ///< Of every step.
  bool is_choice_final_ = false;
  double misfit_m2_ = 0.0;  ///< Of the field found so far.
  double without_sources_m2_ = 0.0;
  double promised_m2_ = std::numeric_limits<double>::infinity();  ///< Least that the linear model of a step left.
  std::vector<Eigen::Vector3d> corrected_m_;                      ///< By the field found so far.
};

/// Of the two ways the likelier one.
Result<HarmonicFit> fitOfLikelierWay(const FitData& data, const HarmonicOptions& options, const RunControl& control) {
  FT_TRY(const auto field_from_truth, fitRigid(data.p_true_m, data.p_tracked_m));
  Fitter careful(data, options, control, field_from_truth, Way::kCareful);
  FT_TRY(auto fit, careful.run());
  if (!careful.isAstray()) return fit;
  RunControl quiet = control;
  quiet.progress = [](double) {};
  Fitter bold(data, options, quiet, field_from_truth, Way::kBold);
  FT_TRY(auto other, bold.run());
  return bold.cost_nats() < careful.cost_nats() ? std::move(other) : std::move(fit);
}

}  // namespace

Result<HarmonicFit> fitHarmonicField(const FitData& data, const HarmonicOptions& options, const RunControl& control) {
  FT_TRY(auto fit, fitOfLikelierWay(data, options, control));
  const auto eased = options.most_sources > 0 ? easedOfSlips(data, fit) : std::nullopt;
  if (!eased) return fit;
  RunControl quiet = control;
  quiet.progress = [](double) {};
  FT_TRY(auto other, fitOfLikelierWay(*eased, options, quiet));
  return robustCost_nats(data, other) < robustCost_nats(data, fit) ? std::move(other) : std::move(fit);
}

}  // namespace fieldtrue::correctors
