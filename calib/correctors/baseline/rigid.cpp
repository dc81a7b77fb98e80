#include <Eigen/LU>
#include <Eigen/SVD>

#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/hold_out_rows.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"

namespace fieldtrue::correctors {
namespace {

class RigidPosition : public PositionModel {
 public:
  RigidPosition(const Pose& true_from_tracked, bool planar) : true_from_tracked_(true_from_tracked), planar_(planar) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return true_from_tracked_ * p_tracked_m - p_tracked_m;
  }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d&) const override {
    return true_from_tracked_.orientation.toRotationMatrix();
  }
  std::string note() const override {
    return planar_ ? "The places lie in one plane: they determine the motion, and nothing tests it off the plane." : "";
  }
  nlohmann::json parameters() const override {
    return {{"true_from_tracked", jsonOf(true_from_tracked_)}, {"planar", planar_}};
  }

 private:
  Pose true_from_tracked_;
  bool planar_;
};

Result<std::unique_ptr<PositionModel>> fitRigidPosition(const FitData& data, const Settings&, const RunControl&) {
  FT_TRY_VOID(checkPositions(data, "Rigid fit"));
  const std::size_t n_places = mergePlaces(data).size();
  if (n_places < 3)
    return fail(ErrorCode::kTooFewNodes, "Rigid fit needs at least 3 places, got " + std::to_string(n_places));
  if (data.dimension < 2)
    return fail(ErrorCode::kDegenerate,
                "Rigid fit needs places that are not on one line, and these " + std::to_string(n_places) + " are");
  return fitRigid(data.p_tracked_m, data.p_true_m).map([&](const Pose& pose) -> std::unique_ptr<PositionModel> {
    return std::make_unique<RigidPosition>(pose, data.dimension == 2);
  });
}

/// Sums over rows of tracked positions a and true positions b, each from the mean of all rows [m].
struct Moments {
  double n = 0.0;
  Eigen::Vector3d a = Eigen::Vector3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  Eigen::Matrix3d b_a = Eigen::Matrix3d::Zero();  ///< Of b a^T.
};

class RigidHoldOut : public HoldOutFits<PositionModel> {
 public:
  explicit RigidHoldOut(const FitData& data) : data_(data), places_(mergePlaces(data)) {
    for (std::size_t row = 0; row < data_.size(); ++row) {
      tracked_center_m_ += data_.p_tracked_m[row] / static_cast<double>(data_.size());
      true_center_m_ += data_.p_true_m[row] / static_cast<double>(data_.size());
    }
    for (std::size_t row = 0; row < data_.size(); ++row) add(row, 1.0, all_);
  }

  Result<std::unique_ptr<PositionModel>> without(std::span<const std::size_t> rows,
                                                 const Pose& fold_from_data) const override {
    const std::size_t n_places = placesLeft(places_, rows);
    if (n_places < 3)
      return fail(ErrorCode::kTooFewNodes, "Rigid fit needs at least 3 places, got " + std::to_string(n_places));
    FT_TRY(const auto true_from_tracked, poseWithout(rows));
    return std::make_unique<RigidPosition>(fold_from_data * true_from_tracked, data_.dimension == 2);
  }

 private:
  void add(std::size_t row, double sign, Moments& moments) const {
    const Eigen::Vector3d a = data_.p_tracked_m[row] - tracked_center_m_;
    const Eigen::Vector3d b = data_.p_true_m[row] - true_center_m_;
    moments.n += sign;
    moments.a += sign * a;
    moments.b += sign * b;
    moments.b_a += sign * b * a.transpose();
  }

  /// The fit of fitRigid, from the covariance of all rows less that of the rows left out.
  Result<Pose> poseWithout(std::span<const std::size_t> rows) const {
    Moments rest = all_;
    for (const std::size_t row : rows) add(row, -1.0, rest);
    const Eigen::Matrix3d covariance = rest.b_a - rest.b * rest.a.transpose() / rest.n;
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    // Near a line the difference of two sums no longer tells the turn about it.
    constexpr double kNearLine = 1e-6;
    if (!(svd.singularValues()[1] > kNearLine * svd.singularValues()[0])) return refit(rows);
    const double handedness = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
    const Eigen::Matrix3d R =
        svd.matrixU() * Eigen::Vector3d(1.0, 1.0, handedness).asDiagonal() * svd.matrixV().transpose();
    Pose pose;
    pose.orientation = canonical(Eigen::Quaterniond(R));
    pose.position_m =
        true_center_m_ + rest.b / rest.n - pose.orientation * Eigen::Vector3d(tracked_center_m_ + rest.a / rest.n);
    return pose;
  }

  Result<Pose> refit(std::span<const std::size_t> rows) const {
    std::vector<Eigen::Vector3d> p_tracked_m;
    std::vector<Eigen::Vector3d> p_true_m;
    for (const std::size_t row : rowsWithout(data_.size(), rows)) {
      p_tracked_m.push_back(data_.p_tracked_m[row]);
      p_true_m.push_back(data_.p_true_m[row]);
    }
    return fitRigid(p_tracked_m, p_true_m);
  }

  FitData data_;
  Places places_;
  Eigen::Vector3d tracked_center_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d true_center_m_ = Eigen::Vector3d::Zero();
  Moments all_;
};

Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutRigid(const FitData& data, const Settings& settings,
                                                                 const RunControl& control) {
  // What keeps all rows from being fitted keeps a part of them from it too.
  FT_TRY_VOID(fitRigidPosition(data, settings, control));
  return std::make_unique<RigidHoldOut>(data);
}

}  // namespace

std::unique_ptr<PositionModel> readRigidPosition(const JsonReader& parameters) {
  return std::make_unique<RigidPosition>(parameters["true_from_tracked"].pose(), parameters["planar"].flag());
}

PositionMethod rigidPosition() {
  return {.id = "rigid",
          .label = "Rigid motion",
          .source = "Horn 1987; Umeyama 1991 without scale",
          .settings = {},
          .fit = fitRigidPosition,
          .read = readRigidPosition,
          .hold_out = holdOutRigid,
          .origin = MethodOrigin::kBaseline,
          .tries = {{"", 1}}};
}

}  // namespace fieldtrue::correctors
