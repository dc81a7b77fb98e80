#include "acquisition/plan/plan.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <random>

namespace fieldtrue::acquisition {

namespace {

/// An unbiased draw from [0, bound). std::uniform_int_distribution may differ between standard libraries.
std::uint64_t drawBelow(std::mt19937_64& random, std::uint64_t bound) {
  const std::uint64_t limit =
      std::numeric_limits<std::uint64_t>::max() - (std::numeric_limits<std::uint64_t>::max() % bound + 1) % bound;
  std::uint64_t value = random();
  while (value > limit) value = random();
  return value % bound;
}

void shuffle(std::vector<PlannedPlace>& places, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  for (std::size_t i = places.size(); i > 1; --i) std::swap(places[i - 1], places[drawBelow(random, i)]);
}

std::vector<PlannedPlace> levelWalk(const Plan& plan, int k) {
  const auto [nx, ny, nz] = plan.counts;
  const Eigen::Vector3d origin = origin_m(plan);
  std::vector<PlannedPlace> walk;
  walk.reserve(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny));
  for (int j = 0; j < ny; ++j) {
    for (int step = 0; step < nx; ++step) {
      const int i = j % 2 == 0 ? step : nx - 1 - step;
      PlannedPlace place;
      place.node = (k * ny + j) * nx + i;
      place.index = {i, j, k};
      place.reference_from_sensor.position_m = origin + Eigen::Vector3d(i, j, k).cwiseProduct(plan.pitch_m);
      walk.push_back(place);
    }
  }
  return walk;
}

void appendVisit(std::vector<PlannedPlace>& all, const std::vector<PlannedPlace>& walk, const Plan& plan, int visit) {
  const Eigen::Quaterniond turn = planOrientation(visit / plan.reseat);
  for (PlannedPlace place : walk) {
    place.visit += visit;
    if (visit >= plan.reseat) {
      place.reference_from_sensor.orientation = canonical(place.reference_from_sensor.orientation * turn);
    }
    all.push_back(place);
  }
}

std::vector<PlannedPlace> explicitPlaces(const Plan& plan) {
  std::vector<PlannedPlace> all;
  for (int visit = 0; visit < plan.orientations * plan.reseat; ++visit) {
    appendVisit(all, plan.explicit_places, plan, visit);
  }
  return all;
}

std::vector<PlannedPlace> gridPlaces(const Plan& plan) {
  std::vector<PlannedPlace> all;
  bool backwards = false;
  for (int k = 0; k < plan.counts[2]; ++k) {
    std::vector<PlannedPlace> walk = levelWalk(plan, k);
    if (backwards) std::reverse(walk.begin(), walk.end());
    for (int visit = 0; visit < plan.orientations * plan.reseat; ++visit) {
      appendVisit(all, walk, plan, visit);
      std::reverse(walk.begin(), walk.end());
      backwards = !backwards;
    }
  }
  return all;
}

}  // namespace

std::vector<PlannedPlace> places(const Plan& plan) {
  std::vector<PlannedPlace> all = plan.explicit_places.empty() ? gridPlaces(plan) : explicitPlaces(plan);
  if (plan.order == PlanOrder::kRandom) shuffle(all, plan.seed);
  return all;
}

Eigen::Vector3d origin_m(const Plan& plan) {
  if (plan.origin_m) return *plan.origin_m;
  return {1.5 * plan.pitch_m.x(), -0.5 * (plan.counts[1] - 1) * plan.pitch_m.y(),
          -0.5 * (plan.counts[2] - 1) * plan.pitch_m.z()};
}

Eigen::Quaterniond planOrientation(int number) {
  FT_CHECK(number >= 0 && number < kMaxOrientations);
  const double half = std::numbers::sqrt2 / 2;
  const std::array<Eigen::Quaterniond, 4> half_turns{Eigen::Quaterniond(1, 0, 0, 0), Eigen::Quaterniond(0, 1, 0, 0),
                                                     Eigen::Quaterniond(0, 0, 1, 0), Eigen::Quaterniond(0, 0, 0, 1)};
  const std::array<Eigen::Quaterniond, 3> third_turns{
      Eigen::Quaterniond(1, 0, 0, 0), Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5), Eigen::Quaterniond(-0.5, 0.5, 0.5, 0.5)};
  const Eigen::Quaterniond quarter_turn = number < 12 ? half_turns[0] : Eigen::Quaterniond(half, 0, 0, half);
  const auto in_group = static_cast<std::size_t>(number % 12);
  return canonical(quarter_turn * half_turns[in_group / 3] * third_turns[in_group % 3]);
}

std::vector<double> pipeLengths_m(const Plan& plan) {
  const double lowest_m = origin_m(plan).z();
  if (!plan.explicit_places.empty() || plan.pipe_base_m >= lowest_m) return {};
  std::vector<double> lengths_m;
  for (int k = 0; k < plan.counts[2]; ++k) lengths_m.push_back(lowest_m + k * plan.pitch_m.z() - plan.pipe_base_m);
  return lengths_m;
}

}  // namespace fieldtrue::acquisition
