#include <Eigen/LU>
#include <algorithm>
#include <numeric>

#include "calib/correctors/base/fit_rows.h"
#include "calib/correctors/base/hold_out_rows.h"
#include "calib/correctors/multiquadric/hmq.h"
#include "calib/correctors/multiquadric/hmq_position.h"
#include "calib/correctors/multiquadric/hmq_system.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::correctors {
namespace {

/// Places at which a downdated field is tried against its true positions.
constexpr Eigen::Index kProbes = 8;

class HmqHoldOut : public HoldOutFits<PositionModel> {
 public:
  /// @param alpha one row a place: of the true x, y, z and of the constant 1
  HmqHoldOut(const FitData& data, const HmqProblem& problem, Eigen::MatrixXd inverse, Eigen::MatrixXd alpha)
      : data_(data), problem_(problem), inverse_(std::move(inverse)), alpha_(std::move(alpha)) {}

  Result<std::unique_ptr<PositionModel>> without(std::span<const std::size_t> rows,
                                                 const Pose& fold_from_data) const override {
    FitData rest = rowsOfFitData(data_, rowsWithout(data_.size(), rows));
    for (Eigen::Vector3d& p_m : rest.p_true_m) p_m = fold_from_data * p_m;
    FT_TRY_VOID(checkPositions(rest, problem_.name));
    FT_TRY_VOID(checkSpread(problem_.name, placesLeft(problem_.places, rows), pointSpread(rest.p_true_m).dimension));
    if (const auto out = placesOfRows(problem_.places, rows)) {
      MultiquadricField field = downdated(*out, fold_from_data);
      if (passesThroughPlaces(field, *out, fold_from_data)) return modelOf(std::move(field));
    }
    const Places places = mergePlaces(rest);
    return MultiquadricField::fit(problem_.name, places, truthMatrix(places), problem_.r2.r2_m2, {})
        .map([&](MultiquadricField field) { return modelOf(std::move(field)); });
  }

  /// The jackknife over places: by how much the squares left at all others grow as a place is left out with each.
  double ownVariance() const override {
    const Eigen::ArrayXd diagonal = inverse_.diagonal();
    const Eigen::ArrayX3d alpha = alpha_.leftCols<3>();
    const Eigen::ArrayXd squares = (alpha.colwise() / diagonal).square().rowwise().sum();
    Eigen::ArrayXd grown(squares.size());
    for (Eigen::Index j = 0; j < squares.size(); ++j) {
      const Eigen::ArrayXd column = inverse_.col(j);
      const Eigen::ArrayX3d numerators = diagonal[j] * alpha - (column.matrix() * alpha.row(j).matrix()).array();
      Eigen::ArrayXd without_both =
          (numerators.colwise() / (diagonal * diagonal[j] - column.square())).square().rowwise().sum();
      without_both[j] = squares[j];
      grown[j] = without_both.sum() - squares.sum();
    }
    return squares.sum() > 0.0 ? (grown - grown.mean()).square().sum() / (squares.sum() * squares.sum()) : 0.0;
  }

 private:
  std::unique_ptr<PositionModel> modelOf(MultiquadricField field) const {
    return std::make_unique<HmqPosition>(std::move(field), problem_.r2.note);
  }

  std::vector<Eigen::Index> placesWithout(std::span<const std::size_t> out) const {
    std::vector<Eigen::Index> all(problem_.places.size());
    std::iota(all.begin(), all.end(), Eigen::Index{0});
    return withoutPlaces(all, out);
  }

  MultiquadricField downdated(const std::vector<std::size_t>& out, const Pose& fold_from_data) const {
    const Eigen::MatrixXd shares = inverse_(out, out).partialPivLu().solve(alpha_(out, Eigen::all));
    Eigen::MatrixXd alpha = alpha_;
    // Column by column: only the columns left out are read, each from one place in memory.
    for (std::size_t b = 0; b < out.size(); ++b)
      alpha -= inverse_.col(static_cast<Eigen::Index>(out[b])) * shares.row(static_cast<Eigen::Index>(b));
    const std::vector<Eigen::Index> kept = placesWithout(out);
    alpha = alpha(kept, Eigen::all).eval();
    const Eigen::Matrix3d rotation = fold_from_data.orientation.toRotationMatrix();
    return {positionMatrix(problem_.places)(kept, Eigen::all),
            alpha.leftCols<3>() * rotation.transpose() + alpha.col(3) * fold_from_data.position_m.transpose(),
            problem_.r2.r2_m2};
  }

  bool passesThroughPlaces(const MultiquadricField& field, const std::vector<std::size_t>& out,
                           const Pose& fold_from_data) const {
    const std::vector<Eigen::Vector3d> p_true_m = withoutPlaces(problem_.places.p_true_m, out);
    const auto n_rest = static_cast<Eigen::Index>(p_true_m.size());
    const Eigen::Index n_probes = std::min(kProbes, n_rest);
    for (Eigen::Index i = 0; i < n_probes; ++i) {
      const Eigen::Index at = i * n_rest / n_probes;
      const Eigen::Vector3d miss_m =
          field.value3(field.centers_m().row(at).transpose()) - fold_from_data * p_true_m[static_cast<std::size_t>(at)];
      if (!(miss_m.norm() <= kRoundingLimit_m)) return false;
    }
    return true;
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
  FT_TRY(auto system, MultiquadricSystem::factorise(problem.name, problem.places, problem.r2.r2_m2, control));
  Eigen::MatrixXd values(static_cast<Eigen::Index>(problem.places.size()), 4);
  values << truthMatrix(problem.places), Eigen::VectorXd::Ones(values.rows());
  FT_TRY(auto alpha, system.solve(values));
  return std::make_unique<HmqHoldOut>(data, problem, std::move(system).takeInverse(), std::move(alpha));
}

}  // namespace fieldtrue::correctors
