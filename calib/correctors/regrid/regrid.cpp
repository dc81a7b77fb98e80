#include "calib/correctors/regrid/regrid.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/correctors/regrid/surrounding_tetrahedron.h"

namespace fieldtrue::correctors {
namespace {

/// A target so far outside the hull is still on it: rounding in files, not extrapolation.
constexpr double kHullMargin_m = 1e-6;
/// Nearer than this a target is the place itself, and 1/d^2 would leave it no other value.
constexpr double kCoincident_m = 1e-9;
/// Of the Gaussian kernel, in pitches (survey, section 5).
constexpr double kCutOffPitches = 3.0;
/// So many nearest places show whether a left-out place lies between the others; where they do not, all are asked.
constexpr std::size_t kHullNeighbours = 64;

struct NamedMethod {
  RegridMethod method;
  const char* id;
};
constexpr std::array<NamedMethod, 3> kMethods = {{{RegridMethod::kBriggs, "briggs"},
                                                  {RegridMethod::kLivingston, "livingston"},
                                                  {RegridMethod::kCzernuszenko, "czernuszenko"}}};

Region hullOf(std::span<const Eigen::Vector3d> p_m) {
  constexpr int kVolume = 3;
  return pointSpread(p_m).dimension == kVolume ? Region::around(p_m, kVolume, kHullMargin_m) : Region();
}

void normalise(std::vector<RegridWeight>& weights) {
  double sum = 0.0;
  for (const RegridWeight& w : weights) sum += w.weight;
  for (RegridWeight& w : weights) w.weight /= sum;
}

std::vector<RegridWeight> inverseSquared(std::span<const std::pair<double, std::size_t>> neighbours) {
  std::vector<RegridWeight> weights;
  weights.reserve(neighbours.size());
  for (const auto& [d2_m2, place] : neighbours) weights.push_back({place, 1.0 / d2_m2});
  normalise(weights);
  return weights;
}

}  // namespace

Result<RegridMethod> findRegridMethod(std::string_view id) {
  std::string known;
  for (const NamedMethod& named : kMethods) {
    if (named.id == id) return named.method;
    known += (known.empty() ? "" : ", ") + std::string(named.id);
  }
  return fail(ErrorCode::kBadInput, "No resampling method is called '" + std::string(id) + "'; there are: " + known);
}

std::string regridMethodId(RegridMethod method) {
  const auto found = std::find_if(kMethods.begin(), kMethods.end(),
                                  [method](const NamedMethod& named) { return named.method == method; });
  FT_CHECK(found != kMethods.end());
  return found->id;
}

Regridder::Regridder(std::span<const Eigen::Vector3d> p_tracked_m, const RegridOptions& options)
    : p_tracked_m_(p_tracked_m.begin(), p_tracked_m.end()), options_(options), hull_(hullOf(p_tracked_m)) {
  FT_CHECK(options.pitch_m > 0.0 && options.width_pitches > 0.0);
}

std::vector<Regridder::Neighbour> Regridder::neighbours(const Eigen::Vector3d& target_m,
                                                        std::optional<std::size_t> left_out) const {
  std::vector<Neighbour> nearest_first;
  nearest_first.reserve(p_tracked_m_.size());
  for (std::size_t place = 0; place < p_tracked_m_.size(); ++place)
    if (place != left_out) nearest_first.emplace_back((p_tracked_m_[place] - target_m).squaredNorm(), place);
  std::sort(nearest_first.begin(), nearest_first.end());
  return nearest_first;
}

bool Regridder::inHull(const Eigen::Vector3d& target_m, std::optional<std::size_t> left_out,
                       std::span<const Neighbour> nearest_first) const {
  if (!hull_.contains(target_m)) return false;
  // A place inside the hull is no corner of it: without the place the hull is the same.
  if (!left_out || hull_.outside_m(target_m) < -kHullMargin_m) return true;
  for (const std::size_t count : {std::min(kHullNeighbours, nearest_first.size()), nearest_first.size()}) {
    std::vector<Eigen::Vector3d> others_m;
    others_m.reserve(count);
    for (const auto& [d2_m2, place] : nearest_first.first(count)) others_m.push_back(p_tracked_m_[place]);
    if (hullOf(others_m).contains(target_m)) return true;
  }
  return false;
}

std::vector<RegridWeight> Regridder::tetrahedronWeights(const Eigen::Vector3d& target_m,
                                                        std::span<const Neighbour> nearest_first) const {
  for (const std::size_t wanted : {kTetrahedronCandidates, 2 * kTetrahedronCandidates, 4 * kTetrahedronCandidates}) {
    const auto candidates = nearest_first.first(std::min(wanted, nearest_first.size()));
    std::vector<Eigen::Vector3d> corners_m;
    for (const auto& [d2_m2, place] : candidates) corners_m.push_back(p_tracked_m_[place]);
    if (const auto corners = smallestSurroundingTetrahedron(corners_m, target_m)) {
      std::array<Neighbour, 4> chosen;
      std::transform(corners->begin(), corners->end(), chosen.begin(), [&](std::size_t i) { return candidates[i]; });
      return inverseSquared(chosen);
    }
    if (candidates.size() == nearest_first.size()) break;
  }
  return {};
}

std::vector<RegridWeight> Regridder::gaussianWeights(std::span<const Neighbour> nearest_first) const {
  const double cut_off_m = kCutOffPitches * options_.pitch_m;
  const double width_m = options_.width_pitches * options_.pitch_m;
  std::vector<RegridWeight> weights;
  for (const auto& [d2_m2, place] : nearest_first) {
    if (d2_m2 > cut_off_m * cut_off_m) break;
    // Relative to the nearest place, whose own exponential may underflow under a narrow kernel.
    weights.push_back({place, std::exp(-0.5 * (d2_m2 - nearest_first.front().first) / (width_m * width_m))});
  }
  if (!weights.empty()) normalise(weights);
  return weights;
}

std::vector<RegridWeight> Regridder::weightsAt(const Eigen::Vector3d& target_m,
                                               std::optional<std::size_t> left_out) const {
  const std::vector<Neighbour> nearest_first = neighbours(target_m, left_out);
  if (nearest_first.empty() || !target_m.allFinite()) return {};
  const bool smooths = options_.method == RegridMethod::kLivingston;
  if (!smooths && nearest_first.front().first <= kCoincident_m * kCoincident_m)
    return {{nearest_first.front().second, 1.0}};
  if (!inHull(target_m, left_out, nearest_first)) return {};
  if (smooths) return gaussianWeights(nearest_first);
  return options_.method == RegridMethod::kBriggs ? tetrahedronWeights(target_m, nearest_first)
                                                  : inverseSquared(nearest_first);
}

std::vector<std::vector<RegridWeight>> regridWeights(std::span<const Eigen::Vector3d> p_tracked_m,
                                                     std::span<const Eigen::Vector3d> targets_m,
                                                     const RegridOptions& options) {
  const Regridder regridder(p_tracked_m, options);
  std::vector<std::vector<RegridWeight>> weights;
  weights.reserve(targets_m.size());
  for (const Eigen::Vector3d& target_m : targets_m) weights.push_back(regridder.weightsAt(target_m));
  return weights;
}

}  // namespace fieldtrue::correctors
