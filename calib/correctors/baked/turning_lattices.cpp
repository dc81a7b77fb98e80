#include "calib/correctors/baked/turning_lattices.h"

#include <algorithm>

#include "calib/correctors/baked/baked_lattice.h"
#include "calib/correctors/radial/rbf_field.h"
#include "calib/correctors/radial/turn_correlation.h"

namespace fieldtrue::correctors {
namespace {

constexpr std::size_t kPoseBlock = 64;

}  // namespace

void TurnBasis::evaluate(const Eigen::Quaterniond& q, double* values) const {
  std::array<double, kMostCenters> correlation;
  turnCorrelation(kernel, length_rad, q.normalized(), centers, correlation.data());
  const Eigen::Map<const Eigen::VectorXd> at(correlation.data(), static_cast<Eigen::Index>(centers.size()));
  Eigen::Map<Eigen::VectorXd>(values, weights.cols()).noalias() = weights.transpose() * at;
}

nlohmann::json TurnBasis::toJson() const {
  nlohmann::json orientations = nlohmann::json::array();
  for (const Eigen::Quaterniond& center : centers) orientations.push_back(jsonOf(center));
  return {{"kernel", toText(kernel)},
          {"length_rad", length_rad},
          {"centers_wxyz", std::move(orientations)},
          {"weights", jsonOf(weights)},
          {"mean", std::vector<double>(mean.begin(), mean.end())}};
}

TurnBasis TurnBasis::fromJson(const JsonReader& json) {
  TurnBasis basis;
  const auto kernel = radialKernelFrom(json["kernel"].text());
  if (!kernel) json["kernel"].refuse("the name of a kernel");
  basis.kernel = *kernel;
  basis.length_rad = json["length_rad"].number({1e-12, 1e12}, "rad");
  const Eigen::MatrixXd centers = json["centers_wxyz"].matrix(4);
  for (Eigen::Index i = 0; i < centers.rows(); ++i)
    basis.centers.emplace_back(centers(i, 0), centers(i, 1), centers(i, 2), centers(i, 3));
  const std::vector<double> mean = json["mean"].numbers();
  if (basis.centers.size() > kMostCenters || mean.size() > kMostFunctions || mean.empty())
    json.fail("has more orientations or functions than a baked calibration may have.");
  basis.mean = Eigen::Map<const Eigen::VectorXd>(mean.data(), static_cast<Eigen::Index>(mean.size()));
  basis.weights = json["weights"].matrix(basis.mean.size());
  if (basis.weights.rows() != centers.rows()) json["weights"].refuse("a row for each orientation");
  return basis;
}

TurningLattices::TurningLattices(std::unique_ptr<PositionModel> still,
                                 std::vector<std::unique_ptr<PositionModel>> turning, TurnBasis basis)
    : still_(std::move(still)), turning_(std::move(turning)), basis_(std::move(basis)) {
  FT_CHECK(turning_.size() == basis_.size() && basis_.size() <= TurnBasis::kMostFunctions);
  FT_CHECK(basis_.centers.size() <= TurnBasis::kMostCenters);
}

bool TurningLattices::covers(const Eigen::Vector3d& p_tracked_m) const {
  return still_->covers(p_tracked_m) &&
         std::all_of(turning_.begin(), turning_.end(),
                     [&](const std::unique_ptr<PositionModel>& part) { return part->covers(p_tracked_m); });
}

Eigen::Vector3d TurningLattices::displacement_m(const Eigen::Vector3d& p_tracked_m) const {
  Eigen::Vector3d sum_m = still_->displacement_m(p_tracked_m);
  for (std::size_t r = 0; r < turning_.size(); ++r)
    sum_m += basis_.mean[static_cast<Eigen::Index>(r)] * turning_[r]->displacement_m(p_tracked_m);
  return sum_m;
}

Eigen::Vector3d TurningLattices::displacementAt_m(const Pose& tracked) const {
  std::array<double, TurnBasis::kMostFunctions> counts;
  basis_.evaluate(tracked.orientation, counts.data());
  Eigen::Vector3d sum_m = still_->displacement_m(tracked.position_m);
  for (std::size_t r = 0; r < turning_.size(); ++r)
    sum_m += counts[r] * turning_[r]->displacement_m(tracked.position_m);
  return sum_m;
}

void TurningLattices::correctPoses(std::span<const Pose> tracked, std::span<Eigen::Vector3d> p_corrected_m) const {
  FT_CHECK(tracked.size() == p_corrected_m.size());
  std::array<Eigen::Vector3d, kPoseBlock> p_m, moved_m;
  std::array<double, kPoseBlock * TurnBasis::kMostFunctions> counts;
  for (std::size_t start = 0; start < tracked.size(); start += kPoseBlock) {
    const std::size_t count = std::min(kPoseBlock, tracked.size() - start);
    for (std::size_t i = 0; i < count; ++i) {
      p_m[i] = tracked[start + i].position_m;
      basis_.evaluate(tracked[start + i].orientation, &counts[i * basis_.size()]);
    }
    const std::span from = std::span<const Eigen::Vector3d>(p_m).first(count);
    const std::span to = std::span(moved_m).first(count);
    const std::span corrected_m = p_corrected_m.subspan(start, count);
    still_->correct(from, corrected_m);
    for (std::size_t r = 0; r < turning_.size(); ++r) {
      turning_[r]->correct(from, to);
      for (std::size_t i = 0; i < count; ++i) corrected_m[i] += counts[i * basis_.size() + r] * (to[i] - from[i]);
    }
  }
}

Eigen::Matrix3d TurningLattices::jacobian(const Eigen::Vector3d& p_tracked_m) const {
  Eigen::Matrix3d sum = still_->jacobian(p_tracked_m);
  for (std::size_t r = 0; r < turning_.size(); ++r)
    sum +=
        basis_.mean[static_cast<Eigen::Index>(r)] * (turning_[r]->jacobian(p_tracked_m) - Eigen::Matrix3d::Identity());
  return sum;
}

std::string TurningLattices::note() const {
  return still_->note() + " And " + std::to_string(turning_.size()) + " lattices for how the sensor is turned.";
}

nlohmann::json TurningLattices::parameters() const {
  nlohmann::json turning = nlohmann::json::array();
  for (const auto& lattice : turning_) turning.push_back(lattice->parameters());
  return {{"still", still_->parameters()}, {"turning", std::move(turning)}, {"basis", basis_.toJson()}};
}

std::unique_ptr<PositionModel> TurningLattices::fromJson(const JsonReader& parameters) {
  std::vector<std::unique_ptr<PositionModel>> turning;
  for (const JsonReader& lattice : parameters["turning"].entries()) turning.push_back(BakedLattice::fromJson(lattice));
  TurnBasis basis = TurnBasis::fromJson(parameters["basis"]);
  if (turning.size() != basis.size()) parameters["turning"].refuse("a lattice for each function of the basis");
  return std::make_unique<TurningLattices>(BakedLattice::fromJson(parameters["still"]), std::move(turning),
                                           std::move(basis));
}

}  // namespace fieldtrue::correctors
