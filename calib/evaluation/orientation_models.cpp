#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "calib/core/geometry.h"
#include "calib/evaluation/orientation_rows.h"
#include "calib/evaluation/resampling.h"

namespace fieldtrue {
namespace {

/// Functions of an orientation that vary with one and with two turns of it: the nine entries of its matrix, and the
/// 25 entries of the matrix by which it turns symmetric, traceless tensors. The latter count less: smooth comes first.
constexpr Eigen::Index kDegreeOne = 9;
constexpr Eigen::Index kDegreeTwo = 25;
constexpr Eigen::Index kTerms = kDegreeOne + kDegreeTwo + 3 * kDegreeOne;
constexpr double kDegreeTwoShare = 0.5;
constexpr double kTimesPlaceShare = 0.5;
constexpr std::array<double, 6> kRidges = {1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0};
constexpr std::size_t kPlaceGroups = 5;
constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// An orthonormal basis of symmetric, traceless 3x3 matrices.
std::array<Eigen::Matrix3d, 5> tracelessBasis() {
  std::array<Eigen::Matrix3d, 5> basis;
  for (Eigen::Matrix3d& m : basis) m.setZero();
  const double half = std::sqrt(0.5);
  basis[0](0, 1) = basis[0](1, 0) = half;
  basis[1](0, 2) = basis[1](2, 0) = half;
  basis[2](1, 2) = basis[2](2, 1) = half;
  basis[3].diagonal() << half, -half, 0.0;
  basis[4].diagonal() << 1.0, 1.0, -2.0;
  basis[4] /= std::sqrt(6.0);
  return basis;
}

Eigen::RowVectorXd orientationTerms(const Eigen::Quaterniond& q, const Eigen::Vector3d& place) {
  static const std::array<Eigen::Matrix3d, 5> basis = tracelessBasis();
  const Eigen::Matrix3d R = q.toRotationMatrix();
  Eigen::RowVectorXd terms(kTerms);
  for (Eigen::Index i = 0; i < kDegreeOne; ++i) terms[i] = R(i / 3, i % 3);
  for (std::size_t a = 0; a < 5; ++a)
    for (std::size_t b = 0; b < 5; ++b)
      terms[kDegreeOne + static_cast<Eigen::Index>(5 * a + b)] =
          kDegreeTwoShare * basis[a].cwiseProduct(R * basis[b] * R.transpose()).sum();
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    terms.segment(kDegreeOne + kDegreeTwo + kDegreeOne * axis, kDegreeOne) =
        kTimesPlaceShare * place[axis] * terms.head(kDegreeOne);
  return terms;
}

/// What the models are fitted to: one row each.
struct Problem {
  Eigen::MatrixXd terms;
  Eigen::Matrix<double, Eigen::Dynamic, 3> error_deg;
  std::vector<std::size_t> place;
  std::vector<std::size_t> place_group;
  std::vector<std::size_t> group;
  std::size_t n_groups = 0;
};

Problem problemOf(const OrientationRows& rows, std::uint64_t seed) {
  const PointSpread spread = pointSpread(rows.p_tracked_m);
  const double scale_m = std::max(spread.sd_m.x(), 1e-9);
  Problem problem;
  const auto n = static_cast<Eigen::Index>(rows.size());
  problem.terms.resize(n, kTerms);
  problem.error_deg.resize(n, 3);
  std::vector<std::size_t> group_of_place(rows.n_places);
  for (std::size_t p = 0; p < rows.n_places; ++p) group_of_place[p] = p % kPlaceGroups;
  IndexSource source(seed);
  for (std::size_t p = rows.n_places; p > 1; --p) std::swap(group_of_place[p - 1], group_of_place[source.below(p)]);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    problem.terms.row(row) = orientationTerms(rows.q_true[i], (rows.p_tracked_m[i] - spread.center_m) / scale_m);
    problem.error_deg.row(row) = rows.error_deg[i].transpose();
    problem.place_group.push_back(group_of_place[rows.place[i]]);
  }
  problem.place = rows.place;
  problem.group = rows.group;
  problem.n_groups = rows.n_groups;
  return problem;
}

/// Rows with the mean of their place's rows taken off, whatever function of the place that is.
struct Centered {
  Eigen::MatrixXd terms;
  Eigen::Matrix<double, Eigen::Dynamic, 3> error_deg;
};

/// Takes off each row the mean over the reference rows of its place; rows whose place has none are left out.
/// @param reference rows that the means are taken over
Centered centered(const Problem& problem, const std::vector<std::size_t>& rows,
                  const std::vector<std::size_t>& reference, std::vector<std::size_t>& used) {
  const std::size_t n_places = *std::max_element(problem.place.begin(), problem.place.end()) + 1;
  std::vector<std::vector<Eigen::Index>> of_place(n_places);
  for (const std::size_t i : reference) of_place[problem.place[i]].push_back(static_cast<Eigen::Index>(i));
  for (const std::size_t i : rows)
    if (!of_place[problem.place[i]].empty()) used.push_back(i);
  Centered result{Eigen::MatrixXd(static_cast<Eigen::Index>(used.size()), kTerms),
                  Eigen::Matrix<double, Eigen::Dynamic, 3>(static_cast<Eigen::Index>(used.size()), 3)};
  for (std::size_t k = 0; k < used.size(); ++k) {
    const std::vector<Eigen::Index>& mates = of_place[problem.place[used[k]]];
    const auto row = static_cast<Eigen::Index>(k);
    result.terms.row(row) =
        problem.terms.row(static_cast<Eigen::Index>(used[k])) - problem.terms(mates, Eigen::all).colwise().mean();
    result.error_deg.row(row) = problem.error_deg.row(static_cast<Eigen::Index>(used[k])) -
                                problem.error_deg(mates, Eigen::all).colwise().mean();
  }
  return result;
}

/// Ridge regressions of one training set, for every ridge from one decomposition.
class RidgeFits {
 public:
  explicit RidgeFits(const Centered& train)
      : eigen_(train.terms.transpose() * train.terms),
        moments_(eigen_.eigenvectors().transpose() * (train.terms.transpose() * train.error_deg)),
        n_rows_(static_cast<double>(train.terms.rows())) {}

  Eigen::Matrix<double, Eigen::Dynamic, 3> coefficients(double ridge) const {
    const Eigen::ArrayXd damped = eigen_.eigenvalues().array().max(0.0) + ridge * n_rows_ * 0.01;
    return eigen_.eigenvectors() * (moments_.array().colwise() / damped).matrix();
  }

 private:
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen_;
  Eigen::Matrix<double, Eigen::Dynamic, 3> moments_;
  double n_rows_;
};

/// What is left out: a group of places and, unless kNone, a group of orientations.
struct Cut {
  std::size_t places = kNone;
  std::size_t orientations = kNone;
};

/// Rows of `rows` on either side of a cut: scored are those in both groups left out, fitted those in neither; the
/// other rows at the scored places tell the error of the place itself.
struct CutRows {
  std::vector<std::size_t> fitted;
  std::vector<std::size_t> scored;
  std::vector<std::size_t> reference;
};

CutRows cutRows(const Problem& problem, const std::vector<std::size_t>& rows, const Cut& cut) {
  CutRows parts;
  for (const std::size_t i : rows) {
    const bool place_out = problem.place_group[i] == cut.places;
    const bool turned_out = problem.group[i] == cut.orientations;
    if (!place_out && !turned_out) parts.fitted.push_back(i);
    if (!place_out) continue;
    if (cut.orientations == kNone || turned_out) parts.scored.push_back(i);
    if (!turned_out) parts.reference.push_back(i);
  }
  return parts;
}

/// Squares of what a cut's scored rows leave, for every ridge and, last, for none of the orientation's terms.
struct CutResult {
  std::vector<std::size_t> rows;
  Eigen::MatrixXd squares_deg2;  ///< One row each, one column a ridge, the last without terms.
};

CutResult scoreCut(const Problem& problem, const std::vector<std::size_t>& rows, const Cut& cut) {
  const CutRows parts = cutRows(problem, rows, cut);
  CutResult result;
  std::vector<std::size_t> trained;
  const Centered train = centered(problem, parts.fitted, parts.fitted, trained);
  const Centered test = centered(problem, parts.scored, parts.reference, result.rows);
  result.squares_deg2.resize(test.error_deg.rows(), static_cast<Eigen::Index>(kRidges.size()) + 1);
  result.squares_deg2.rightCols<1>() = test.error_deg.rowwise().squaredNorm();
  if (trained.empty() || result.rows.empty()) return result;
  const RidgeFits fits(train);
  for (std::size_t r = 0; r < kRidges.size(); ++r)
    result.squares_deg2.col(static_cast<Eigen::Index>(r)) =
        (test.error_deg - test.terms * fits.coefficients(kRidges[r])).rowwise().squaredNorm();
  return result;
}

/// The cuts that together score every row once.
std::vector<Cut> cutsOf(const Problem& problem, bool hold_out_orientations) {
  std::vector<Cut> cuts;
  for (std::size_t p = 0; p < kPlaceGroups; ++p) {
    if (!hold_out_orientations) cuts.push_back({p, kNone});
    for (std::size_t g = 0; g < problem.n_groups && hold_out_orientations; ++g) cuts.push_back({p, g});
  }
  return cuts;
}

/// The ridge that does best on cuts inside the training rows; the last column means no terms at all.
Eigen::Index chooseRidge(const Problem& problem, const std::vector<std::size_t>& training, const Cut& outer) {
  Eigen::RowVectorXd squares = Eigen::RowVectorXd::Zero(static_cast<Eigen::Index>(kRidges.size()) + 1);
  const bool turned = outer.orientations != kNone;
  for (std::size_t g = 0; g < (turned ? problem.n_groups : kPlaceGroups); ++g) {
    if (g == (turned ? outer.orientations : outer.places)) continue;
    // One group of places serves as test with every orientation: the next one round.
    const Cut inner = turned ? Cut{(outer.places + 1 + g % (kPlaceGroups - 1)) % kPlaceGroups, g} : Cut{g, kNone};
    const CutResult result = scoreCut(problem, training, inner);
    if (!result.rows.empty()) squares += result.squares_deg2.colwise().sum();
  }
  Eigen::Index best = squares.size() - 1;
  for (Eigen::Index r = squares.size() - 1; r >= 0; --r)
    if (squares[r] < squares[best]) best = r;
  return best;
}

/// Square sums of the scored rows of each place, turned into RMS over them; places that were never scored are left out.
class PlaceSquares {
 public:
  explicit PlaceSquares(std::size_t n_places) : small_(n_places, 0.0), large_(n_places, 0.0), n_(n_places, 0.0) {}
  void add(std::size_t place, double small_deg2, double large_deg2) {
    small_[place] += small_deg2;
    large_[place] += large_deg2;
    n_[place] += 1.0;
  }
  NestedErrors errors() const {
    NestedErrors result;
    for (std::size_t p = 0; p < n_.size(); ++p) {
      if (n_[p] == 0.0) continue;
      result.place_only_deg.push_back(std::sqrt(small_[p] / n_[p]));
      result.with_orientation_deg.push_back(std::sqrt(large_[p] / n_[p]));
    }
    return result;
  }

 private:
  std::vector<double> small_;
  std::vector<double> large_;
  std::vector<double> n_;
};

}  // namespace

NestedErrors nestedModelErrors(const OrientationRows& rows, bool hold_out_orientations, std::uint64_t seed) {
  const Problem problem = problemOf(rows, seed);
  std::vector<std::size_t> all(rows.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  PlaceSquares squares(rows.n_places);
  for (const Cut& cut : cutsOf(problem, hold_out_orientations)) {
    const Eigen::Index chosen = chooseRidge(problem, cutRows(problem, all, cut).fitted, cut);
    const CutResult result = scoreCut(problem, all, cut);
    for (std::size_t k = 0; k < result.rows.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      squares.add(problem.place[result.rows[k]], result.squares_deg2(row, result.squares_deg2.cols() - 1),
                  result.squares_deg2(row, chosen));
    }
  }
  return squares.errors();
}

}  // namespace fieldtrue
