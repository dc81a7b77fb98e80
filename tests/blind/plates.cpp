#include "tests/blind/plates.h"

#include <cmath>

namespace blind {
namespace {

// Geometric mean distance of a strip as wide as a mesh from itself, over its width.
constexpr double kStripDistance = 0.2235;

// Mutual inductance of two parallel segments of unit length along x, offset (dx, dy): Neumann's integral with the
// closed inner part of Grover, Inductance Calculations (1946), chapter 7, distance kept above that of the strip.
double segmentPair(double dx, double dy) {
  const double d2 = dy * dy < 0.25 ? kStripDistance * kStripDistance : dy * dy;
  const auto primitive = [d2](double u) { return u * std::asinh(u / std::sqrt(d2)) - std::sqrt(u * u + d2); };
  return primitive(dx + 1) - 2 * primitive(dx) + primitive(dx - 1);
}

// Mutual inductance of two unit meshes, in units of mu0 / (4 pi).
double meshPair(int dx, int dy) {
  const auto pair = [](double along, double across) {
    return 2 * segmentPair(along, across) - segmentPair(along, across + 1) - segmentPair(along, across - 1);
  };
  return pair(dx, dy) + pair(dy, dx);
}

}  // namespace

MeshedSheet::MeshedSheet(int cells_x, int cells_y, double cell_m, double sheet_resistance_ohm, double frequency_hz)
    : cells_x_(cells_x), cells_y_(cells_y), cell_m_(cell_m), omega_rad_s_(2 * kPi * frequency_hz) {
  const int count = cells_x * cells_y;
  Eigen::MatrixXd pair(cells_x, cells_y);
  for (int dx = 0; dx < cells_x; ++dx)
    for (int dy = 0; dy < cells_y; ++dy) pair(dx, dy) = cell_m * kHenryPerUnit * meshPair(dx, dy);
  Eigen::MatrixXcd impedance(count, count);
  for (int a = 0; a < count; ++a)
    for (int b = 0; b < count; ++b) {
      const int dx = std::abs(a / cells_y - b / cells_y), dy = std::abs(a % cells_y - b % cells_y);
      const double resistance = a == b ? 4 : dx + dy == 1 ? -1 : 0;
      impedance(a, b) = Complex(resistance * sheet_resistance_ohm, omega_rad_s_ * pair(dx, dy));
    }
  factors_.compute(impedance);
}

Scatterer MeshedSheet::solve(const Vector3d& center_m, const Quaterniond& attitude) const {
  const int count = cells_x_ * cells_y_;
  const Vector3d half_x = attitude * Vector3d(0.5 * cell_m_, 0, 0), half_y = attitude * Vector3d(0, 0.5 * cell_m_, 0);
  Eigen::MatrixXcd driven(count, 3);
  Scatterer scatterer;
  for (int a = 0; a < count; ++a) {
    const int column = a / cells_y_, row = a % cells_y_;
    const double x = column - 0.5 * (cells_x_ - 1), y = row - 0.5 * (cells_y_ - 1);
    const Vector3d at_m = center_m + 2 * x * half_x + 2 * y * half_y;
    scatterer.at_m.push_back(at_m);
    driven.row(a) =
        Complex(0, -omega_rad_s_ * kHenryPerUnit) * dipoleFlux(rectangle(at_m, half_x, half_y)).cast<Complex>();
  }
  const Eigen::MatrixXcd current = factors_.solve(driven);
  const Vector3d area_m2 = 4 * half_x.cross(half_y);
  for (int a = 0; a < count; ++a) scatterer.moment.push_back(area_m2 * current.row(a).real());
  return scatterer;
}

Scatterer solvePermeableSheet(int cells_x, int cells_y, double cell_m, double thickness_m, double permeability,
                              const Vector3d& center_m, const Quaterniond& attitude) {
  // Moments along the sheet only: across it a thin permeable layer is demagnetised.
  const int count = cells_x * cells_y;
  const Vector3d u = attitude * Vector3d::UnitX(), v = attitude * Vector3d::UnitY();
  Eigen::Matrix<double, 3, 2> along;
  along << u, v;
  Scatterer scatterer;
  for (int a = 0; a < count; ++a) {
    const int column = a / cells_y, row = a % cells_y;
    scatterer.at_m.push_back(center_m +
                             cell_m * ((column - 0.5 * (cells_x - 1)) * u + (row - 0.5 * (cells_y - 1)) * v));
  }
  // A cell of a flat sheet: susceptibility times volume over 4 pi, less the field of its own square,
  // 9.0336 / cell^3 / 2 being the planar lattice sum of the in-plane dipole field.
  const double volume_m3 = cell_m * cell_m * thickness_m;
  const double lattice_sum = 0.5 * 9.0336 / (cell_m * cell_m * cell_m);
  const double inverse = 4 * kPi / ((permeability - 1) * volume_m3) + lattice_sum;
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(2 * count, 2 * count);
  Eigen::MatrixXd driven(2 * count, 3);
  for (int a = 0; a < count; ++a) {
    const Vector3d& at = scatterer.at_m[static_cast<std::size_t>(a)];
    system.block<2, 2>(2 * a, 2 * a) = inverse * Eigen::Matrix2d::Identity();
    for (int b = 0; b < a; ++b) {
      const Eigen::Matrix2d coupling =
          -along.transpose() * dipoleField(at - scatterer.at_m[static_cast<std::size_t>(b)]) * along;
      system.block<2, 2>(2 * a, 2 * b) = coupling;
      system.block<2, 2>(2 * b, 2 * a) = coupling;
    }
    driven.middleRows<2>(2 * a) = along.transpose() * dipoleField(at);
  }
  const Eigen::MatrixXd moments = system.ldlt().solve(driven);
  for (int a = 0; a < count; ++a) scatterer.moment.push_back(along * moments.middleRows<2>(2 * a));
  return scatterer;
}

Scatterer solveClosedLoop(const Polygon& polygon, double resistance_ohm, double inductance_h, double frequency_hz) {
  const double omega = 2 * kPi * frequency_hz;
  const Complex admittance = Complex(0, -omega * kHenryPerUnit) / Complex(resistance_ohm, omega * inductance_h);
  Scatterer scatterer;
  scatterer.loops.push_back(polygon);
  scatterer.current.push_back(admittance.real() * dipoleFlux(polygon));
  return scatterer;
}

}  // namespace blind
