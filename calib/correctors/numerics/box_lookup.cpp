#include "calib/correctors/numerics/box_lookup.h"

#include <algorithm>
#include <cmath>

namespace fieldtrue::correctors {
namespace {

constexpr double kMostBins = 64.0;

}  // namespace

BoxLookup::BoxLookup(std::span<const Eigen::AlignedBox3d> boxes) {
  if (boxes.empty()) return;
  Eigen::Vector3d mean_size_m = Eigen::Vector3d::Zero();
  for (const Eigen::AlignedBox3d& box : boxes) {
    bounds_.extend(box);
    mean_size_m += box.sizes() / static_cast<double>(boxes.size());
  }
  // Bins as large as the usual box: each box is then in about eight of them, and a bin holds few.
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double extent_m = bounds_.sizes()[axis];
    const double wanted = mean_size_m[axis] > 0.0 ? std::round(extent_m / mean_size_m[axis]) : 1.0;
    counts_[static_cast<std::size_t>(axis)] = static_cast<std::size_t>(std::clamp(wanted, 1.0, kMostBins));
    if (extent_m > 0.0) bins_per_m_[axis] = static_cast<double>(counts_[static_cast<std::size_t>(axis)]) / extent_m;
  }
  starts_.assign(counts_[0] * counts_[1] * counts_[2] + 1, 0);
  const auto for_each_bin = [&](const Eigen::AlignedBox3d& box, const auto& visit) {
    const Bin low = binOf(box.min());
    const Bin high = binOf(box.max());
    Bin bin = low;
    for (bin[0] = low[0]; bin[0] <= high[0]; ++bin[0])
      for (bin[1] = low[1]; bin[1] <= high[1]; ++bin[1])
        for (bin[2] = low[2]; bin[2] <= high[2]; ++bin[2]) visit(flat(bin));
  };
  for (const Eigen::AlignedBox3d& box : boxes) for_each_bin(box, [&](std::size_t bin) { ++starts_[bin + 1]; });
  for (std::size_t bin = 1; bin < starts_.size(); ++bin) starts_[bin] += starts_[bin - 1];
  items_.resize(starts_.back());
  std::vector<std::size_t> next(starts_.begin(), starts_.end() - 1);
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for_each_bin(boxes[i], [&](std::size_t bin) { items_[next[bin]++] = static_cast<int>(i); });
}

BoxLookup::Bin BoxLookup::binOf(const Eigen::Vector3d& point_m) const {
  Bin bin{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    const double place = (point_m[i] - bounds_.min()[i]) * bins_per_m_[i];
    bin[axis] = std::min(counts_[axis] - 1, static_cast<std::size_t>(std::max(0.0, place)));
  }
  return bin;
}

std::span<const int> BoxLookup::near(const Eigen::Vector3d& point_m) const {
  if (starts_.empty() || !bounds_.contains(point_m)) return {};
  const std::size_t bin = flat(binOf(point_m));
  return {items_.data() + starts_[bin], items_.data() + starts_[bin + 1]};
}

}  // namespace fieldtrue::correctors
