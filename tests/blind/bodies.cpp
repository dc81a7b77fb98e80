#include "tests/blind/bodies.h"

#include <algorithm>
#include <cmath>

namespace blind {
namespace {

struct Cells {
  std::vector<Vector3d> at_m;
  std::vector<Complex> polarizability;
};

Cells gather(const std::vector<Lattice>& lattices) {
  Cells cells;
  for (const Lattice& lattice : lattices) {
    // Clausius-Mossotti: a cubic lattice of such points has the permeability of the solid.
    const Complex alpha =
        3.0 * lattice.cell_volume_m3 / (4 * kPi) * (lattice.permeability - 1.0) / (lattice.permeability + 2.0);
    for (const Vector3d& at : lattice.cell_m) {
      cells.at_m.push_back(at);
      cells.polarizability.push_back(alpha);
    }
  }
  return cells;
}

Eigen::MatrixXcd solveMoments(const Cells& cells, const Eigen::MatrixXcd& incident) {
  const auto count = static_cast<Eigen::Index>(cells.at_m.size());
  Eigen::MatrixXcd system = Eigen::MatrixXcd::Zero(3 * count, 3 * count);
  for (Eigen::Index a = 0; a < count; ++a) {
    const auto from = static_cast<std::size_t>(a);
    system.block<3, 3>(3 * a, 3 * a) = Matrix3d::Identity() / cells.polarizability[from];
    for (Eigen::Index b = 0; b < a; ++b) {
      const Matrix3d coupling = -dipoleField(cells.at_m[from] - cells.at_m[static_cast<std::size_t>(b)]);
      system.block<3, 3>(3 * a, 3 * b) = coupling;
      system.block<3, 3>(3 * b, 3 * a) = coupling;
    }
  }
  return system.partialPivLu().solve(incident);
}

}  // namespace

Matrix3d Scatterer::fieldAt(const Vector3d& p_m) const {
  Matrix3d field = Matrix3d::Zero();
  for (std::size_t k = 0; k < at_m.size(); ++k) field += dipoleField(p_m - at_m[k]) * moment[k];
  for (std::size_t k = 0; k < loops.size(); ++k) field += loopField(loops[k], p_m) * current[k];
  return field;
}

Lattice makeLattice(BodyShape shape, const Vector3d& center_m, const Quaterniond& attitude, const Vector3d& size_m,
                    int cells_along) {
  const double step = size_m.maxCoeff() / cells_along;
  const Eigen::Vector3i counts = (size_m / step).array().round().max(1).cast<int>();
  Lattice lattice;
  for (int i = 0; i < counts.x(); ++i)
    for (int j = 0; j < counts.y(); ++j)
      for (int k = 0; k < counts.z(); ++k) {
        const Vector3d share((i + 0.5) / counts.x() - 0.5, (j + 0.5) / counts.y() - 0.5, (k + 0.5) / counts.z() - 0.5);
        if (shape == BodyShape::kSphere && share.norm() > 0.5) continue;
        lattice.cell_m.push_back(center_m + attitude * share.cwiseProduct(size_m));
      }
  const double volume_m3 = (shape == BodyShape::kSphere ? kPi / 6 : 1.0) * size_m.prod();
  lattice.cell_volume_m3 = volume_m3 / static_cast<double>(lattice.cell_m.size());
  return lattice;
}

Scatterer solveLattices(const std::vector<Lattice>& lattices, const Vector3d& source_m) {
  const Cells cells = gather(lattices);
  const auto count = static_cast<Eigen::Index>(cells.at_m.size());
  Eigen::MatrixXcd incident(3 * count, 3);
  for (Eigen::Index k = 0; k < count; ++k)
    incident.middleRows<3>(3 * k) = dipoleField(cells.at_m[static_cast<std::size_t>(k)] - source_m).cast<Complex>();
  const Eigen::MatrixXcd moments = solveMoments(cells, incident);
  Scatterer scatterer;
  scatterer.at_m = cells.at_m;
  for (Eigen::Index k = 0; k < count; ++k) scatterer.moment.push_back(moments.middleRows<3>(3 * k).real());
  return scatterer;
}

Eigen::Matrix3cd uniformResponse(const std::vector<Lattice>& lattices) {
  const Cells cells = gather(lattices);
  const auto count = static_cast<Eigen::Index>(cells.at_m.size());
  Eigen::MatrixXcd incident(3 * count, 3);
  for (Eigen::Index k = 0; k < count; ++k) incident.middleRows<3>(3 * k) = Eigen::Matrix3cd::Identity();
  const Eigen::MatrixXcd moments = solveMoments(cells, incident);
  Eigen::Matrix3cd sum = Eigen::Matrix3cd::Zero();
  for (Eigen::Index k = 0; k < count; ++k) sum += moments.middleRows<3>(3 * k);
  return sum;
}

Complex solidPermeability(const Vector3d& size_m, double relative_permeability, double conductivity_s_m,
                          double frequency_hz) {
  return apparentPermeability(0.5 * size_m.minCoeff(), relative_permeability, conductivity_s_m, frequency_hz);
}

}  // namespace blind
