#include "calib/correctors/gaussian_process/pose_process.h"

#include <cmath>
#include <mutex>

#include "calib/correctors/baked/turning_lattices_maker.h"
#include "calib/correctors/base/fit_memory.h"
#include "calib/correctors/gaussian_process/gaussian_process_posterior.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::correctors {
namespace {

const std::string kProcessOverPoses = "A Gaussian process over poses";

double squareOf(double value) { return value * value; }

/// What is asked for when it is first needed: views ask for uncertainty, evaluation does not.
struct LazyPosePosterior {
  std::once_flag once;
  std::optional<GaussianProcessPosterior> posterior;
};

/// Means over the orientations that were fitted: of matern(chord) with each row, and over all pairs of them.
struct MeanTurn {
  std::once_flag once;
  Eigen::VectorXd with_rows;
  double among = 0.0;
  std::optional<RadialField> field;  ///< The part that turns, at the mean.
};

class PosePosition : public PositionModel {
 public:
  PosePosition(RadialKernel kernel, const FieldFrame& frame, const PoseScales& scales, PoseRows rows,
               RadialSolution solution, std::string note)
      : frame_(frame),
        scales_(scales),
        rows_(std::move(rows)),
        solution_(std::move(solution)),
        field_(kernel, 0.0, scaledFrame(frame, scales.field), rows_.p_m,
               {squareOf(scales.field.signal_sd_m) * solution_.coefficients, solution_.tail}),
        turned_(turnedField(squareOf(scales.turn_sd_m) * solution_.coefficients)),
        note_(std::move(note)) {}

  bool takesOrientation() const override { return true; }
  Eigen::Vector3d displacementAt_m(const Pose& tracked) const override {
    const Eigen::VectorXd weights = turned_.kernelValues(tracked.position_m).cwiseProduct(turnAt(tracked.orientation));
    return field_.value(tracked.position_m) +
           squareOf(scales_.turn_sd_m) * (solution_.coefficients.transpose() * weights);
  }
  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return field_.value(p_tracked_m) + meanTurn().field->value(p_tracked_m);
  }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override {
    return Eigen::Matrix3d::Identity() + field_.gradient(p_tracked_m) + meanTurn().field->gradient(p_tracked_m);
  }
  std::optional<double> uncertaintyAt_m(const Pose& tracked) const override {
    return sd_m(tracked.position_m, turnAt(tracked.orientation), 1.0);
  }
  /// Of the mean over the orientations that were fitted, and of how far one of them may be from it.
  std::optional<double> uncertainty_m(const Eigen::Vector3d& p_tracked_m) const override {
    return sd_m(p_tracked_m, meanTurn().with_rows, meanTurn().among);
  }
  std::optional<Eigen::VectorXd> weightsAt(const Pose& tracked) const override {
    const GaussianProcessPosterior* known = posterior();
    if (known == nullptr) return std::nullopt;
    return known->weights(covarianceWith(tracked.position_m, turnAt(tracked.orientation)), tailAt(tracked.position_m));
  }
  std::string note() const override { return note_; }
  Result<std::unique_ptr<PositionModel>> onLattices(const LatticeMaker& maker, double max_deviation_m) const override {
    const TurningPart part{field_.kernel(),
                           turnFrame(frame_, scales_),
                           rows_.p_m,
                           rows_.q,
                           squareOf(scales_.turn_sd_m) * solution_.coefficients,
                           scales_.turn_length_rad};
    return makeTurningLattices(StillPart(*this), part, maker, max_deviation_m);
  }

  nlohmann::json parameters() const override {
    nlohmann::json positions = nlohmann::json::array(), orientations = nlohmann::json::array();
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      positions.push_back(jsonOf(rows_.p_m[i]));
      orientations.push_back(jsonOf(rows_.q[i]));
    }
    return {{"pose",
             {{"kernel", toText(field_.kernel())},
              {"frame", frame_.toJson()},
              {"length_m", jsonOf(scales_.field.length_m)},
              {"signal_sd_m", scales_.field.signal_sd_m},
              {"nugget_sd_m", scales_.field.nugget_sd_m},
              {"row_sd_m", scales_.row_sd_m},
              {"turn_sd_m", scales_.turn_sd_m},
              {"turn_stretch", scales_.turn_stretch},
              {"turn_length_rad", scales_.turn_length_rad},
              {"positions_m", std::move(positions)},
              {"orientations_wxyz", std::move(orientations)},
              {"place", rows_.place},
              {"noise_m2", rows_.noise_m2},
              {"placing_m2", rows_.placing_m2},
              {"coefficients", jsonOf(solution_.coefficients)},
              {"tail", jsonOf(solution_.tail)}}},
            {"note", note_}};
  }

 private:
  /// What does not change as the sensor turns, with the uncertainty of the mean over the orientations.
  class StillPart : public PositionModel {
   public:
    explicit StillPart(const PosePosition& whole) : whole_(whole) {}
    Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_m) const override { return whole_.field_.value(p_m); }
    std::optional<double> uncertainty_m(const Eigen::Vector3d& p_m) const override { return whole_.uncertainty_m(p_m); }
    nlohmann::json parameters() const override { return {}; }

   private:
    const PosePosition& whole_;
  };

  RadialField turnedField(const Eigen::MatrixXd& coefficients) const {
    return {field_.kernel(),
            0.0,
            turnFrame(frame_, scales_),
            rows_.p_m,
            {coefficients, Eigen::MatrixXd::Zero(solution_.tail.rows(), 3)}};
  }

  Eigen::VectorXd turnAt(const Eigen::Quaterniond& q) const {
    return turnCorrelation(field_.kernel(), scales_.turn_length_rad, q.normalized(), rows_.q);
  }

  const MeanTurn& meanTurn() const {
    std::call_once(mean_->once, [this] {
      const std::vector<Eigen::Quaterniond> seen = distinctRotations(rows_.q, kSameOrientation_rad);
      const double share = 1.0 / static_cast<double>(seen.size());
      mean_->with_rows = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(rows_.size()));
      for (const Eigen::Quaterniond& q : seen) {
        mean_->with_rows += share * turnAt(q);
        mean_->among += share * turnCorrelation(field_.kernel(), scales_.turn_length_rad, q.normalized(), seen).mean();
      }
      mean_->field =
          turnedField(squareOf(scales_.turn_sd_m) * (mean_->with_rows.asDiagonal() * solution_.coefficients));
    });
    return *mean_;
  }

  /// 3-D, of the field and of what the fit found neither smooth nor stated as noise.
  /// @param turn correlation of the orientation with each row's; @param among of it with itself
  std::optional<double> sd_m(const Eigen::Vector3d& p_m, const Eigen::VectorXd& turn, double among) const {
    const GaussianProcessPosterior* known = posterior();
    if (known == nullptr) return std::nullopt;
    const double signal_m2 = squareOf(scales_.field.signal_sd_m), turn_m2 = squareOf(scales_.turn_sd_m);
    const double field_m2 = known->variance_m2(signal_m2 + turn_m2 * among, covarianceWith(p_m, turn), tailAt(p_m)) +
                            turn_m2 * (1.0 - among);
    return std::sqrt(3.0 * (field_m2 + squareOf(scales_.field.nugget_sd_m) + squareOf(scales_.row_sd_m)));
  }

  /// @return null where memory does not suffice
  const GaussianProcessPosterior* posterior() const {
    std::call_once(lazy_->once, [this] {
      const auto n = static_cast<double>(rows_.size());
      if (checkMemory("The uncertainty of " + kProcessOverPoses, kGaussianProcessMatrices * 8.0 * n * n))
        lazy_->posterior = GaussianProcessPosterior::of(frame_.tail(rows_.p_m),
                                                        poseCovariance(field_.kernel(), frame_, scales_, rows_));
    });
    return lazy_->posterior ? &*lazy_->posterior : nullptr;
  }
  Eigen::VectorXd covarianceWith(const Eigen::Vector3d& p_m, const Eigen::VectorXd& turn) const {
    return squareOf(scales_.field.signal_sd_m) * field_.kernelValues(p_m) +
           squareOf(scales_.turn_sd_m) * turned_.kernelValues(p_m).cwiseProduct(turn);
  }
  Eigen::VectorXd tailAt(const Eigen::Vector3d& p_m) const {
    return frame_.tail(std::span(&p_m, 1)).row(0).transpose();
  }

  FieldFrame frame_;
  PoseScales scales_;
  PoseRows rows_;
  RadialSolution solution_;  ///< Of the covariance matrix.
  RadialField field_;        ///< What does not change as the sensor turns, and the trend.
  RadialField turned_;
  std::string note_;
  std::unique_ptr<MeanTurn> mean_ = std::make_unique<MeanTurn>();
  std::unique_ptr<LazyPosePosterior> lazy_ = std::make_unique<LazyPosePosterior>();
};

Eigen::MatrixXd covarianceOf(const PoseSystem& system) {
  return poseCovariance(system.kernel, system.frame, system.scales, system.rows);
}

/// The trend is in the coordinates of the part that does not turn.
std::optional<TailProjection> projectionOf(const PoseSystem& system) {
  return TailProjection::of(scaledFrame(system.frame, system.scales.field).tail(system.rows.p_m));
}

tl::unexpected<Error> notSolvable(const PoseSystem& system) {
  if (!projectionOf(system)) return tl::unexpected(degenerateTail(kProcessOverPoses, system.rows.size()));
  return fail(ErrorCode::kDegenerate, kProcessOverPoses +
                                          ": rounding spoils the solution, since its noise is too small " +
                                          "beside the field; state the places' noise or the jig's tolerance");
}

class PoseHoldOut : public HoldOutFits<PositionModel> {
 public:
  PoseHoldOut(PoseSystem system, RadialHoldOut solutions)
      : system_(std::move(system)), solutions_(std::move(solutions)) {}

  Result<std::unique_ptr<PositionModel>> without(std::span<const std::size_t> rows,
                                                 const Pose& fold_from_data) const override {
    auto solution = solutions_.without(rows, fold_from_data);
    if (!solution) return tl::unexpected(degenerateTail(kProcessOverPoses, system_.rows.size() - rows.size()));
    return std::make_unique<PosePosition>(system_.kernel, system_.frame, system_.scales, system_.rows.without(rows),
                                          *std::move(solution), system_.note);
  }

 private:
  PoseSystem system_;
  RadialHoldOut solutions_;
};

}  // namespace

Result<std::unique_ptr<PositionModel>> fitPoses(const PoseSystem& system) {
  const auto projection = projectionOf(system);
  if (!projection) return notSolvable(system);
  auto solution = solveRadial(*projection, covarianceOf(system), system.displacement_m);
  if (!solution) return notSolvable(system);
  return std::make_unique<PosePosition>(system.kernel, system.frame, system.scales, system.rows, *std::move(solution),
                                        system.note);
}

Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutPoses(PoseSystem system) {
  const auto projection = projectionOf(system);
  if (!projection) return notSolvable(system);
  auto solutions = RadialHoldOut::of(*projection, covarianceOf(system), system.displacement_m, system.tracked_m);
  if (!solutions) return notSolvable(system);
  return std::make_unique<PoseHoldOut>(std::move(system), *std::move(solutions));
}

std::unique_ptr<PositionModel> readPoses(const JsonReader& parameters) {
  const JsonReader pose = parameters["pose"];
  const auto kernel = radialKernelFrom(pose["kernel"].text());
  if (!kernel) pose["kernel"].refuse("the name of a kernel");
  const FieldFrame frame = FieldFrame::fromJson(pose["frame"]);
  PoseScales scales;
  scales.field.length_m = pose["length_m"].vector3();
  // A field that hardly bends has lengths of kilometres and an SD to match: their ratio alone is determined.
  constexpr Bounds kSd_m{0.0, 1e12}, kPositive{1e-12, 1e12};
  for (int axis = 0; axis < 3; ++axis)
    if (!(scales.field.length_m[axis] > 0.0)) pose["length_m"].refuse("three lengths above 0");
  scales.field.signal_sd_m = pose["signal_sd_m"].number(kSd_m, "m");
  scales.field.nugget_sd_m = pose["nugget_sd_m"].number(kSd_m, "m");
  scales.row_sd_m = pose["row_sd_m"].number(kSd_m, "m");
  scales.turn_sd_m = pose["turn_sd_m"].number(kSd_m, "m");
  scales.turn_stretch = pose["turn_stretch"].number(kPositive, "");
  scales.turn_length_rad = pose["turn_length_rad"].number(kPositive, "rad");
  PoseRows rows;
  const Eigen::MatrixXd positions_m = pose["positions_m"].matrix(3);
  for (Eigen::Index i = 0; i < positions_m.rows(); ++i) rows.p_m.emplace_back(positions_m.row(i).transpose());
  const Eigen::MatrixXd orientations = pose["orientations_wxyz"].matrix(4);
  for (Eigen::Index i = 0; i < orientations.rows(); ++i)
    rows.q.emplace_back(orientations(i, 0), orientations(i, 1), orientations(i, 2), orientations(i, 3));
  for (const double place : pose["place"].numbers()) rows.place.push_back(static_cast<std::size_t>(place));
  rows.noise_m2 = pose["noise_m2"].numbers();
  rows.placing_m2 = pose["placing_m2"].number();
  RadialSolution solution{pose["coefficients"].matrix(3), pose["tail"].matrix(3)};
  const std::size_t n = rows.p_m.size();
  if (rows.q.size() != n || rows.place.size() != n || rows.noise_m2.size() != n ||
      solution.coefficients.rows() != positions_m.rows() || solution.tail.rows() != 1 + frame.dimension)
    pose.fail(
        "needs an orientation, a place, a noise and a coefficient for each position, and a tail of the frame's "
        "dimension.");
  return std::make_unique<PosePosition>(*kernel, frame, scales, std::move(rows), std::move(solution),
                                        parameters["note"].text());
}

}  // namespace fieldtrue::correctors
