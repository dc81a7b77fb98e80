#include "calib/correctors/harmonic_field_fit.h"

#include <cblas.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "calib/correctors/harmonic_field_evidence.h"
#include "calib/field/coupling.h"

namespace fieldtrue {
namespace {

constexpr int kMostSteps = 6;
constexpr std::size_t kCandidatesKept = 90;  ///< Of the first step's, by what each would still add.

/// The six symmetric tensors, of unit norm.
const std::array<Eigen::Matrix3d, kPerSource>& symmetricTensors() {
  static const std::array<Eigen::Matrix3d, kPerSource> kTensors = [] {
    std::array<Eigen::Matrix3d, kPerSource> tensors;
    std::size_t next = 0;
    for (int a = 0; a < 3; ++a) {
      for (int b = a; b < 3; ++b) {
        Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();
        tensor(a, b) = tensor(b, a) = a == b ? 1.0 : std::sqrt(0.5);
        tensors[next++] = tensor;
      }
    }
    return tensors;
  }();
  return kTensors;
}

/// What excites a source: the transmitter's field there; at the transmitter, its coils themselves.
Eigen::Matrix3d excitation(const Eigen::Vector3d& at_m) {
  return at_m.isZero() ? Eigen::Matrix3d::Identity() : dipoleField(at_m, 1.0);
}

/// A place's part of one linearisation.
struct PlaceRow {
  Eigen::Vector3d at_m;           ///< Where the field is taken.
  Eigen::Vector3d corrected_m;    ///< Of the tracked position, by the field found so far.
  PositionDerivative derivative;  ///< d corrected / d field matrix.
  Eigen::Matrix3d whitening;      ///< Inverse Cholesky factor of the noise of corrected minus true.
};

/// The linear model of one step, rows whitened, unknowns scaled so that each source moves the places by about its
/// amplitude.
struct Linearisation {
  Eigen::MatrixXd design;                          ///< d corrected / d amplitude, 3 rows a place.
  Eigen::Matrix<double, Eigen::Dynamic, 6> rigid;  ///< d corrected / d (shift, turn) that does the same to the truth.
  Eigen::VectorXd y;                               ///< True minus corrected, plus what the present amplitudes do.
  Eigen::VectorXd present;                         ///< Present amplitudes, scaled.
  std::vector<double> scale;                       ///< Of each source: amplitude over tensor.
};

class Fitter {
 public:
  Fitter(const FitData& data, const HarmonicOptions& options, const RunControl& control, const Pose& field_from_truth)
      : data_(data), options_(options), control_(control), field_from_truth_(field_from_truth) {
    box_.low_m.setConstant(std::numeric_limits<double>::infinity());
    box_.high_m = -box_.low_m;
    double left_m2 = 0.0;
    for (std::size_t i = 0; i < data.size(); ++i) {
      const Eigen::Vector3d p_m = field_from_truth * data.p_true_m[i];
      box_.low_m = box_.low_m.cwiseMin(p_m);
      box_.high_m = box_.high_m.cwiseMax(p_m);
      center_m_ += p_m / static_cast<double>(data.size());
      left_m2 += (p_m - data.p_tracked_m[i]).squaredNorm() / (3.0 * static_cast<double>(data.size()));
    }
    // Where no tolerance is stated the noise starts as all that the rigid motion leaves, and not below 10 nm.
    jig_sd_m_ = data.jig_sd_m > 0.0 ? data.jig_sd_m : std::max(1e-8, std::sqrt(left_m2));
    sites_ = candidateSites(box_);
  }

  Result<HarmonicFit> run(const std::vector<Eigen::Vector3d>& probes_m) {
    for (int step = 0; step < kMostSteps; ++step) {
      if (control_.stop.stop_requested()) return fail(ErrorCode::kCancelled, "The harmonic field's fit was stopped");
      const std::vector<PlaceRow> rows = step == 0 ? firstRows() : rowsAtField();
      Linearisation linear = linearise(rows);
      const double moved_m = improve(linear, step);
      control_.progress(static_cast<double>(step + 1) / kMostSteps);
      if (step > 0 && moved_m < 0.02 * jig_sd_m_) break;
    }
    HarmonicFit fit{DisturbedField(sources()), field_from_truth_, probes_m, {}, noise_factor_};
    fit.sd_m = uncertainties(probes_m);
    return fit;
  }

 private:
  /// Before anything is known the truth, not the tracked position, is near the place whose field counts.
  std::vector<PlaceRow> firstRows() const {
    std::vector<PlaceRow> rows(data_.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows[i].at_m = field_from_truth_ * data_.p_true_m[i];
      rows[i].corrected_m = data_.p_tracked_m[i];
      rows[i].derivative = -solvedPositionDerivative(dipoleField(rows[i].at_m, 1.0), rows[i].at_m);
      rows[i].whitening = whiteningOf(i, Eigen::Matrix3d::Identity());
    }
    return rows;
  }

  std::vector<PlaceRow> rowsAtField() const {
    const DisturbedField field(sources());
    std::vector<PlaceRow> rows(data_.size());
    control_.parallel_for(rows.size(), [&](std::size_t i) {
      rows[i] = rowAt(field, data_.p_tracked_m[i]);
      rows[i].whitening = whiteningOf(i, field.trackedJacobian(rows[i].at_m).inverse());
    });
    return rows;
  }

  static PlaceRow rowAt(const DisturbedField& field, const Eigen::Vector3d& p_tracked_m) {
    PlaceRow row;
    row.at_m = row.corrected_m = field.truePosition_m(p_tracked_m);
    const Eigen::Matrix3d true_by_tracked = field.trackedJacobian(row.at_m).inverse();
    row.derivative = -true_by_tracked * solvedPositionDerivative(field.at(row.at_m), row.at_m);
    row.whitening.setIdentity();
    return row;
  }

  Eigen::Matrix3d whiteningOf(std::size_t i, const Eigen::Matrix3d& true_by_tracked) const {
    Eigen::Matrix3d noise_m2 = jig_sd_m_ * jig_sd_m_ * Eigen::Matrix3d::Identity();
    if (!data_.noise_m2.empty()) noise_m2 += true_by_tracked * data_.noise_m2[i] * true_by_tracked.transpose();
    const Eigen::Matrix3d factor = noise_m2.llt().matrixL();
    return factor.inverse();
  }

  /// d corrected / d amplitudes of one source at one place, before scaling.
  static Eigen::Matrix<double, 3, kPerSource> effectOf(const PlaceRow& row, const Eigen::Vector3d& at_m,
                                                       const Eigen::Matrix3d& excited) {
    const Eigen::Matrix3d from_source = dipoleField(row.at_m - at_m, 1.0);
    Eigen::Matrix<double, 3, kPerSource> effect;
    for (Eigen::Index e = 0; e < kPerSource; ++e) {
      const Eigen::Matrix3d field = from_source * symmetricTensors()[static_cast<std::size_t>(e)] * excited;
      effect.col(e) = row.derivative * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(field.data());
    }
    return effect;
  }

  /// Shift and turn about the middle of the places that, done to the truth, change true minus corrected.
  Eigen::Matrix<double, 3, 6> rigidEffect(const Eigen::Vector3d& p_m) const {
    const Eigen::Vector3d d = p_m - center_m_;
    Eigen::Matrix<double, 3, 6> effect;
    effect << -Eigen::Matrix3d::Identity(),
        (Eigen::Matrix3d() << 0.0, -d.z(), d.y(), d.z(), 0.0, -d.x(), -d.y(), d.x(), 0.0).finished();
    return effect;
  }

  Linearisation linearise(const std::vector<PlaceRow>& rows) const {
    const auto n = static_cast<Eigen::Index>(rows.size());
    const auto n_sites = static_cast<Eigen::Index>(sites_.size());
    Linearisation linear;
    linear.design.resize(3 * n, kPerSource * n_sites);
    linear.rigid.resize(3 * n, 6);
    linear.y.resize(3 * n);
    linear.present = Eigen::VectorXd::Zero(kPerSource * n_sites);
    linear.scale.resize(sites_.size());
    control_.parallel_for(sites_.size(), [&](std::size_t s) {
      const auto column = kPerSource * static_cast<Eigen::Index>(s);
      const Eigen::Matrix3d excited = excitation(sites_[s].at_m);
      double sum = 0.0;
      for (Eigen::Index i = 0; i < n; ++i) {
        const PlaceRow& row = rows[static_cast<std::size_t>(i)];
        const Eigen::Matrix<double, 3, kPerSource> effect = effectOf(row, sites_[s].at_m, excited);
        sum += effect.squaredNorm();
        linear.design.block<3, kPerSource>(3 * i, column).noalias() = row.whitening * effect;
      }
      linear.scale[s] = std::sqrt(sum / static_cast<double>(n));
      linear.design.middleCols(column, kPerSource) /= linear.scale[s];
    });
    for (std::size_t k = 0; k < chosen_.size(); ++k)
      linear.present.segment(kPerSource * chosen_[k], kPerSource) =
          linear.scale[static_cast<std::size_t>(chosen_[k])] * tensors_[k];
    for (Eigen::Index i = 0; i < n; ++i) {
      const PlaceRow& row = rows[static_cast<std::size_t>(i)];
      const Eigen::Vector3d p_true_m = field_from_truth_ * data_.p_true_m[static_cast<std::size_t>(i)];
      linear.rigid.middleRows<3>(3 * i) = row.whitening * rigidEffect(p_true_m);
      linear.y.segment<3>(3 * i) = row.whitening * (p_true_m - row.corrected_m);
    }
    linear.y += linear.design * linear.present;
    return linear;
  }

  static GroupedSystem normalEquations(const Linearisation& linear, const Eigen::MatrixXd& rigid_basis, double unit_m) {
    GroupedSystem system;
    const Eigen::VectorXd y = linear.y - rigid_basis * (rigid_basis.transpose() * linear.y);
    const Eigen::MatrixXd by_rigid = linear.design.transpose() * rigid_basis;
    const auto n_rows = static_cast<int>(linear.design.rows());
    const auto n_columns = static_cast<int>(linear.design.cols());
    system.gram.resize(n_columns, n_columns);
    cblas_dsyrk(CblasColMajor, CblasLower, CblasTrans, n_columns, n_rows, 1.0, linear.design.data(), n_rows, 0.0,
                system.gram.data(), n_columns);
    cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, n_columns, 6, -1.0, by_rigid.data(), n_columns, 1.0,
                system.gram.data(), n_columns);
    system.gram.triangularView<Eigen::StrictlyUpper>() = system.gram.transpose();
    system.right = linear.design.transpose() * y;
    system.y_squared = y.squaredNorm();
    system.n_rows = static_cast<double>(n_rows - 6);
    system.unit_m = unit_m;
    return system;
  }

  /// One step: chooses sources, moves the truth, refines the candidates. @return RMS change of the corrected positions
  double improve(const Linearisation& linear, int step) {
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(linear.rigid);
    const Eigen::MatrixXd basis = qr.householderQ() * Eigen::MatrixXd::Identity(linear.rigid.rows(), 6);
    const GroupedSystem system = normalEquations(linear, basis, box_.extent_m());
    const bool unknown = data_.jig_sd_m <= 0.0;
    const Selection selection =
        selectGroups(system, {options_.least_gain, options_.most_sources, noise_factor_, unknown}, control_);
    noise_factor_ = std::clamp(selection.noise_factor, 1e-16, 1e16);

    Eigen::VectorXd amplitudes = Eigen::VectorXd::Zero(linear.present.size());
    for (std::size_t k = 0; k < selection.groups.size(); ++k)
      amplitudes.segment(kPerSource * selection.groups[k], kPerSource) =
          selection.amplitudes.segment(kPerSource * static_cast<Eigen::Index>(k), kPerSource);
    const Eigen::VectorXd change = linear.design * (amplitudes - linear.present);
    const Eigen::Matrix<double, 6, 1> motion = qr.solve(linear.y - linear.design * amplitudes);
    moveTruth(motion);
    keep(selection, linear);
    refine(selection.gain, step);
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

  void keep(const Selection& selection, const Linearisation& linear) {
    chosen_ = selection.groups;
    prior_variance_.clear();
    tensors_.clear();
    for (std::size_t k = 0; k < chosen_.size(); ++k) {
      const double scale = linear.scale[static_cast<std::size_t>(chosen_[k])];
      tensors_.push_back(selection.amplitudes.segment(kPerSource * static_cast<Eigen::Index>(k), kPerSource) / scale);
      prior_variance_.push_back(selection.prior_variance[static_cast<Eigen::Index>(k)] / (scale * scale));
    }
  }

  /// Candidates of the next step: those chosen, their closer neighbours, and of the rest those that offered most.
  void refine(const Eigen::VectorXd& gain, int step) {
    std::vector<std::size_t> order(sites_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return gain[static_cast<Eigen::Index>(a)] > gain[static_cast<Eigen::Index>(b)];
    });
    std::vector<Site> next;
    for (const Eigen::Index site : chosen_) next.push_back(sites_[static_cast<std::size_t>(site)]);
    const bool last_steps = step + 2 >= kMostSteps;
    for (std::size_t k = 0; k < chosen_.size() && !last_steps; ++k) {
      for (const Site& site : refinedSites(next[k], box_)) next.push_back(site);
      next[k].reach_m *= 0.5;
    }
    for (std::size_t rank = 0; rank < std::min(order.size(), kCandidatesKept); ++rank) {
      const auto site = static_cast<Eigen::Index>(order[rank]);
      if (std::find(chosen_.begin(), chosen_.end(), site) == chosen_.end()) next.push_back(sites_[order[rank]]);
    }
    sites_ = std::move(next);
    std::iota(chosen_.begin(), chosen_.end(), Eigen::Index{0});
  }

  std::vector<FieldSource> sources() const {
    std::vector<FieldSource> sources;
    for (std::size_t k = 0; k < chosen_.size(); ++k) {
      const Eigen::Vector3d& at_m = sites_[static_cast<std::size_t>(chosen_[k])].at_m;
      Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();
      for (Eigen::Index e = 0; e < kPerSource; ++e)
        tensor += tensors_[k][e] * symmetricTensors()[static_cast<std::size_t>(e)];
      sources.push_back({at_m, tensor * excitation(at_m)});
    }
    return sources;
  }

  /// d corrected / d (tensors of the chosen sources, rigid motion) at a place, unscaled.
  Eigen::MatrixXd allEffects(const PlaceRow& row) const {
    const auto n_sources = static_cast<Eigen::Index>(chosen_.size());
    Eigen::MatrixXd effects(3, kPerSource * n_sources + 6);
    for (Eigen::Index k = 0; k < n_sources; ++k) {
      const Eigen::Vector3d& at_m = sites_[static_cast<std::size_t>(chosen_[static_cast<std::size_t>(k)])].at_m;
      effects.middleCols<kPerSource>(kPerSource * k) = effectOf(row, at_m, excitation(at_m));
    }
    effects.rightCols<6>() = rigidEffect(row.at_m);
    return effects;
  }

  /// Of the corrected positions, from the joint posterior of sources and rigid motion.
  std::vector<double> uncertainties(const std::vector<Eigen::Vector3d>& probes_m) const {
    const auto n_sources = static_cast<Eigen::Index>(chosen_.size());
    Eigen::MatrixXd precision = Eigen::MatrixXd::Zero(kPerSource * n_sources + 6, kPerSource * n_sources + 6);
    for (const PlaceRow& row : rowsAtField()) {
      const Eigen::MatrixXd effects = row.whitening * allEffects(row);
      precision += effects.transpose() * effects / noise_factor_;
    }
    for (Eigen::Index k = 0; k < n_sources; ++k)
      precision.diagonal().segment(kPerSource * k, kPerSource).array() +=
          1.0 / prior_variance_[static_cast<std::size_t>(k)];
    // Unknowns differ by many orders of magnitude: scaled to a unit diagonal first.
    const Eigen::VectorXd scale = precision.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::LDLT<Eigen::MatrixXd> factor(scale.asDiagonal() * precision * scale.asDiagonal());
    const DisturbedField field(sources());
    std::vector<double> sd_m(probes_m.size());
    control_.parallel_for(probes_m.size(), [&](std::size_t i) {
      const Eigen::MatrixXd effects = allEffects(rowAt(field, probes_m[i])) * scale.asDiagonal();
      sd_m[i] = std::sqrt(std::max(0.0, (effects * factor.solve(effects.transpose())).trace()));
    });
    return sd_m;
  }

  const FitData& data_;
  const HarmonicOptions& options_;
  const RunControl& control_;
  Pose field_from_truth_;
  Box box_;
  Eigen::Vector3d center_m_ = Eigen::Vector3d::Zero();
  double jig_sd_m_ = 0.0;
  double noise_factor_ = 1.0;
  std::vector<Site> sites_;
  std::vector<Eigen::Index> chosen_;  ///< Into sites_.
  std::vector<Eigen::Matrix<double, kPerSource, 1>> tensors_;
  std::vector<double> prior_variance_;  ///< Of each chosen source's tensor.
};

}  // namespace

Result<HarmonicFit> fitHarmonicField(const FitData& data, const HarmonicOptions& options,
                                     const std::vector<Eigen::Vector3d>& probes_m, const RunControl& control) {
  const auto field_from_truth = fitRigid(data.p_true_m, data.p_tracked_m);
  if (!field_from_truth) return tl::unexpected(field_from_truth.error());
  return Fitter(data, options, control, *field_from_truth).run(probes_m);
}

}  // namespace fieldtrue
