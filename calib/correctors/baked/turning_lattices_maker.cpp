#include "calib/correctors/baked/turning_lattices_maker.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>

#include "calib/correctors/baked/turning_lattices.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/numerics/dense_solver.h"
#include "calib/correctors/radial/turn_correlation.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::correctors {
namespace {

/// Shares of the bound: of what does not turn, of the lattices of what does, of the functions left away.
constexpr double kOfStill = 0.4, kOfTurning = 0.25, kOfLeftAway = 0.35;
/// What the kernel of an orientation may keep beside those that span it, of 1.
constexpr double kLeastPivot = 1e-7;
constexpr std::size_t kPlacesLookedAt = 300;
constexpr std::size_t kTurnsLookedAt = 300;

class FieldPart : public PositionModel {
 public:
  explicit FieldPart(RadialField field) : field_(std::move(field)) {}
  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_m) const override { return field_.value(p_m); }
  nlohmann::json parameters() const override { return {}; }

 private:
  RadialField field_;
};

/// Rows whose orientations span those of all, to kLeastPivot.
std::vector<std::size_t> spanningRows(const TurningPart& part) {
  const std::size_t n = part.q.size();
  Eigen::VectorXd left = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(n));
  Eigen::MatrixXd columns(left.size(), 0);
  std::vector<std::size_t> chosen;
  while (chosen.size() < std::min(n, TurnBasis::kMostCenters)) {
    Eigen::Index pivot = 0;
    const double largest = left.maxCoeff(&pivot);
    if (largest < kLeastPivot) break;
    Eigen::VectorXd column =
        turnCorrelation(part.kernel, part.length_rad, part.q[static_cast<std::size_t>(pivot)], part.q);
    column.noalias() -= columns * columns.row(pivot).transpose();
    column /= std::sqrt(largest);
    left -= column.cwiseAbs2();
    columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
    columns.rightCols<1>() = column;
    chosen.push_back(static_cast<std::size_t>(pivot));
  }
  return chosen;
}

/// Every so many-th, as many as are looked at.
template <class Value>
std::vector<Value> thinned(const std::vector<Value>& values, std::size_t most) {
  const std::size_t step = (values.size() + most - 1) / most;
  std::vector<Value> some;
  for (std::size_t i = 0; i < values.size(); i += step) some.push_back(values[i]);
  return some;
}

/// Orientations at which the functions are compared: those of the rows, turned a little, and random ones.
std::vector<Eigen::Quaterniond> turnsLookedAt(const TurningPart& part) {
  std::mt19937_64 generator(2);
  const auto uniform = [&] { return static_cast<double>(generator() >> 11) * 0x1p-52 - 1.0; };
  std::vector<Eigen::Quaterniond> turns;
  for (const Eigen::Quaterniond& q : thinned(part.q, kTurnsLookedAt / 2)) {
    const Eigen::Vector3d turned_rad(uniform(), uniform(), uniform());
    turns.push_back(rotationFromVector(0.3 * turned_rad) * q);
  }
  while (turns.size() < kTurnsLookedAt) {
    const Eigen::Vector4d random(uniform(), uniform(), uniform(), uniform());
    if (random.squaredNorm() <= 1.0) turns.push_back(Eigen::Quaterniond(random).normalized());
  }
  return turns;
}

Eigen::MatrixXd correlations(const TurningPart& part, const std::vector<Eigen::Quaterniond>& of,
                             const std::vector<Eigen::Quaterniond>& with) {
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(of.size()), static_cast<Eigen::Index>(with.size()));
  for (std::size_t i = 0; i < of.size(); ++i)
    matrix.row(static_cast<Eigen::Index>(i)) = turnCorrelation(part.kernel, part.length_rad, of[i], with).transpose();
  return matrix;
}

RadialField fieldWith(const TurningPart& part, const Eigen::MatrixXd& coefficients) {
  return {part.kernel, 0.0, part.frame, part.p_m, {coefficients, Eigen::MatrixXd::Zero(1 + part.frame.dimension, 3)}};
}

/// What turns, at places (rows, x y z one after the other) and for the functions of each spanning orientation.
/// @param of_rows the rows' kernels in terms of the spanning ones
Eigen::MatrixXd sampled(const TurningPart& part, const Eigen::MatrixXd& of_rows,
                        const std::vector<Eigen::Vector3d>& places_m) {
  const RadialField kernels = fieldWith(part, part.coefficients);
  Eigen::MatrixXd samples(3 * static_cast<Eigen::Index>(places_m.size()), of_rows.cols());
  for (std::size_t i = 0; i < places_m.size(); ++i) {
    const Eigen::VectorXd k = kernels.kernelValues(places_m[i]);
    samples.middleRows<3>(3 * static_cast<Eigen::Index>(i)) =
        (part.coefficients.array().colwise() * k.array()).matrix().transpose() * of_rows;
  }
  return samples;
}

/// The longest that any place is off where only the first functions count.
double leftAway_m(const Eigen::MatrixXd& rest) {
  double largest_m = 0.0;
  for (Eigen::Index place = 0; place < rest.rows() / 3; ++place)
    largest_m = std::max(largest_m, rest.middleRows<3>(3 * place).colwise().norm().maxCoeff());
  return largest_m;
}

tl::unexpected<Error> tooMany(const std::string& what) {
  return fail(ErrorCode::kUnsupported,
              "This correction depends on how the sensor is turned in a way that takes too many " + what +
                  " for lattices; ask for a larger deviation, or use it as it is");
}

}  // namespace

Result<std::unique_ptr<PositionModel>> makeTurningLattices(const PositionModel& still, const TurningPart& part,
                                                           const LatticeMaker& maker, double max_deviation_m) {
  TurnBasis basis{part.kernel, part.length_rad, {}, {}, {}};
  for (const std::size_t row : spanningRows(part)) basis.centers.push_back(part.q[row]);
  const Eigen::LDLT<Eigen::MatrixXd> among(correlations(part, basis.centers, basis.centers));
  const Eigen::MatrixXd of_rows = among.solve(correlations(part, basis.centers, part.q)).transpose();
  const Eigen::MatrixXd samples = sampled(part, of_rows, thinned(part.p_m, kPlacesLookedAt));
  const Eigen::MatrixXd turns = correlations(part, turnsLookedAt(part), basis.centers);
  const Eigen::MatrixXd values_m = samples * turns.transpose();
  // Principal components: of the orientations looked at, orthonormal; of the places, in metres.
  Eigen::MatrixXd of_turns = transposedTimes(values_m, values_m);
  Eigen::VectorXd squares_m2;
  if (!symmetricEigenInPlace(of_turns, squares_m2)) return tooMany("functions");
  of_turns = of_turns.rowwise().reverse().eval();
  const auto most = std::min<Eigen::Index>(of_turns.cols(), TurnBasis::kMostFunctions);
  const Eigen::MatrixXd of_places_m = times(values_m, of_turns.leftCols(most));
  Eigen::Index rank = 1;
  Eigen::MatrixXd rest = values_m;
  for (;; ++rank) {
    const auto at = rank - 1;
    rest.noalias() -= of_places_m.col(at) * of_turns.col(at).transpose();
    if (leftAway_m(rest) <= kOfLeftAway * max_deviation_m) break;
    if (rank == most) return tooMany("functions");
  }
  // Functions of the orientation of about 1, those of position in metres.
  const double scale = std::sqrt(static_cast<double>(turns.rows()));
  const Eigen::MatrixXd of_centers = turns.transpose() * of_turns.leftCols(rank) / scale;
  const Eigen::RowVectorXd sizes_m2 = of_places_m.leftCols(rank).colwise().squaredNorm();
  basis.weights = samples.transpose() * of_places_m.leftCols(rank) * scale * sizes_m2.cwiseInverse().asDiagonal();
  const std::vector<Eigen::Quaterniond> seen = distinctRotations(part.q, kSameOrientation_rad);
  basis.mean = (correlations(part, seen, basis.centers) * basis.weights).colwise().mean().transpose();
  const Eigen::RowVectorXd largest = (turns * basis.weights).cwiseAbs().colwise().maxCoeff();

  FT_TRY(auto still_lattice, maker.make(still, kOfStill * max_deviation_m));
  std::vector<std::unique_ptr<PositionModel>> turning;
  for (Eigen::Index r = 0; r < rank; ++r) {
    const Eigen::VectorXd counts = of_rows * of_centers.col(r);
    const FieldPart of_position(fieldWith(part, counts.asDiagonal() * part.coefficients));
    FT_TRY(auto lattice,
           maker.make(of_position, kOfTurning * max_deviation_m / (std::sqrt(static_cast<double>(rank)) * largest[r])));
    turning.push_back(std::move(lattice));
  }
  return std::make_unique<TurningLattices>(std::move(still_lattice), std::move(turning), std::move(basis));
}

}  // namespace fieldtrue::correctors
