#include "tests/blind/session_draw.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace blind {
namespace {

constexpr double kNearest_m = 0.5, kFarthest_m = 2.2;

void placeGrid(Setup& setup, Random& random) {
  for (;;) {
    const bool large = uniform(random, 0, 1) < 0.12;
    setup.counts = {5 + (uniform(random, 0, 1) < (large ? 0.7 : 0.15)),
                    4 + (uniform(random, 0, 1) < (large ? 0.7 : 0.2)),
                    4 + (uniform(random, 0, 1) < (large ? 0.7 : 0.25))};
    if (large) setup.counts += Eigen::Vector3i(uniformInt(random, 0, 1), uniformInt(random, 0, 1), 0);
    setup.pitch_m = uniform(random, 0.15, 0.4);
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

}  // namespace

Setup drawSetup(Random& random) {
  Setup setup;
  placeGrid(setup, random);
  setup.random_order = uniform(random, 0, 1) < 0.8;
  setup.orientations = uniform(random, 0, 1) < 0.6 ? 1 : uniformInt(random, 2, 4);
  setup.position_only = uniform(random, 0, 1) < 0.15;
  setup.heavy_tails = uniform(random, 0, 1) < 0.25;
  setup.jig_m = uniform(random, 0.001, 0.004);
  setup.jig_rad = uniform(random, 0.1, 0.4) * kPi / 180;
  // Transverse SD of one sample at 1 m: 0.745 times the coupling noise.
  setup.coupling_noise = logUniform(random, 0.0004, 0.003) / 0.745;
  setup.filter = uniform(random, 0.0, 0.75);
  setup.carrier_hz = 8013 + 2003 * uniformInt(random, 0, 3);
  setup.mounting = rotation(random);
  setup.lever_m = uniform(random, 0.0, 0.015) * direction(random);
  const bool reseats = uniform(random, 0, 1) < 1.0 / 3;
  const auto orientations = drawOrientations(setup.orientations, random);
  double time_s = uniform(random, 5, 30);
  std::map<int, int> visits_of;
  for (const Visit& visit : drawVisits(setup, random, reseats)) {
    Row row;
    row.i = visit.at.x(), row.j = visit.at.y(), row.k = visit.at.z();
    row.node = row.i + setup.counts.x() * (row.j + setup.counts.y() * row.k);
    row.visit = visits_of[row.node]++;
    row.place_m = setup.middle_m + setup.pitch_m * (visit.at.cast<double>() -
                                                    0.5 * (setup.counts - Eigen::Vector3i::Ones()).cast<double>());
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

}  // namespace blind
