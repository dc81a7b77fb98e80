#include "calib/field/sheet_mesh.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calib/core/error.h"
#include "calib/core/units.h"

namespace fieldtrue::field {

namespace {

constexpr double kInset = 0.25;
/// Of the charges' mesh beyond the edge, both sides together, in cells: flat charges fall short of the peak at an edge.
constexpr double kOutset = 0.34;

std::vector<Eigen::Vector2d> lattice(int along, int across, const Eigen::Vector2d& cell_m) {
  std::vector<Eigen::Vector2d> centers_m;
  for (int i = 0; i < along; ++i) {
    for (int j = 0; j < across; ++j) {
      centers_m.emplace_back((i - 0.5 * (along - 1)) * cell_m.x(), (j - 0.5 * (across - 1)) * cell_m.y());
    }
  }
  return centers_m;
}

/// Field normal to the plane at a place in it, of unit current round a rectangular cell [1/m].
/// @source law of Biot and Savart, summed over the four sides
double ringField_per_m(const Eigen::Vector2d& from_center_m, const Eigen::Vector2d& cell_m) {
  double sum = 0.0;
  for (const double side_x : {-0.5, 0.5}) {
    for (const double side_y : {-0.5, 0.5}) {
      const double u = side_x * cell_m.x() - from_center_m.x();
      const double v = side_y * cell_m.y() - from_center_m.y();
      sum += (side_x * side_y > 0.0 ? 1.0 : -1.0) * std::hypot(u, v) / (u * v);
    }
  }
  return sum / (4.0 * kPi);
}

/// Potential at a place in its plane of unit charge spread over a rectangular cell [1/m].
double chargePotential_per_m(const Eigen::Vector2d& from_center_m, const Eigen::Vector2d& cell_m) {
  double sum = 0.0;
  for (const double side_x : {-0.5, 0.5}) {
    for (const double side_y : {-0.5, 0.5}) {
      const double u = from_center_m.x() + side_x * cell_m.x();
      const double v = from_center_m.y() + side_y * cell_m.y();
      const double corner = u * std::asinh(v / std::abs(u)) + v * std::asinh(u / std::abs(v));
      sum += side_x * side_y > 0.0 ? corner : -corner;
    }
  }
  return sum / ((4.0 * kPi) * cell_m.prod());
}

Eigen::MatrixXd pairs(const std::vector<Eigen::Vector2d>& centers_m, const Eigen::Vector2d& cell_m,
                      double (*of_pair)(const Eigen::Vector2d&, const Eigen::Vector2d&)) {
  const Eigen::Index count = static_cast<Eigen::Index>(centers_m.size());
  Eigen::MatrixXd matrix(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      const auto a = static_cast<std::size_t>(i);
      const auto b = static_cast<std::size_t>(j);
      matrix(i, j) = of_pair(centers_m[a] - centers_m[b], cell_m);
      matrix(j, i) = matrix(i, j);
    }
  }
  return matrix;
}

/// Flow between neighbouring cells per difference, and from the outermost to an edge held at zero.
/// @param factor of the flow along x and along y
/// @param to_edge distance of the outermost centres to the edge in cells; 0 = nothing flows over the edge
Eigen::MatrixXd flow(int along, int across, const Eigen::Vector2d& cell_m, const Eigen::Vector2d& factor,
                     double to_edge) {
  const int count = along * across;
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(count, count);
  const auto connect = [&](int a, int b, double conductance) {
    B(a, a) += conductance;
    if (b < 0) return;
    B(b, b) += conductance;
    B(a, b) -= conductance;
    B(b, a) -= conductance;
  };
  const double x_step = factor.x() * cell_m.y() / cell_m.x();
  const double y_step = factor.y() * cell_m.x() / cell_m.y();
  for (int i = 0; i < along; ++i) {
    for (int j = 0; j < across; ++j) {
      const int here = i * across + j;
      if (i + 1 < along) connect(here, here + across, x_step);
      if (j + 1 < across) connect(here, here + 1, y_step);
      if (to_edge <= 0.0) continue;
      for (const bool is_end : {i == 0, i + 1 == along}) {
        if (is_end) connect(here, -1, x_step / to_edge);
      }
      for (const bool is_end : {j == 0, j + 1 == across}) {
        if (is_end) connect(here, -1, y_step / to_edge);
      }
    }
  }
  return B;
}

}  // namespace

Eigen::MatrixXd SheetModes::answer(const std::function<double(double rate)>& share) const {
  Eigen::VectorXd shares(rates.size());
  for (Eigen::Index i = 0; i < rates.size(); ++i) shares[i] = share(rates[i]);
  return vectors * shares.asDiagonal() * vectors.transpose();
}

SheetMesh::SheetMesh(double length_m, double width_m, int cells) {
  FT_CHECK(length_m > 0.0 && width_m > 0.0 && cells >= 4);
  const double side = std::sqrt(static_cast<double>(cells));
  along_ = std::clamp(static_cast<int>(std::lround(side * std::sqrt(length_m / width_m))), 2, cells / 2);
  across_ = std::max(2, static_cast<int>(std::lround(cells / static_cast<double>(along_))));
  ring_cell_m_ = {length_m / (along_ + 2.0 * kInset), width_m / (across_ + 2.0 * kInset)};
  charge_cell_m_ = {length_m / (along_ - kOutset), width_m / (across_ - kOutset)};
  ring_centers_m_ = lattice(along_, across_, ring_cell_m_);
  charge_centers_m_ = lattice(along_, across_, charge_cell_m_);
}

SheetModes SheetMesh::currentModes() const {
  const double area_m2 = ring_cell_m_.prod();
  const Eigen::MatrixXd L = area_m2 * pairs(ring_centers_m_, ring_cell_m_, ringField_per_m);
  const Eigen::MatrixXd R = flow(along_, across_, ring_cell_m_, Eigen::Vector2d::Ones(), 0.5 + kInset);
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> modes(R, L);
  return {area_m2 * modes.eigenvectors(), modes.eigenvalues()};
}

SheetModes SheetMesh::chargeModes() const {
  const Eigen::MatrixXd P = pairs(charge_centers_m_, charge_cell_m_, chargePotential_per_m);
  // A sheet magnetised evenly has its charges on its edges, not in the middles of its outermost cells.
  const Eigen::Vector2d reach(along_ - 1.0, across_ - 1.0);
  const Eigen::Vector2d size(along_ - kOutset, across_ - kOutset);
  const Eigen::Vector2d factor(size.x() / reach.x() * size.y() / across_, size.y() / reach.y() * size.x() / along_);
  const Eigen::MatrixXd B = flow(along_, across_, charge_cell_m_, factor, 0.0);
  const Eigen::MatrixXd inverse = P.llt().solve(Eigen::MatrixXd::Identity(P.rows(), P.cols()));
  const Eigen::MatrixXd symmetric = 0.5 * (inverse + inverse.transpose());
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> modes(B, symmetric);
  return {symmetric * modes.eigenvectors(), modes.eigenvalues()};
}

}  // namespace fieldtrue::field
