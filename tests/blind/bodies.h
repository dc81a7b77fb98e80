#pragma once

#include <vector>

#include "tests/blind/coils.h"

namespace blind {

/// Currents and moments that the transmitter raises in metal, in phase with the carrier, per unit moment of each
/// transmitter coil (columns). Transmitter frame.
struct Scatterer {
  std::vector<Vector3d> at_m;
  std::vector<Matrix3d> moment;
  std::vector<Polygon> loops;
  std::vector<Eigen::RowVector3d> current;
  double from_s = -1e300;
  double until_s = 1e300;

  /// Field at a point of unit moment of each transmitter coil (columns), mu0 / (4 pi) = 1.
  Matrix3d fieldAt(const Vector3d& p_m) const;
};

/// Metal as a cubic lattice of cells, each a point of polarizability.
struct Lattice {
  std::vector<Vector3d> cell_m;
  double cell_volume_m3 = 0;
  Complex permeability = 1;
};

enum class BodyShape { kSphere, kBar, kBox };

/// Fills a body with cells.
/// @param size_m full extent along its own axes [m]
/// @param cells_along number of cells along the longest side
Lattice makeLattice(BodyShape shape, const Vector3d& center_m, const Quaterniond& attitude, const Vector3d& size_m,
                    int cells_along);

/// Solves the coupled dipole equations of several lattices at once.
/// @param lattices bodies that feel each other and themselves
/// @param source_m where the transmitter stands in the frame of the lattices [m]
/// @return moments raised by the three transmitter coils, real (in phase) part
/// @source Purcell and Pennypacker, Astrophysical Journal 186 (1973), equations 1 to 3, static limit
Scatterer solveLattices(const std::vector<Lattice>& lattices, const Vector3d& source_m = Vector3d::Zero());

/// Moments of a lattice in a uniform unit field along each axis, summed: its polarizability over 4 pi [m^3].
Eigen::Matrix3cd uniformResponse(const std::vector<Lattice>& lattices);

/// Apparent permeability of a solid at the carrier, with the half of the smallest side as its radius.
Complex solidPermeability(const Vector3d& size_m, double relative_permeability, double conductivity_s_m,
                          double frequency_hz);

}  // namespace blind
