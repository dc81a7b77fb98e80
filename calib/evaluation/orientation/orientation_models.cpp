#include "calib/evaluation/orientation/orientation_models.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "calib/core/statistics.h"
#include "calib/evaluation/base/index_source.h"
#include "calib/evaluation/orientation/orientation_rows.h"

namespace fieldtrue::evaluation {
namespace {

/// Three families of error rotations that depend on the orientation, each held back by the same ridge:
/// - fixed to the sensor, a function of degree 0 to 2 of the direction in which it sees the transmitter (what unequal
///   or skewed coils of the sensor do), 3 components times 9 functions;
/// - fixed to the tracker, of degree 1 in the orientation: times the 9 entries of its matrix;
/// - fixed to the tracker, of degree 2: times the 25 entries of the matrix by which it turns symmetric, traceless
///   tensors. These count less: smooth comes first.
constexpr Eigen::Index kSeen = 9;
constexpr Eigen::Index kDegreeOne = 9;
constexpr Eigen::Index kDegreeTwo = 25;
constexpr Eigen::Index kOrientationTerms = 3 * (kSeen + kDegreeOne + kDegreeTwo);
/// Errors of position have more: along the line of sight, by how a symmetric, traceless tensor that is fixed to the
/// sensor stretches it (what unequal coils do to the range), and a lever arm, which alone does not grow with the range.
constexpr Eigen::Index kStretches = 5;
constexpr Eigen::Index kLever = 3;
constexpr Eigen::Index kPositionTerms = kOrientationTerms + kStretches + kLever;
constexpr double kDegreeTwoShare = 0.5;
constexpr std::array<double, 6> kRidges = {1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0};
constexpr std::size_t kPlaceGroups = 3;
/// More places than this tell no more about the orientation, and only take time.
constexpr std::size_t kMostPlaces = 120;
constexpr std::size_t kMostInnerCuts = 4;
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

/// Spherical functions of degree 0 to 2 of a direction.
Eigen::Matrix<double, kSeen, 1> sphericalFunctions(const Eigen::Vector3d& u) {
  Eigen::Matrix<double, kSeen, 1> values;
  values << 1.0, u.x(), u.y(), u.z(), u.x() * u.y(), u.y() * u.z(), u.z() * u.x(),
      0.5 * (u.x() * u.x() - u.y() * u.y()), 0.5 * (3.0 * u.z() * u.z() - 1.0);
  return values;
}

using TermBlock = Eigen::Matrix<double, 3, Eigen::Dynamic>;

/// @param p_tracked_m of the place
/// @param range of the place over that of the others where the error grows with it, else 1
TermBlock termsOf(const Eigen::Quaterniond& q_true, const Eigen::Vector3d& p_tracked_m, PosePart part, double range) {
  static const std::array<Eigen::Matrix3d, 5> basis = tracelessBasis();
  const Eigen::Matrix3d R = q_true.toRotationMatrix();
  const Eigen::Vector3d sight = p_tracked_m.normalized();
  const auto seen = sphericalFunctions(R.transpose() * sight);
  TermBlock block(3, part == PosePart::kPosition ? kPositionTerms : kOrientationTerms);
  Eigen::Index column = 0;
  for (Eigen::Index j = 0; j < kSeen; ++j, column += 3) block.middleCols<3>(column) = range * seen[j] * R;
  for (Eigen::Index i = 0; i < kDegreeOne; ++i, column += 3)
    block.middleCols<3>(column) = R(i / 3, i % 3) * Eigen::Matrix3d::Identity();
  for (const Eigen::Matrix3d& a : basis)
    for (const Eigen::Matrix3d& b : basis) {
      const double entry = kDegreeTwoShare * a.cwiseProduct(R * b * R.transpose()).sum();
      block.middleCols<3>(column) = entry * Eigen::Matrix3d::Identity();
      column += 3;
    }
  if (part == PosePart::kOrientation) return block;
  for (const Eigen::Matrix3d& b : basis) block.col(column++) = range * sight.dot(R * b * R.transpose() * sight) * sight;
  block.middleCols<kLever>(column) = R;
  return block;
}

/// Mean tracked position of every place: a row's own one holds the error that is to be foretold.
std::vector<Eigen::Vector3d> placesTracked_m(const OrientationRows& rows) {
  std::vector<Eigen::Vector3d> sum_m(rows.n_places, Eigen::Vector3d::Zero());
  std::vector<double> n_rows(rows.n_places, 0.0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    sum_m[rows.place[i]] += rows.p_tracked_m[i];
    n_rows[rows.place[i]] += 1.0;
  }
  for (std::size_t p = 0; p < rows.n_places; ++p) sum_m[p] /= n_rows[p];
  return sum_m;
}

/// Distance of each place from the transmitter over their median, of errors that grow with it; else ones.
std::vector<double> placeRanges(const std::vector<Eigen::Vector3d>& places_m, PosePart part) {
  std::vector<double> range;
  for (const Eigen::Vector3d& p_m : places_m) range.push_back(p_m.norm());
  const double usual_m = median(range);
  for (double& r : range) r = part == PosePart::kPosition && usual_m > 0.0 ? r / usual_m : 1.0;
  return range;
}

/// What the models are fitted to.
struct Problem {
  std::vector<TermBlock> terms;
  std::vector<Eigen::Vector3d> error;
  std::vector<std::size_t> place;
  std::vector<std::size_t> place_group;
  std::vector<std::size_t> group;
  std::size_t n_places = 0;
  std::size_t n_groups = 0;

  Eigen::Index n_terms() const { return terms.front().cols(); }
};

Problem problemOf(const OrientationRows& rows, PosePart part, std::uint64_t seed) {
  const std::vector<Eigen::Vector3d> places_m = placesTracked_m(rows);
  const std::vector<double> range = placeRanges(places_m, part);
  std::vector<std::size_t> rank(rows.n_places);
  std::iota(rank.begin(), rank.end(), std::size_t{0});
  IndexSource source(seed);
  for (std::size_t p = rows.n_places; p > 1; --p) std::swap(rank[p - 1], rank[source.below(p)]);
  Problem problem;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::size_t place = rank[rows.place[i]];
    if (place >= kMostPlaces) continue;
    problem.terms.push_back(termsOf(rows.q_true[i], places_m[rows.place[i]], part, range[rows.place[i]]));
    problem.error.push_back(rows.error[i]);
    problem.place.push_back(place);
    problem.place_group.push_back(place % kPlaceGroups);
    problem.group.push_back(rows.group[i]);
  }
  problem.n_places = std::min(rows.n_places, kMostPlaces);
  problem.n_groups = rows.n_groups;
  return problem;
}

/// Rows with the mean of their place's rows taken off, whatever function of the place that is: three lines each.
struct Centered {
  Eigen::MatrixXd terms;
  Eigen::VectorXd error;
};

/// Takes off each row the mean over the reference rows of its place; rows whose place has none are left out.
/// @param reference rows that the means are taken over
/// @param used receives the rows that are there
Centered centered(const Problem& problem, const std::vector<std::size_t>& rows,
                  const std::vector<std::size_t>& reference, std::vector<std::size_t>& used) {
  std::vector<TermBlock> mean_terms(problem.n_places, TermBlock::Zero(3, problem.n_terms()));
  std::vector<Eigen::Vector3d> mean_error(problem.n_places, Eigen::Vector3d::Zero());
  std::vector<double> n_mates(problem.n_places, 0.0);
  for (const std::size_t i : reference) {
    mean_terms[problem.place[i]] += problem.terms[i];
    mean_error[problem.place[i]] += problem.error[i];
    n_mates[problem.place[i]] += 1.0;
  }
  for (const std::size_t i : rows)
    if (n_mates[problem.place[i]] > 0.0) used.push_back(i);
  const auto n_lines = 3 * static_cast<Eigen::Index>(used.size());
  Centered result{Eigen::MatrixXd(n_lines, problem.n_terms()), Eigen::VectorXd(n_lines)};
  for (std::size_t k = 0; k < used.size(); ++k) {
    const std::size_t place = problem.place[used[k]];
    const auto line = 3 * static_cast<Eigen::Index>(k);
    result.terms.middleRows<3>(line) = problem.terms[used[k]] - mean_terms[place] / n_mates[place];
    result.error.segment<3>(line) = problem.error[used[k]] - mean_error[place] / n_mates[place];
  }
  return result;
}

/// Ridge regressions of one training set, for every ridge from one decomposition.
class RidgeFits {
 public:
  explicit RidgeFits(const Centered& train) : n_lines_(static_cast<double>(train.terms.rows())) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(train.terms.cols(), train.terms.cols());
    normal.selfadjointView<Eigen::Lower>().rankUpdate(train.terms.transpose());
    eigen_.compute(normal);
    moments_ = eigen_.eigenvectors().transpose() * (train.terms.transpose() * train.error);
  }

  Eigen::VectorXd coefficients(double ridge) const {
    const Eigen::ArrayXd damped = eigen_.eigenvalues().array().max(0.0) + ridge * n_lines_;
    return eigen_.eigenvectors() * (moments_.array() / damped).matrix();
  }

 private:
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen_;
  Eigen::VectorXd moments_;
  double n_lines_;
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
  Eigen::MatrixXd squares;  ///< One row each, one column a ridge, the last without terms.
};

/// Sum of squares of each row's three lines.
Eigen::VectorXd rowSquares(const Eigen::VectorXd& lines) {
  return lines.reshaped(3, lines.size() / 3).colwise().squaredNorm().transpose();
}

CutResult scoreCut(const Problem& problem, const std::vector<std::size_t>& rows, const Cut& cut) {
  const CutRows parts = cutRows(problem, rows, cut);
  CutResult result;
  std::vector<std::size_t> trained;
  const Centered train = centered(problem, parts.fitted, parts.fitted, trained);
  const Centered test = centered(problem, parts.scored, parts.reference, result.rows);
  result.squares.resize(static_cast<Eigen::Index>(result.rows.size()), static_cast<Eigen::Index>(kRidges.size()) + 1);
  result.squares.colwise() = rowSquares(test.error);
  if (trained.empty() || result.rows.empty()) return result;
  const RidgeFits fits(train);
  for (std::size_t r = 0; r < kRidges.size(); ++r)
    result.squares.col(static_cast<Eigen::Index>(r)) =
        rowSquares(test.error - test.terms * fits.coefficients(kRidges[r]));
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
  std::size_t n_cuts = 0;
  for (std::size_t g = 0; g < (turned ? problem.n_groups : kPlaceGroups) && n_cuts < kMostInnerCuts; ++g) {
    if (g == (turned ? outer.orientations : outer.places)) continue;
    ++n_cuts;
    // One group of places serves as test with every orientation: the next one round.
    const Cut inner = turned ? Cut{(outer.places + 1 + g % (kPlaceGroups - 1)) % kPlaceGroups, g} : Cut{g, kNone};
    const CutResult result = scoreCut(problem, training, inner);
    if (!result.rows.empty()) squares += result.squares.colwise().sum();
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
  void add(std::size_t place, double small, double large) {
    small_[place] += small;
    large_[place] += large;
    n_[place] += 1.0;
  }
  NestedErrors errors() const {
    NestedErrors result;
    for (std::size_t p = 0; p < n_.size(); ++p) {
      if (n_[p] == 0.0) continue;
      result.place_only.push_back(std::sqrt(small_[p] / n_[p]));
      result.with_orientation.push_back(std::sqrt(large_[p] / n_[p]));
    }
    return result;
  }

 private:
  std::vector<double> small_;
  std::vector<double> large_;
  std::vector<double> n_;
};

}  // namespace

NestedErrors nestedModelErrors(const OrientationRows& rows, PosePart part, bool hold_out_orientations,
                               std::uint64_t seed, const RunControl& control) {
  const Problem problem = problemOf(rows, part, seed);
  std::vector<std::size_t> all(problem.place.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const std::vector<Cut> cuts = cutsOf(problem, hold_out_orientations);
  std::vector<CutResult> results(cuts.size());
  std::vector<Eigen::Index> chosen(cuts.size(), 0);
  control.parallel_for(cuts.size(), [&](std::size_t c) {
    if (control.stop.stop_requested()) return;
    chosen[c] = chooseRidge(problem, cutRows(problem, all, cuts[c]).fitted, cuts[c]);
    results[c] = scoreCut(problem, all, cuts[c]);
  });
  PlaceSquares squares(problem.n_places);
  for (std::size_t c = 0; c < cuts.size(); ++c)
    for (std::size_t k = 0; k < results[c].rows.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      const Eigen::MatrixXd& left = results[c].squares;
      squares.add(problem.place[results[c].rows[k]], left(row, left.cols() - 1), left(row, chosen[c]));
    }
  return squares.errors();
}

}  // namespace fieldtrue::evaluation
