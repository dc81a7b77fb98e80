#include "calib/correctors/multiquadric/hmq_hold_out.h"

#include <Eigen/LU>
#include <algorithm>

#include "calib/correctors/base/method.h"
#include "calib/correctors/multiquadric/hmq.h"
#include "calib/correctors/multiquadric/hmq_position.h"
#include "calib/correctors/multiquadric/hmq_system.h"

namespace fieldtrue::correctors {
namespace {

constexpr double kRoundingLimit_m = 1e-6;
/// Places at which a downdated field is tried against its true positions.
constexpr std::size_t kProbes = 8;

class HmqHoldOut : public HoldOutFits<PositionModel> {
 public:
  /// @param alpha one row a place: of the true x, y, z and of the constant 1
  HmqHoldOut(const FitData& data, const HmqProblem& problem, Eigen::MatrixXd inverse, Eigen::MatrixXd alpha)
      : data_(data), problem_(problem), inverse_(std::move(inverse)), alpha_(std::move(alpha)) {}

  Result<std::unique_ptr<PositionModel>> without(std::span<const std::size_t> rows,
                                                 const Pose& fold_from_data) const override {
    const Split split = splitPlaces(rows);
    FT_TRY_VOID(checkRest(rows, split));
    if (!split.is_whole_places) return refit(rows, fold_from_data);
    const Eigen::MatrixXd alpha = downdated(split);
    std::vector<Eigen::Vector3d> centers_m;
    for (const Eigen::Index place : split.rest)
      centers_m.push_back(problem_.places.p_tracked_m[static_cast<std::size_t>(place)]);
    const Eigen::Matrix3d rotation = fold_from_data.orientation.toRotationMatrix();
    MultiquadricField field(
        centers_m, alpha.leftCols<3>() * rotation.transpose() + alpha.col(3) * fold_from_data.position_m.transpose(),
        problem_.r2.r2_m2);
    if (!passesThroughPlaces(field, split, fold_from_data)) return refit(rows, fold_from_data);
    return std::make_unique<HmqPosition>(std::move(field), problem_.precision, problem_.r2.note);
  }

 private:
  struct Split {
    std::vector<Eigen::Index> left_out;
    std::vector<Eigen::Index> rest;
    bool is_whole_places = true;
  };

  Split splitPlaces(std::span<const std::size_t> rows) const {
    Split split;
    for (std::size_t place = 0; place < problem_.places.size(); ++place) {
      const std::vector<std::size_t>& visits = problem_.places.rows[place];
      const auto n_left_out = std::count_if(visits.begin(), visits.end(), [&](std::size_t row) {
        return std::binary_search(rows.begin(), rows.end(), row);
      });
      const bool all = n_left_out == static_cast<std::ptrdiff_t>(visits.size());
      (all ? split.left_out : split.rest).push_back(static_cast<Eigen::Index>(place));
      if (n_left_out > 0 && !all) split.is_whole_places = false;
    }
    return split;
  }

  Result<void> checkRest(std::span<const std::size_t> rows, const Split& split) const {
    std::vector<Eigen::Vector3d> rest_true_m;
    for (std::size_t row = 0; row < data_.size(); ++row)
      if (!std::binary_search(rows.begin(), rows.end(), row)) rest_true_m.push_back(data_.p_true_m[row]);
    if (rest_true_m.empty())
      return fail(ErrorCode::kTooFewNodes, problem_.name + " needs measured places, got none beside those left out");
    return checkHmqSpread(problem_.name, split.rest.size(), pointSpread(rest_true_m).dimension);
  }

  Eigen::MatrixXd downdated(const Split& split) const {
    if (split.left_out.empty()) return alpha_;
    const Eigen::MatrixXd inverse_bb = inverse_(split.left_out, split.left_out);
    const Eigen::MatrixXd shares = inverse_bb.partialPivLu().solve(alpha_(split.left_out, Eigen::all));
    Eigen::MatrixXd rest = alpha_;
    // Column by column: only the columns left out are read, each from one place in memory.
    for (std::size_t b = 0; b < split.left_out.size(); ++b)
      rest -= inverse_.col(split.left_out[b]) * shares.row(static_cast<Eigen::Index>(b));
    return rest(split.rest, Eigen::all);
  }

  bool passesThroughPlaces(const MultiquadricField& field, const Split& split, const Pose& fold_from_data) const {
    const std::size_t n_rest = split.rest.size();
    const std::size_t n_probes = std::min(kProbes, n_rest);
    for (std::size_t i = 0; i < n_probes; ++i) {
      const std::size_t at = i * n_rest / n_probes;
      const Eigen::Vector3d expected_m =
          fold_from_data * problem_.places.p_true_m[static_cast<std::size_t>(split.rest[at])];
      const Eigen::Vector3d p_m = field.center_m(at);
      Eigen::Vector3d f;
      field.value3(std::span(&p_m, 1), std::span(&f, 1));
      if (!((f - expected_m).norm() <= kRoundingLimit_m)) return false;
    }
    return true;
  }

  Result<std::unique_ptr<PositionModel>> refit(std::span<const std::size_t> rows, const Pose& fold_from_data) const {
    FitData rest;
    for (std::size_t row = 0; row < data_.size(); ++row) {
      if (std::binary_search(rows.begin(), rows.end(), row)) continue;
      rest.p_tracked_m.push_back(data_.p_tracked_m[row]);
      rest.p_true_m.push_back(fold_from_data * data_.p_true_m[row]);
      rest.node.push_back(data_.node[row]);
    }
    const Places places = mergePlaces(rest);
    FT_TRY(auto field, MultiquadricField::fit(problem_.name, places.p_tracked_m, places.node, places.index,
                                              truthOf(places), problem_.r2.r2_m2, {}));
    return std::make_unique<HmqPosition>(std::move(field), problem_.precision, problem_.r2.note);
  }

  FitData data_;
  HmqProblem problem_;
  Eigen::MatrixXd inverse_;
  Eigen::MatrixXd alpha_;
};

}  // namespace

Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutHmq(const FitData& data, const Settings& settings,
                                                               const RunControl& control) {
  FT_TRY(const auto problem, makeHmqProblem(data, settings, control));
  const Places& places = problem.places;
  FT_TRY(auto system, MultiquadricSystem::factorise(problem.name, places.p_tracked_m, places.node, places.index,
                                                    problem.r2.r2_m2, control));
  Eigen::MatrixXd values(static_cast<Eigen::Index>(places.size()), 4);
  values << truthOf(places), Eigen::VectorXd::Ones(values.rows());
  FT_TRY(auto alpha, system.solve(values));
  return std::make_unique<HmqHoldOut>(data, problem, std::move(system).takeInverse(), std::move(alpha));
}

}  // namespace fieldtrue::correctors
