#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace fieldtrue::effects {

/// A course in time that no formula gives: on straight lines between moments, level before the first and after the
/// last.
class Course {
 public:
  /// @param times_s rising, not empty
  explicit Course(std::vector<double> times_s) : times_s_(std::move(times_s)) {}
  /// Stretches of equal length.
  Course(double start_s, double end_s, std::size_t stretches) {
    for (std::size_t k = 0; k <= stretches; ++k)
      times_s_.push_back(start_s + (end_s - start_s) * static_cast<double>(k) / static_cast<double>(stretches));
  }

  const std::vector<double>& times_s() const { return times_s_; }

  /// Calls add(k, share) for the moments whose values count at a time; the shares sum to 1.
  template <class Add>
  void weigh(double time_s, Add add) const {
    const auto after = std::upper_bound(times_s_.begin(), times_s_.end(), time_s);
    const auto k = static_cast<std::size_t>(after - times_s_.begin());
    if (k == 0) return add(std::size_t{0}, 1.0);
    if (k == times_s_.size()) return add(k - 1, 1.0);
    const double share = (time_s - times_s_[k - 1]) / (times_s_[k] - times_s_[k - 1]);
    add(k - 1, 1.0 - share);
    add(k, share);
  }

 private:
  std::vector<double> times_s_;
};

/// Numbers of stretches into which so many rows may divide a session: each needs a dozen rows of its own.
inline std::vector<std::size_t> stretchesFor(std::size_t rows) {
  constexpr std::size_t kFewestRows = 12;
  std::vector<std::size_t> numbers;
  for (const std::size_t stretches : {4U, 8U, 16U, 32U})
    if (rows >= kFewestRows * stretches) numbers.push_back(stretches);
  return numbers;
}

}  // namespace fieldtrue::effects
