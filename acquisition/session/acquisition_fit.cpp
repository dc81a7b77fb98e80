#include <algorithm>
#include <cmath>

#include "acquisition/session/acquisition_impl.h"

/// Whether the takes fit each other, and whether the sensor stands where the next one belongs.
namespace fieldtrue::acquisition {

namespace {

/// Takes nearest to a place that judge it: the cost of a take stays the same.
constexpr std::size_t kMostAround = 64;

}  // namespace

std::vector<std::size_t> AcquisitionController::Impl::takesNear(std::size_t place) const {
  return nearestTakes(place, kMostAround);
}

std::vector<std::size_t> AcquisitionController::Impl::nearestTakes(std::size_t place, std::size_t most) const {
  const Eigen::Vector3d& here_m = store->places()[place].reference_from_sensor.position_m;
  std::vector<std::pair<double, std::size_t>> by_distance;
  by_distance.reserve(takes_m.size());
  for (std::size_t other = 0; other < takes_m.size(); ++other) {
    const double distance_m2 = (takes_m[other] - here_m).squaredNorm();
    if (!std::isnan(distance_m2)) by_distance.emplace_back(distance_m2, other);
  }
  const std::size_t kept = std::min(most, by_distance.size());
  std::partial_sort(by_distance.begin(), by_distance.begin() + static_cast<std::ptrdiff_t>(kept), by_distance.end());
  std::vector<std::size_t> takes;
  for (std::size_t i = 0; i < kept; ++i) takes.push_back(by_distance[i].second);
  return takes;
}

RigFit AcquisitionController::Impl::fitOf(const std::vector<std::size_t>& takes) const {
  std::vector<Node> rows;
  for (const std::size_t place : takes) rows.push_back(*nodes[place]);
  const bool is_known = store->metadata().alignment_known;
  return {rows, spacing, is_known ? std::optional(believed_reference) : std::nullopt};
}

void AcquisitionController::Impl::judgeAround(std::size_t place, std::vector<bool>* is_judged) {
  const std::vector<std::size_t> takes = takesNear(place);
  // Those at the rim of what is looked at lack neighbours; they are judged with the takes around them.
  const std::size_t judged = takes.size() < kMostAround ? takes.size() : kMostAround / 2;
  told_recorded.reset();
  misfits.erase(place);
  for (std::size_t i = 0; i < judged; ++i) {
    misfits.erase(takes[i]);
    if (is_judged) (*is_judged)[takes[i]] = true;
  }
  for (const RigFit::Misfit& misfit : fitOf(takes).misfits()) {
    if (misfit.take < judged) misfits[takes[misfit.take]] = misfit.off_m;
  }
}

void AcquisitionController::Impl::judgeAll() {
  told_recorded.reset();
  misfits.clear();
  std::vector<bool> is_judged(nodes.size(), false);
  for (std::size_t place = 0; place < nodes.size(); ++place) {
    if (!is_judged[place] && nodes[place]) judgeAround(place, &is_judged);
  }
}

std::optional<double> AcquisitionController::Impl::tooFar_m() const {
  if (!rig.usable()) return std::nullopt;
  const auto off_m = distanceToCurrent_m();
  if (!off_m || *off_m <= rig.limit_m(store->places()[*current].reference_from_sensor.position_m)) return std::nullopt;
  return off_m;
}

void AcquisitionController::Impl::refuse(double off_m) {
  failure =
      QStringLiteral("not taken: the sensor is not at this place. Carry it there, or press again to take it here");
  failure_time_s = live->time_s;
  refused_at = current;
  note("take refused", currentName() + ": the sensor is " + std::to_string(off_m) + " m from it");
  changed();
  emit owner->takeRefused(static_cast<int>(*current), off_m);
}

}  // namespace fieldtrue::acquisition
