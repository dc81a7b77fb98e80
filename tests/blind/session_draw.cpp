#include "tests/blind/session_draw.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace blind {
namespace {

constexpr double kNearest_m = 0.5, kFarthest_m = 2.2;

/// Most grids have about a hundred places, some few, some several hundred, and a few up to five thousand.
void drawCounts(Setup& setup, double size, Random& random) {
  const auto extra = [&](double chance) { return uniform(random, 0, 1) < chance ? 1 : 0; };
  if (size < 0.10) {
    setup.counts = {4 + extra(0.5), 3 + extra(0.5), 3 + extra(0.3)};
    setup.counts.x() += setup.counts.prod() < 40 ? 1 : 0;
    setup.pitch_m = uniform(random, 0.2, 0.45);
  } else if (size < 0.20) {
    setup.counts = {uniformInt(random, 6, 9), uniformInt(random, 5, 8), uniformInt(random, 4, 6)};
    setup.pitch_m = uniform(random, 0.08, 0.3);
  } else if (size < 0.204) {
    setup.counts = {uniformInt(random, 10, 17), uniformInt(random, 10, 17), uniformInt(random, 9, 17)};
    setup.pitch_m = uniform(random, 0.05, 0.1);
  } else {
    setup.counts = {5 + extra(0.15), 4 + extra(0.2), 4 + extra(0.25)};
    setup.pitch_m = uniform(random, 0.15, 0.4);
  }
}

void placeGrid(Setup& setup, Random& random) {
  const double size = uniform(random, 0, 1);
  for (;;) {
    drawCounts(setup, size, random);
    setup.tracker_from_jig = turned(0.12 * normalVector(random), Quaterniond::Identity()) *
                             Quaterniond(Eigen::AngleAxisd(uniform(random, 0, 2 * kPi), Vector3d::UnitZ()));
    const double turn = uniform(random, 0, 2 * kPi);
    const Vector3d toward = Vector3d(std::cos(turn), std::sin(turn), uniform(random, -0.7, 0.7)).normalized();
    const Vector3d extent_m = setup.pitch_m * (setup.counts - Eigen::Vector3i::Ones()).cast<double>();
    const Vector3d corner_m = uniform(random, -0.5, 0.5) * Vector3d::Ones();
    setup.middle_m = corner_m + 0.5 * extent_m;
    const Vector3d center_m = uniform(random, 0.9, 1.5) * toward;
    setup.jig_in_tracker_m = center_m - setup.tracker_from_jig * setup.middle_m;
    double nearest = 1e9, farthest = 0, beside = 1e9;
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d share(corner & 1, (corner >> 1) & 1, (corner >> 2) & 1);
      const Vector3d at = setup.jig_in_tracker_m + setup.tracker_from_jig * (corner_m + share.cwiseProduct(extent_m));
      farthest = std::max(farthest, at.norm());
      beside = std::min(beside, at.dot(toward));
    }
    const Vector3d middle = setup.tracker_from_jig.conjugate() * center_m;
    nearest = (middle.cwiseAbs() - 0.5 * extent_m).cwiseMax(0.0).norm();
    if (nearest > kNearest_m + 0.05 && farthest < kFarthest_m - 0.05 && beside > 0.1) return;
  }
}

struct Visit {
  Eigen::Vector3i at;
  int orientation;
};

std::vector<Visit> drawVisits(const Setup& setup, Random& random, bool reseats) {
  std::vector<Visit> visits, again;
  for (int k = 0; k < setup.counts.z(); ++k)
    for (int j = 0; j < setup.counts.y(); ++j)
      for (int i = 0; i < setup.counts.x(); ++i) {
        const int column = (k % 2 == 0) ? j : setup.counts.y() - 1 - j;
        const int row = ((k * setup.counts.y() + j) % 2 == 0) ? i : setup.counts.x() - 1 - i;
        const int first = setup.orientations == 1 ? 0 : uniformInt(random, 0, setup.orientations - 1);
        visits.push_back({{row, column, k}, first});
        if (setup.orientations > 1 && uniform(random, 0, 1) < 0.35)
          again.push_back({{row, column, k}, (first + 1) % setup.orientations});
        else if (reseats && uniform(random, 0, 1) < 0.12)
          for (int n = uniformInt(random, 1, 2); n > 0; --n) again.push_back({{row, column, k}, first});
      }
  visits.insert(visits.end(), again.begin(), again.end());
  if (setup.random_order)
    for (std::size_t n = visits.size(); n > 1; --n)
      std::swap(visits[n - 1], visits[static_cast<std::size_t>(uniformInt(random, 0, static_cast<int>(n) - 1))]);
  return visits;
}

std::vector<Quaterniond> drawOrientations(int count, Random& random) {
  std::vector<Quaterniond> orientations{Quaterniond::Identity()};
  while (static_cast<int>(orientations.size()) < count) {
    const Quaterniond next = rotation(random);
    bool apart = true;
    for (const Quaterniond& other : orientations) apart = apart && next.angularDistance(other) > 0.8;
    if (apart) orientations.push_back(next);
  }
  return orientations;
}

/// Places by node number: on the grid, or anywhere in its box.
std::vector<Vector3d> drawPlaces(const Setup& setup, Random& random) {
  const Vector3d most = (setup.counts - Eigen::Vector3i::Ones()).cast<double>();
  std::vector<Vector3d> places_m;
  for (int k = 0; k < setup.counts.z(); ++k)
    for (int j = 0; j < setup.counts.y(); ++j)
      for (int i = 0; i < setup.counts.x(); ++i) {
        Vector3d at(i, j, k);
        if (setup.scattered)
          for (int axis = 0; axis < 3; ++axis) at[axis] = uniform(random, 0, most[axis]);
        places_m.push_back(setup.middle_m + setup.pitch_m * (at - 0.5 * most));
      }
  return places_m;
}

Setup drawAnySetup(Random& random) {
  Setup setup;
  placeGrid(setup, random);
  setup.scattered = uniform(random, 0, 1) < 0.1;
  setup.random_order = uniform(random, 0, 1) < 0.8 || setup.scattered;
  setup.orientations = uniform(random, 0, 1) < 0.6 ? 1 : uniformInt(random, 2, 4);
  setup.position_only = uniform(random, 0, 1) < 0.15;
  setup.heavy_tails = uniform(random, 0, 1) < 0.25;
  setup.jig_m = uniform(random, 0.001, 0.004);
  setup.jig_rad = uniform(random, 0.1, 0.4) * kPi / 180;
  // Transverse SD of one sample at 1 m: 0.745 times the coupling noise.
  setup.coupling_noise = logUniform(random, 0.0004, 0.003) / 0.745;
  setup.filter = uniform(random, 0, 1) < 0.2 ? 0.0 : uniform(random, 0.0, 0.75);
  setup.carrier_hz = 8013 + 2003 * uniformInt(random, 0, 3);
  setup.mounting = rotation(random);
  setup.lever_m = uniform(random, 0.0, 0.015) * direction(random);
  const bool reseats = uniform(random, 0, 1) < 1.0 / 3;
  const auto orientations = drawOrientations(setup.orientations, random);
  double time_s = uniform(random, 5, 30);
  std::map<int, int> visits_of;
  const auto places_m = drawPlaces(setup, random);
  for (const Visit& visit : drawVisits(setup, random, reseats)) {
    Row row;
    row.i = visit.at.x(), row.j = visit.at.y(), row.k = visit.at.z();
    row.node = row.i + setup.counts.x() * (row.j + setup.counts.y() * row.k);
    row.visit = visits_of[row.node]++;
    row.place_m = places_m[static_cast<std::size_t>(row.node)];
    row.attitude = orientations[static_cast<std::size_t>(visit.orientation)];
    time_s += uniform(random, 6, 20);
    row.start_s = time_s;
    row.end_s = time_s + (setup.samples - 1) / setup.rate_hz;
    time_s = row.end_s;
    setup.rows.push_back(row);
  }
  setup.latest_s = time_s;
  return setup;
}

}  // namespace

Setup drawSetup(Random& random, std::size_t most_rows) {
  for (;;) {
    Setup setup = drawAnySetup(random);
    if (most_rows == 0 || setup.rows.size() <= most_rows) return setup;
  }
}

}  // namespace blind
