#include "tests/blind/signatures.h"

#include <algorithm>
#include <cmath>

#include "tests/blind/generate_effects.h"
#include "tests/blind/plates.h"

namespace blind {
namespace {

constexpr double kSame = 0.9;
// Less than this left by the alignment is the curvature of the small changes that signatures are made of.
constexpr double kVisible = 1e-3;

using Bend = std::function<void(World&)>;

Eigen::VectorXd columnOf(const Alignment& alignment, const Bend& bend) {
  World world;
  bend(world);
  return alignment.whitened(world);
}

Eigen::MatrixXd columnsOf(const Alignment& alignment, const std::vector<Bend>& bends) {
  Eigen::MatrixXd columns;
  for (const Bend& bend : bends) {
    const Eigen::VectorXd column = columnOf(alignment, bend);
    columns.conservativeResize(column.size(), columns.cols() + 1);
    columns.rightCols<1>() = column;
  }
  return columns;
}

std::vector<Bend> coilBends(bool gains) {
  constexpr double kSmall = 1e-4;
  std::vector<Bend> bends;
  for (int side = 0; side < 2; ++side)
    for (int axis = 0; axis < 3; ++axis)
      bends.emplace_back([=](World& world) {
        Matrix3d& coils = side == 0 ? world.transmitter : world.receiver;
        const int a = axis, b = gains ? axis : (axis + 1) % 3;
        coils(a, b) += kSmall;
        if (!gains) coils(b, a) += kSmall;
      });
  return bends;
}

Bend rigBend(std::function<Vector3d(const Row&)> shift) {
  return [shift = std::move(shift)](World& world) {
    world.rig.emplace_back([shift](const Row& row, Vector3d& place_m, Quaterniond&) { place_m += 1e-4 * shift(row); });
  };
}

std::vector<Bend> tensorBends(const Vector3d& at_m) {
  std::vector<Bend> bends;
  for (int a = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b) {
      Matrix3d tensor = Matrix3d::Zero();
      tensor(a, b) = tensor(b, a) = 1e-7;
      Scatterer point;
      point.at_m.push_back(at_m);
      point.moment.push_back(tensor * dipoleField(at_m));
      bends.emplace_back([point](World& world) { world.metal.emplace_back(1.0, point); });
    }
  return bends;
}

Bend metalBend(const Scatterer& metal, double share) {
  return [=](World& world) { world.metal.emplace_back(share, metal); };
}

using Bends = std::map<std::string, std::vector<Bend>>;

void addRoom(const Setup& setup, const Vector3d& body_m, const Vector3d& normal, Bends& bends) {
  const Vector3d down = setup.tracker_from_jig * Vector3d(0, 0, -1);
  double lowest = 0;
  for (const Row& row : setup.rows) lowest = std::max(lowest, down.dot(setup.expected(row).position_m));
  const Quaterniond flat = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), down);
  const Quaterniond facing = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), normal);
  const MeshedSheet floor(12, 12, 0.5, 1e-4, setup.carrier_hz), plate(6, 6, 0.1, 1e-4, setup.carrier_hz);
  const Polygon loop = roundLoop(body_m, normal, 0.25, 24);
  bends["compact_metal"] = tensorBends(body_m);
  bends["metal_plane"] = {metalBend(floor.solve((lowest + 0.9) * down, flat), 0.02)};
  bends["finite_plate"] = {metalBend(plate.solve(body_m, facing), 0.02)};
  bends["closed_loop"] = {metalBend(solveClosedLoop(loop, 0.01, 1.5e-6, setup.carrier_hz), 0.02)};
}

void addCoils(Bends& bends) {
  bends["coil_gain"] = coilBends(true);
  bends["coil_nonorthogonality"] = coilBends(false);
  bends["finite_coil"] = {[](World& world) { world.transmitter_half_m = 0.02; },
                          [](World& world) { world.receiver_half_m = 0.02; }};
  bends["global_gain"] = {[](World& world) { world.receiver *= 1 + 1e-4; }};
}

void addRig(const Setup& setup, Bends& bends) {
  const Vector3d middle_m = setup.middle_m;
  for (int axis = 0; axis < 3; ++axis)
    bends["grid_scale"].push_back(
        rigBend([=](const Row& row) { return Vector3d((row.place_m - middle_m)[axis] * Vector3d::Unit(axis)); }));
  std::vector<Bend>& layers = bends["jig_layer_offset"];
  for (int layer = 0; !setup.scattered && layer < setup.counts.z(); ++layer)
    layers.push_back(rigBend([=](const Row& row) { return Vector3d(0, 0, row.k == layer ? 1 : 0); }));
  for (int axis = 0; axis < 2; ++axis)
    bends["jig_tilt"].push_back(
        rigBend([=](const Row& row) { return Vector3d((row.place_m - middle_m).z() * Vector3d::Unit(axis)); }));
}

void addMounting(Bends& bends) {
  const auto mounted = [](std::function<void(SolvedPose&)> change) -> Bend {
    return [change = std::move(change)](World& world) {
      world.mounting.emplace_back([change](const Row&, SolvedPose& sensor) { change(sensor); });
    };
  };
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d e = 1e-4 * Vector3d::Unit(axis);
    bends["sensor_offset"].push_back(mounted([=](SolvedPose& s) { s.position_m += s.orientation * e; }));
    bends["transmitter_misalignment"].push_back(mounted([=](SolvedPose& s) { s.position_m += e; }));
    bends["transmitter_misalignment"].push_back(mounted([=](SolvedPose& s) {
      s.position_m = turned(e, Quaterniond::Identity()) * s.position_m;
      s.orientation = turned(e, s.orientation);
    }));
  }
}

void addTime(const Setup& setup, const Vector3d& body_m, Bends& bends) {
  const double end_s = setup.duration_s();
  bends["gain_drift"] = {[=](World& world) {
    world.signal.emplace_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
      couplings *= 1 + 1e-4 * (1 - std::exp(-2.5 * row.start_s / end_s));
    });
  }};
  for (const Bend& metal : tensorBends(body_m))
    bends["metal_moved"].emplace_back([metal, end_s](World& world) {
      metal(world);
      world.metal.back().second.from_s = 0.5 * end_s;
    });
}

}  // namespace

Signatures catalogueSignatures(const Setup& setup, const Alignment& alignment, const Vector3d& body_m,
                               const Vector3d& normal) {
  Bends bends;
  addRoom(setup, body_m, normal, bends);
  addCoils(bends);
  addRig(setup, bends);
  addMounting(bends);
  addTime(setup, body_m, bends);
  Signatures all;
  for (const auto& [id, some] : bends) all[id] = columnsOf(alignment, some);
  for (const std::string& id : signalIds()) all[id] = Eigen::MatrixXd();
  return all;
}

Classes equivalenceClasses(const Signatures& signatures, const Alignment& alignment) {
  std::vector<std::string> ids;
  std::vector<Eigen::MatrixXd> bases;
  for (const auto& [id, columns] : signatures) {
    ids.push_back(id);
    bases.emplace_back();
    if (columns.size() == 0) continue;
    const Eigen::MatrixXd left = alignment.projected(columns);
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(left, Eigen::ComputeThinU);
    Eigen::Index rank = 0;
    while (rank < svd.singularValues().size() && svd.singularValues()[rank] > kVisible * columns.norm()) ++rank;
    if (rank > 0) bases.back() = svd.matrixU().leftCols(rank);
  }
  return joinedClasses(ids, [&](std::size_t a, std::size_t b) {
    if (bases[a].size() == 0 || bases[b].size() == 0) return false;
    const double shared = (bases[a].transpose() * bases[b]).squaredNorm();
    // R2 both ways: the share of each space that lies in the other.
    return shared > kSame * static_cast<double>(std::max(bases[a].cols(), bases[b].cols()));
  });
}

}  // namespace blind
