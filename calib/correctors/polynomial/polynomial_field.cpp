#include "calib/correctors/polynomial/polynomial_field.h"

#include <Eigen/QR>
#include <array>
#include <cmath>

#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::correctors {
namespace {

/// Below this ratio of pivots the highest terms are rounding and noise: a grid with fewer levels than the degree needs
/// gives 1e-16 when it is exact, and 1e-4 when distortion alone tells the levels apart.
constexpr double kRankThreshold = 1e-7;
constexpr int kPowers = PolynomialField::kMaxDegree + 1;
constexpr int kMaxTerms = 84;

using PowerTable = std::array<std::array<double, kPowers>, 3>;

PowerTable powersOf(const Eigen::Vector3d& u, int degree) {
  PowerTable powers{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    powers[axis][0] = 1.0;
    for (std::size_t k = 1; k <= static_cast<std::size_t>(degree); ++k)
      powers[axis][k] = powers[axis][k - 1] * u[static_cast<Eigen::Index>(axis)];
  }
  return powers;
}

/// Calls term(index, s, t, u) for the powers of every monomial x^s y^t z^u (eq. 14).
template <class Term>
void forEachTerm(int dimension, int degree, Term term) {
  Eigen::Index index = 0;
  for (int total = 0; total <= degree; ++total) {
    for (int s = total; s >= 0; --s) {
      const int t_lowest = dimension == 2 ? total - s : 0;
      for (int t = total - s; t >= t_lowest; --t)
        term(index++, static_cast<std::size_t>(s), static_cast<std::size_t>(t),
             static_cast<std::size_t>(total - s - t));
    }
  }
}

using Monomials = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxTerms, 1>;

Monomials monomials(const Eigen::Vector3d& local, int dimension, int degree) {
  const PowerTable powers = powersOf(local, degree);
  Monomials values(PolynomialField::termCount(dimension, degree));
  forEachTerm(dimension, degree, [&](Eigen::Index i, std::size_t s, std::size_t t, std::size_t u) {
    values[i] = powers[0][s] * powers[1][t] * powers[2][u];
  });
  return values;
}

Result<void> checkProblem(const PolynomialProblem& problem) {
  FT_TRY_VOID(checkSpread(problem.name, problem.n_places, problem.dimension));
  const int terms = PolynomialField::termCount(problem.dimension, problem.degree);
  if (problem.n_places < static_cast<std::size_t>(terms))
    return fail(ErrorCode::kTooFewNodes, problem.name + (problem.dimension == 2 ? " in a plane" : "") +
                                             " needs at least " + std::to_string(terms) + " places, got " +
                                             std::to_string(problem.n_places));
  // On so few levels only the distortion of the grid itself tells the highest power, and between the levels, where no
  // place is ever left out, it may be anything.
  const int levels = problem.fewest_levels;
  if (levels > 0 && levels <= problem.degree)
    return fail(ErrorCode::kDegenerate, problem.name + " needs " + std::to_string(problem.degree + 1) +
                                            " levels of places along each axis of the grid, and along one there are " +
                                            std::to_string(levels) + ": use degree=" + std::to_string(levels - 1) +
                                            ", or more levels");
  return {};
}

}  // namespace

int PolynomialField::termCount(int dimension, int degree) {
  return dimension == 2 ? (degree + 1) * (degree + 2) / 2 : (degree + 1) * (degree + 2) * (degree + 3) / 6;
}

void PolynomialField::placeCoordinates(const PolynomialProblem& problem) {
  if (dimension_ == 2) axes_ = pointSpread(problem.p_m).axes;
  Eigen::Vector3d low = Eigen::Vector3d::Constant(HUGE_VAL);
  Eigen::Vector3d high = -low;
  for (const Eigen::Vector3d& p_m : problem.p_m) {
    const Eigen::Vector3d u = axes_.transpose() * p_m;
    low = low.cwiseMin(u);
    high = high.cwiseMax(u);
  }
  center_m_ = axes_ * (0.5 * (low + high));
  scale_m_ = 0.5 * (high - low);
  for (double& scale_m : scale_m_)
    if (!(scale_m > 0.0)) scale_m = 1.0;
}

Eigen::Vector3d PolynomialField::localCoordinates(const Eigen::Vector3d& p_m) const {
  return (axes_.transpose() * (p_m - center_m_)).cwiseQuotient(scale_m_);
}

Eigen::MatrixXd PolynomialField::designMatrix(std::span<const Eigen::Vector3d> p_m) const {
  Eigen::MatrixXd design(static_cast<Eigen::Index>(p_m.size()), termCount(dimension_, degree_));
  for (Eigen::Index i = 0; i < design.rows(); ++i)
    design.row(i) = monomials(localCoordinates(p_m[static_cast<std::size_t>(i)]), dimension_, degree_).transpose();
  return design;
}

Result<PolynomialField> PolynomialField::fit(const PolynomialProblem& problem) {
  FT_CHECK(problem.value.size() == problem.p_m.size());
  FT_CHECK(problem.degree >= 0 && problem.degree <= kMaxDegree);
  FT_TRY_VOID(checkProblem(problem));

  PolynomialField field;
  field.dimension_ = problem.dimension;
  field.degree_ = problem.degree;
  field.placeCoordinates(problem);
  const auto n_rows = static_cast<Eigen::Index>(problem.p_m.size());
  const Eigen::Index n_terms = termCount(problem.dimension, problem.degree);
  const Eigen::MatrixXd design = field.designMatrix(problem.p_m);
  Eigen::Matrix<double, Eigen::Dynamic, 3> values(n_rows, 3);
  for (Eigen::Index i = 0; i < n_rows; ++i) values.row(i) = problem.value[static_cast<std::size_t>(i)].transpose();

  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(design);
  qr.setThreshold(kRankThreshold);
  if (qr.rank() < n_terms)
    return fail(ErrorCode::kDegenerate,
                "The places do not determine the " + std::to_string(n_terms) + " terms of the " + problem.name +
                    " (only " + std::to_string(qr.rank()) +
                    "): they repeat or stand on too few levels; use a lower degree or more levels");
  field.coefficients_ = qr.solve(values);
  const Eigen::MatrixXd r = qr.matrixR().topLeftCorner(n_terms, n_terms);
  const Eigen::VectorXd pivots = r.diagonal().cwiseAbs();
  field.pivot_ratio_ = pivots.minCoeff() / pivots.maxCoeff();
  field.inverse_root_ =
      qr.colsPermutation() * r.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(n_terms, n_terms)).eval();
  const double residual_squares = (values - design * field.coefficients_).squaredNorm();
  if (n_rows > n_terms) field.residual_sd_ = std::sqrt(residual_squares / static_cast<double>(n_rows - n_terms));
  return field;
}

Eigen::Vector3d PolynomialField::value(const Eigen::Vector3d& p_m) const {
  return coefficients_.transpose() * monomials(localCoordinates(p_m), dimension_, degree_);
}

Eigen::Matrix3d PolynomialField::gradient(const Eigen::Vector3d& p_m) const {
  const PowerTable powers = powersOf(localCoordinates(p_m), degree_);
  Eigen::Matrix3d local_gradient = Eigen::Matrix3d::Zero();
  const auto slope = [&powers](std::size_t axis, std::size_t k) {
    return k == 0 ? 0.0 : static_cast<double>(k) * powers[axis][k - 1];
  };
  forEachTerm(dimension_, degree_, [&](Eigen::Index i, std::size_t s, std::size_t t, std::size_t u) {
    const Eigen::Vector3d d_monomial(slope(0, s) * powers[1][t] * powers[2][u],
                                     powers[0][s] * slope(1, t) * powers[2][u],
                                     powers[0][s] * powers[1][t] * slope(2, u));
    local_gradient += coefficients_.row(i).transpose() * d_monomial.transpose();
  });
  return local_gradient * scale_m_.cwiseInverse().asDiagonal() * axes_.transpose();
}

std::optional<double> PolynomialField::standardError(const Eigen::Vector3d& p_m) const {
  if (residual_sd_ < 0.0) return std::nullopt;
  const double leverage =
      (inverse_root_.transpose() * monomials(localCoordinates(p_m), dimension_, degree_)).squaredNorm();
  return residual_sd_ * std::sqrt(1.0 + leverage);
}

nlohmann::json PolynomialField::toJson() const {
  return {{"dimension", dimension_},
          {"degree", degree_},
          {"center_m", jsonOf(center_m_)},
          {"axes", jsonOf(Eigen::MatrixXd(axes_))},
          {"scale_m", jsonOf(scale_m_)},
          {"coefficients", jsonOf(Eigen::MatrixXd(coefficients_))},
          {"inverse_root", jsonOf(inverse_root_)},
          {"residual_sd", residual_sd_},
          {"pivot_ratio", pivot_ratio_}};
}

PolynomialField PolynomialField::fromJson(const JsonReader& json) {
  PolynomialField field;
  field.dimension_ = static_cast<int>(json["dimension"].integer(2, 3));
  field.degree_ = static_cast<int>(json["degree"].integer(0, kMaxDegree));
  field.center_m_ = json["center_m"].vector3();
  field.axes_ = json["axes"].matrix3();
  field.scale_m_ = json["scale_m"].vector3();
  if (!(field.scale_m_.minCoeff() > 0.0)) json["scale_m"].refuse("three lengths above 0");
  const Eigen::Index n_terms = termCount(field.dimension_, field.degree_);
  field.coefficients_ = json["coefficients"].matrix(3);
  field.inverse_root_ = json["inverse_root"].matrix(n_terms);
  if (field.coefficients_.rows() != n_terms || field.inverse_root_.rows() != n_terms)
    json.fail("needs " + std::to_string(n_terms) + " rows of coefficients and of inverse_root for its degree.");
  field.residual_sd_ = json["residual_sd"].number();
  field.pivot_ratio_ = json["pivot_ratio"].number();
  return field;
}

}  // namespace fieldtrue::correctors
