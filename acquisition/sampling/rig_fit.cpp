#include "acquisition/sampling/rig_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "calib/core/statistics.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::acquisition {

namespace {

constexpr std::size_t kFewestTakes = 4;
constexpr double kFlatRatio = 0.25;    ///< Takes nearer to one line than this leave the turn about it open.
constexpr double kPitchShare = 0.6;    ///< Of the pitch: what a sensor at its own place is never off by itself.
constexpr double kScatterShare = 3.0;  ///< Times what the takes around differ among themselves.
constexpr double kAgreeShare = 0.35;   ///< Of the pitch: takes that leave less all agree.
constexpr double kReach = 2.1;         ///< Pitches within which takes count as around a place.
constexpr std::size_t kAround = 6;
constexpr std::size_t kFewestAround = 3;
constexpr std::size_t kTriples = 150;
constexpr std::size_t kLooked = 200;  ///< Takes by which a triple is judged, at most.
constexpr int kTrims = 6;

using Points = std::vector<Eigen::Vector3d>;

Eigen::Vector3d middle(const std::vector<Eigen::Vector3d>& values) {
  Eigen::Vector3d result;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const Eigen::Vector3d& value : values) along.push_back(value[axis]);
    result[axis] = median(along);
  }
  return result;
}

/// Every step-th take, so that at most kLooked are looked at.
std::vector<std::size_t> lookedAt(std::size_t count) {
  const std::size_t step = (count + kLooked - 1) / kLooked;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < count; i += step) rows.push_back(i);
  return rows;
}

std::vector<std::array<std::size_t, 3>> triplesOf(const std::vector<std::size_t>& rows) {
  const std::size_t n = rows.size();
  std::vector<std::array<std::size_t, 3>> triples;
  if (n * (n - 1) * (n - 2) / 6 <= kTriples) {
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = a + 1; b < n; ++b)
        for (std::size_t c = b + 1; c < n; ++c) triples.push_back({rows[a], rows[b], rows[c]});
    return triples;
  }
  std::mt19937_64 random(1);
  while (triples.size() < kTriples) {
    const std::size_t a = random() % n, b = random() % n, c = random() % n;
    if (a != b && b != c && a != c) triples.push_back({rows[a], rows[b], rows[c]});
  }
  return triples;
}

Result<Pose> fitRows(const Points& tracked_m, const Points& true_m, std::span<const std::size_t> rows) {
  Points from, to;
  for (const std::size_t row : rows) {
    from.push_back(tracked_m[row]);
    to.push_back(true_m[row]);
  }
  return fitRigid(from, to);
}

}  // namespace

RigFit::RigFit(std::span<const Node> done, double pitch_m, const std::optional<Pose>& known) : pitch_m_(pitch_m) {
  for (const Node& node : done) {
    if (node.role == NodeRole::kSkipped) continue;
    tracked_m_.push_back(node.tracker_from_sensor.position_m);
    true_m_.push_back(node.reference_from_sensor.position_m);
  }
  if (true_m_.size() < kFewestTakes) return;
  if (known) {
    reference_from_tracker_ = *known;
  } else {
    if (pointSpread(true_m_, kFlatRatio).dimension < 2) return;
    const auto all = fitRigid(tracked_m_, true_m_);
    if (!all) return;
    reference_from_tracker_ = *all;
    fitMost();
  }
  setResiduals();
  // Four takes of which one is wrong agree on nothing, and which of them it is cannot be told.
  usable_ = known || typical_m_ <= kAgreeShare * pitch_m_ || true_m_.size() > kFewestTakes;
}

void RigFit::setResiduals() {
  residual_m_.clear();
  std::vector<double> lengths_m;
  for (std::size_t i = 0; i < true_m_.size(); ++i) {
    residual_m_.push_back(reference_from_tracker_ * tracked_m_[i] - true_m_[i]);
    lengths_m.push_back(residual_m_.back().norm());
  }
  typical_m_ = median(lengths_m);
}

void RigFit::fitMost() {
  setResiduals();
  const auto largest = [this] {
    double most_m = 0.0;
    for (const Eigen::Vector3d& residual : residual_m_) most_m = std::max(most_m, residual.norm());
    return most_m;
  };
  if (largest() <= kAgreeShare * pitch_m_) return;
  const std::vector<std::size_t> rows = lookedAt(true_m_.size());
  // The three of a triple always fit themselves: more than half of the others must agree with them.
  const std::size_t counted = std::min(rows.size() - 1, (rows.size() + 2) / 2);
  const auto spanOf = [&](const Pose& pose) {
    std::vector<double> off_m;
    for (const std::size_t row : rows) off_m.push_back((pose * tracked_m_[row] - true_m_[row]).norm());
    std::nth_element(off_m.begin(), off_m.begin() + static_cast<std::ptrdiff_t>(counted), off_m.end());
    return off_m[counted];
  };
  Pose best = reference_from_tracker_;
  double best_m = spanOf(best);
  for (const auto& triple : triplesOf(rows)) {
    const auto fitted = fitRows(tracked_m_, true_m_, triple);
    if (!fitted) continue;
    const double span_m = spanOf(*fitted);
    if (span_m >= best_m) continue;
    best = *fitted;
    best_m = span_m;
  }
  for (int trim = 0; trim < kTrims; ++trim) {
    std::vector<std::size_t> agreeing;
    for (std::size_t row = 0; row < true_m_.size(); ++row) {
      const double off_m = (best * tracked_m_[row] - true_m_[row]).norm();
      if (off_m <= std::max(kAgreeShare * pitch_m_, 1.5 * best_m)) agreeing.push_back(row);
    }
    const auto fitted = fitRows(tracked_m_, true_m_, agreeing);
    if (!fitted) break;
    best = *fitted;
  }
  reference_from_tracker_ = best;
  setResiduals();
}

RigFit::Around RigFit::around(const Eigen::Vector3d& true_m, std::optional<std::size_t> without) const {
  std::vector<std::pair<double, std::size_t>> nearest;
  for (std::size_t row = 0; row < true_m_.size(); ++row) {
    if (row == without) continue;
    nearest.emplace_back((true_m_[row] - true_m).norm(), row);
  }
  const std::size_t kept = std::min(kAround, nearest.size());
  std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(kept), nearest.end());
  nearest.resize(kept);
  Around result;
  result.nearest_m = nearest.front().first;
  result.scatter_m = typical_m_;
  Points bends_m;
  for (const auto& [distance_m, row] : nearest)
    if (distance_m <= kReach * pitch_m_) bends_m.push_back(residual_m_[row]);
  if (bends_m.size() < kFewestAround) return result;
  result.bend_m = middle(bends_m);
  std::vector<double> differences_m;
  for (const Eigen::Vector3d& bend_m : bends_m) differences_m.push_back((bend_m - result.bend_m).norm());
  result.scatter_m = median(differences_m);
  return result;
}

double RigFit::limitOf(const Around& around) const {
  // Far from every take the rigid part alone foretells, and the worse the farther.
  const double reach = std::max(1.0, around.nearest_m / pitch_m_);
  return reach * (kPitchShare * pitch_m_ + kScatterShare * around.scatter_m);
}

double RigFit::off_m(const Eigen::Vector3d& tracked_m, const Eigen::Vector3d& true_m) const {
  FT_CHECK(usable_);
  return (reference_from_tracker_ * tracked_m - true_m - around(true_m, std::nullopt).bend_m).norm();
}

double RigFit::limit_m(const Eigen::Vector3d& true_m) const {
  FT_CHECK(usable_);
  return limitOf(around(true_m, std::nullopt));
}

std::vector<RigFit::Misfit> RigFit::misfits() const {
  std::vector<Misfit> found;
  // Four takes alone cannot tell which of them is the wrong one.
  if (!usable_ || true_m_.size() <= kFewestTakes) return found;
  for (std::size_t take = 0; take < true_m_.size(); ++take) {
    const Around others = around(true_m_[take], take);
    const double off_m = (residual_m_[take] - others.bend_m).norm();
    if (off_m > limitOf(others)) found.push_back({take, off_m});
  }
  return found;
}

}  // namespace fieldtrue::acquisition
