#pragma once

#include <memory>
#include <vector>

#include "tests/blind/bodies.h"

namespace blind {

/// A conducting sheet as a square mesh of loop currents that share their sides: inductance, resistance and edges.
class MeshedSheet {
 public:
  /// @param cells_x, cells_y number of meshes along the two sides
  /// @param cell_m side of one mesh [m]
  /// @param sheet_resistance_ohm 1 / (conductivity * thickness) [ohm]
  /// @param frequency_hz carrier [Hz]
  MeshedSheet(int cells_x, int cells_y, double cell_m, double sheet_resistance_ohm, double frequency_hz);

  /// Currents raised by the transmitter at the origin.
  /// @param center_m centre of the sheet, transmitter frame [m]
  /// @param attitude transmitter frame from sheet; the sheet lies in its own x y plane
  Scatterer solve(const Vector3d& center_m, const Quaterniond& attitude) const;

 private:
  int cells_x_;
  int cells_y_;
  double cell_m_;
  double omega_rad_s_;
  Eigen::PartialPivLU<Eigen::MatrixXcd> factors_;
};

/// A thin permeable sheet, or a layer of rods, as a flat lattice of cells that are magnetised along the sheet.
Scatterer solvePermeableSheet(int cells_x, int cells_y, double cell_m, double thickness_m, double permeability,
                              const Vector3d& center_m, const Quaterniond& attitude);

/// Current in a closed loop of resistance R and inductance L, in phase with the carrier.
Scatterer solveClosedLoop(const Polygon& polygon, double resistance_ohm, double inductance_h, double frequency_hz);

}  // namespace blind
