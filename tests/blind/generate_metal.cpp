#include <algorithm>
#include <cmath>

#include "tests/blind/generate_effects.h"
#include "tests/blind/plates.h"

namespace blind {
namespace {

using nlohmann::json;

constexpr double kNearest_m = 0.35, kFarthest_m = 0.9;

double nearestNode(const Setup& setup, const Vector3d& at_m) {
  double nearest = 1e300;
  for (const Row& row : setup.rows) nearest = std::min(nearest, (setup.expected(row).position_m - at_m).norm());
  return nearest;
}

/// A place outside the grid, its distance to the nearest node in the given range, not on the transmitter.
Vector3d placeNearGrid(const Setup& setup, Random& random, double low_m, double high_m) {
  Vector3d at_m = Vector3d::Zero();
  for (int attempt = 0; attempt < 400; ++attempt) {
    const Row& row =
        setup.rows[static_cast<std::size_t>(uniformInt(random, 0, static_cast<int>(setup.rows.size()) - 1))];
    at_m = setup.expected(row).position_m + uniform(random, low_m, high_m) * direction(random);
    const double nearest_m = nearestNode(setup, at_m);
    if (nearest_m >= low_m && nearest_m <= high_m && at_m.norm() > 0.45) break;
  }
  return at_m;
}

struct Metal {
  const char* name;
  double permeability;
  double conductivity_s_m;
};
constexpr Metal kSolids[] = {{"aluminium", 1, 3.5e7},
                             {"copper", 1, 5.8e7},
                             {"stainless steel", 1, 1.4e6},
                             {"mild steel", 100, 6e6},
                             {"brass", 1, 1.6e7}};

/// How a body differs from the one that was drawn.
struct Move {
  Vector3d by_m = Vector3d::Zero();
  Quaterniond turn = Quaterniond::Identity();
  double scale = 1;
};

using Solve = std::function<Scatterer(const Move&)>;

struct Body {
  std::string kind;
  std::function<Lattice(const Move&)> lattice;
  Vector3d size_m;
  bool ferromagnetic = false;

  Scatterer solved(const Move& move) const { return solveLattices({lattice(move)}); }
};

Body drawBody(const Setup& setup, Random& random, const Vector3d& center_m, double length_m) {
  Body body;
  const int shape = uniformInt(random, 0, 2);
  const Metal& metal = kSolids[uniformInt(random, 0, 4)];
  if (shape == 0) body.size_m = Vector3d::Constant(length_m);
  if (shape == 1) body.size_m = length_m * Vector3d(1, uniform(random, 0.2, 0.35), uniform(random, 0.2, 0.35));
  if (shape == 2) body.size_m = length_m * Vector3d(1, uniform(random, 0.5, 1.0), uniform(random, 0.3, 0.8));
  const BodyShape shapes[] = {BodyShape::kSphere, BodyShape::kBar, BodyShape::kBox};
  const Quaterniond attitude = rotation(random);
  body.ferromagnetic = uniform(random, 0, 1) < 0.3;
  // Ferrite, pressed or laminated iron: no eddy currents.
  const double ferrite = body.ferromagnetic ? uniform(random, 5, 60) : 0;
  body.lattice = [=, size_m = body.size_m, carrier_hz = setup.carrier_hz](const Move& move) {
    Lattice lattice =
        makeLattice(shapes[shape], center_m + move.by_m, move.turn * attitude, move.scale * size_m, shape == 1 ? 9 : 5);
    lattice.permeability =
        ferrite > 0 ? Complex(ferrite)
                    : solidPermeability(move.scale * size_m, metal.permeability, metal.conductivity_s_m, carrier_hz);
    return lattice;
  };
  const char* names[] = {"sphere", "bar", "box"};
  body.kind = std::string(body.ferromagnetic ? "ferrite or laminated iron" : metal.name) + " " + names[shape];
  return body;
}

/// Place and attitude may change, and where `has_size` is set, the logarithm of the size.
Drawn shareOf(std::string id, std::string kind, const Solve& solve, bool has_size, json fixed) {
  Drawn drawn{std::move(id), std::move(kind), 0.15, 1.0, nullptr, nullptr, {0.1, 0.1, 0.1, 0.3, 0.3, 0.3}};
  if (has_size) drawn.scales.push_back(0.2);
  drawn.apply = [solve, has_size, as_drawn = std::make_shared<Scatterer>(solve(Move()))](World& world, double share,
                                                                                         ShapeChange change) {
    const bool is_changed = std::any_of(change.begin(), change.end(), [](double value) { return value != 0; });
    const Move move{vectorAt(change, 0), turned(vectorAt(change, 3), Quaterniond::Identity()),
                    has_size ? std::exp(changeAt(change, 6)) : 1};
    world.metal.emplace_back(share, is_changed ? solve(move) : *as_drawn);
  };
  drawn.describe = [fixed = std::move(fixed)](double share, json& effect) {
    effect.update(fixed);
    effect["parameters"]["metal_share"] = share;
  };
  return drawn;
}

Vector3d roomUp(const Setup& setup) { return setup.tracker_from_jig * Vector3d::UnitZ(); }

}  // namespace

Drawn drawCompactMetal(const Setup& setup, Random& random) {
  const Vector3d at_m = placeNearGrid(setup, random, kNearest_m, kFarthest_m);
  const Body body = drawBody(setup, random, at_m, uniform(random, 0.15, 0.4));
  return shareOf("compact_metal", body.kind, [body](const Move& move) { return body.solved(move); }, true,
                 {{"location_m", listed(at_m)},
                  {"material", body.ferromagnetic ? "ferromagnetic" : "conductive"},
                  {"parameters", {{"size_m", listed(body.size_m)}}}});
}

Drawn drawMetalPlane(const Setup& setup, Random& random) {
  // A floor, or a wall beside the rig: some metres wide, with edges.
  Vector3d toward = -roomUp(setup);
  std::string kind = "floor";
  if (uniform(random, 0, 1) < 0.35) {
    const double turn = uniform(random, 0, 2 * kPi);
    toward = setup.tracker_from_jig * Vector3d(std::cos(turn), std::sin(turn), 0);
    kind = "wall";
  }
  toward = turned(0.03 * normalVector(random), Quaterniond::Identity()) * toward;
  double farthest = 0;
  for (const Row& row : setup.rows) farthest = std::max(farthest, toward.dot(setup.expected(row).position_m));
  const double distance_m = farthest + uniform(random, 0.4, 2.2);
  const Vector3d along = setup.tracker_from_jig * setup.middle_m + setup.jig_in_tracker_m;
  const Vector3d foot = 0.5 * (along - toward * toward.dot(along));
  const Vector3d center_m = foot + distance_m * toward;
  const Quaterniond attitude = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), toward);
  const bool ferromagnetic = uniform(random, 0, 1) < 0.25;
  const double side_m = uniform(random, 5.5, 7.5);
  Solve solve;
  if (ferromagnetic) {
    const double permeability = uniform(random, 40, 200), thickness_m = uniform(random, 0.02, 0.08);
    solve = [=](const Move& move) {
      return solvePermeableSheet(16, 16, side_m / 16, thickness_m, permeability, center_m + move.by_m,
                                 move.turn * attitude);
    };
    kind = "layer of rods, " + kind;
  } else {
    const auto sheet = std::make_shared<MeshedSheet>(16, 16, side_m / 16, 1 / (3.5e7 * logUniform(random, 1e-4, 2e-3)),
                                                     setup.carrier_hz);
    solve = [=](const Move& move) { return sheet->solve(center_m + move.by_m, move.turn * attitude); };
    kind = "aluminium " + kind;
  }
  return shareOf("metal_plane", kind, solve, false,
                 {{"location_m", listed(distance_m * toward)},
                  {"material", ferromagnetic ? "ferromagnetic" : "conductive"},
                  {"amplitude", {{"name", "distance_m"}, {"value", distance_m}}},
                  {"parameters", {{"distance_m", distance_m}, {"toward", listed(toward)}, {"side_m", side_m}}}});
}

Drawn drawFinitePlate(const Setup& setup, Random& random) {
  const Vector3d at_m = placeNearGrid(setup, random, kNearest_m, kFarthest_m);
  const Quaterniond attitude = rotation(random);
  const int cells_x = 10, cells_y = uniformInt(random, 5, 10);
  const double cell_m = uniform(random, 0.3, 1.0) / cells_x;
  const bool ferromagnetic = uniform(random, 0, 1) < 0.25;
  Solve solve;
  if (ferromagnetic) {
    const double permeability = uniform(random, 40, 200), thickness_m = uniform(random, 0.002, 0.008);
    solve = [=](const Move& move) {
      return solvePermeableSheet(cells_x, cells_y, move.scale * cell_m, thickness_m, permeability, at_m + move.by_m,
                                 move.turn * attitude);
    };
  } else {
    const double sheet_ohm = 1 / (3.5e7 * logUniform(random, 2e-4, 5e-3));
    solve = [=, carrier_hz = setup.carrier_hz](const Move& move) {
      return MeshedSheet(cells_x, cells_y, move.scale * cell_m, sheet_ohm, carrier_hz)
          .solve(at_m + move.by_m, move.turn * attitude);
    };
  }
  return shareOf("finite_plate", ferromagnetic ? "sheet of laminated iron" : "aluminium sheet", solve, true,
                 {{"location_m", listed(at_m)},
                  {"material", ferromagnetic ? "ferromagnetic" : "conductive"},
                  {"parameters",
                   {{"width_m", cell_m * cells_x},
                    {"height_m", cell_m * cells_y},
                    {"normal", listed(attitude * Vector3d::UnitZ())}}}});
}

Drawn drawClosedLoop(const Setup& setup, Random& random) {
  const Vector3d at_m = placeNearGrid(setup, random, kNearest_m, kFarthest_m);
  const Vector3d normal = direction(random);
  const double radius_m = uniform(random, 0.1, 0.4), wire_m = logUniform(random, 0.0004, 0.004);
  const double resistance_ohm = 1.7e-8 * 2 * kPi * radius_m / (kPi * wire_m * wire_m) + logUniform(random, 0.001, 0.5);
  const auto solve = [=, carrier_hz = setup.carrier_hz](const Move& move) {
    const double moved_radius_m = move.scale * radius_m;
    return solveClosedLoop(roundLoop(at_m + move.by_m, move.turn * normal, moved_radius_m, 32), resistance_ohm,
                           roundLoopInductance(moved_radius_m, wire_m), carrier_hz);
  };
  return shareOf(
      "closed_loop", "copper cable loop", solve, true,
      {{"location_m", listed(at_m)},
       {"material", nullptr},
       {"parameters", {{"radius_m", radius_m}, {"normal", listed(normal)}, {"resistance_ohm", resistance_ohm}}}});
}

Drawn drawMetalMoved(const Setup& setup, Random& random) {
  const Vector3d at_m = placeNearGrid(setup, random, kNearest_m, kFarthest_m);
  const Body body = drawBody(setup, random, at_m, uniform(random, 0.2, 0.4));
  const double change_s = uniform(random, 0.3, 0.7) * setup.duration_s();
  const bool arrives = uniform(random, 0, 1) < 0.5;
  const auto solve = [=](const Move& move) {
    Scatterer metal = body.solved(move);
    (arrives ? metal.from_s : metal.until_s) = change_s;
    return metal;
  };
  return shareOf("metal_moved", body.kind + (arrives ? " brought in" : " taken away"), solve, true,
                 {{"location_m", listed(at_m)},
                  {"material", body.ferromagnetic ? "ferromagnetic" : "conductive"},
                  {"parameters", {{"change_s", change_s}, {"size_m", listed(body.size_m)}}}});
}

Drawn drawOpposedBodies(const Setup& setup, Random& random) {
  const Vector3d at_m = placeNearGrid(setup, random, kNearest_m, 0.5);
  const double length_m = uniform(random, 0.2, 0.4);
  const Vector3d apart = uniform(random, 0.5, 0.7) * length_m * direction(random) + 0.08 * direction(random);
  const Quaterniond first = rotation(random), second = rotation(random);
  const auto solve = [=, carrier_hz = setup.carrier_hz](const Move& move) {
    const auto block = [&](const Vector3d& from_middle_m, const Quaterniond& attitude, double share) {
      return makeLattice(BodyShape::kBox, at_m + move.by_m + move.turn * (move.scale * from_middle_m),
                         move.turn * attitude, Vector3d::Constant(move.scale * length_m * share), 4);
    };
    std::vector<Lattice> pair = {block(apart, first, 0.8), block(-apart, second, 0.64)};
    pair[0].permeability = solidPermeability(Vector3d::Constant(move.scale * length_m), 1, 3.5e7, carrier_hz);
    pair[1].permeability = 40;
    return solveLattices(pair);
  };
  return shareOf("off:opposed_bodies", "aluminium and ferrite blocks side by side", solve, true,
                 {{"location_m", listed(at_m)}, {"material", nullptr}, {"parameters", {{"length_m", length_m}}}});
}

Drawn drawFerriteAtTransmitter(const Setup& setup, Random& random) {
  (void)setup;
  const Vector3d at_m = uniform(random, 0.12, 0.3) * direction(random);
  const Vector3d size_m =
      uniform(random, 0.04, 0.12) * Vector3d(1, uniform(random, 0.2, 0.5), uniform(random, 0.2, 0.5));
  const Quaterniond attitude = rotation(random);
  const double permeability = uniform(random, 20, 200);
  const auto solve = [=](const Move& move) {
    Lattice rod = makeLattice(BodyShape::kBar, at_m + move.by_m, move.turn * attitude, move.scale * size_m, 7);
    rod.permeability = permeability;
    return solveLattices({rod});
  };
  return shareOf(
      "off:ferrite_at_transmitter", "ferrite rod beside the transmitter", solve, true,
      {{"location_m", listed(at_m)}, {"material", "ferromagnetic"}, {"parameters", {{"size_m", listed(size_m)}}}});
}

}  // namespace blind
