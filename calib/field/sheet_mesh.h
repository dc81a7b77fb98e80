#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace fieldtrue::field {

/// A linear answer split into independent modes: U diag(share(rate)) U^T.
struct SheetModes {
  Eigen::MatrixXd vectors;  ///< U, cells x modes.
  Eigen::VectorXd rates;    ///< One per mode.

  Eigen::MatrixXd answer(const std::function<double(double rate)>& share) const;
};

/// A flat rectangular metal sheet cut into equal cells, in its own frame: x along its length, y along its width.
///
/// Currents: every cell carries a ring current psi, its stream function. With L psi the flux of these through the cells
/// and rho the sheet's resistance, s (L psi + area H_n) + (rho/mu_0) R psi = 0, so
///   psi = -U diag(s/(s + rate)) U^T area H_n, rate = rho lambda / mu_0 for the modes of R u = lambda L u.
/// The mesh ends a quarter of a cell inside the edge, which makes it exact for a strip and nearly so for a rectangle.
///
/// Magnetisation: every cell carries a magnetic charge q, the ends of a magnetisation in the sheet's plane. With P q
/// their potential and B the flow between neighbours, q = -chi_t B (phi + P q), chi_t = (mu_r - 1) thickness, so
///   q = -U diag(chi_t lambda/(1 + chi_t lambda)) U^T phi.
/// @source stream function on a thin sheet: Weidelt 1975, section 4 (thin sheet); quarter-cell inset: Hough 1973, J.
/// Aircraft 10 314; collocation with flat charges: Harrington 1968, Field Computation by Moment Methods, section 2-2
class SheetMesh {
 public:
  /// @param cells about how many; a square takes the nearest square number
  SheetMesh(double length_m, double width_m, int cells = 36);

  const std::vector<Eigen::Vector2d>& ringCenters_m() const { return ring_centers_m_; }
  const std::vector<Eigen::Vector2d>& chargeCenters_m() const { return charge_centers_m_; }

  /// Moment of each cell's ring [A m^2] per field normal to it [A/m], with the sign turned; rates are R lambda, to be
  /// multiplied by the sheet's resistance over mu_0 [m/s].
  SheetModes currentModes() const;
  /// Charge of each cell [A m] per potential [A], with the sign turned; rates are per metre, to be multiplied by chi_t.
  SheetModes chargeModes() const;

 private:
  int along_ = 6;
  int across_ = 6;
  Eigen::Vector2d ring_cell_m_;
  Eigen::Vector2d charge_cell_m_;
  std::vector<Eigen::Vector2d> ring_centers_m_;
  std::vector<Eigen::Vector2d> charge_centers_m_;
};

}  // namespace fieldtrue::field
