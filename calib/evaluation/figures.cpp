#include "calib/evaluation/figures.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace fieldtrue {

std::string fixedText(double value, int decimals) {
  std::array<char, 512> buffer;
  const auto written =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::fixed, decimals);
  if (written.ec != std::errc()) return "?";
  const std::string text(buffer.data(), written.ptr);
  const bool is_zero = text.find_first_of("123456789") == std::string::npos;
  return is_zero && text.front() == '-' ? text.substr(1) : text;
}

std::string errorText(double value) {
  return fixedText(value, value >= 9.95 ? (value >= 99.5 ? 0 : 1) : (value >= 0.0995 ? 2 : 4));
}

std::string percentText(double fraction) { return fixedText(100.0 * fraction, std::abs(fraction) < 0.2 ? 1 : 0); }

std::string pointText(const Eigen::Vector3d& point_m) {
  return "(" + fixedText(point_m.x(), 2) + ", " + fixedText(point_m.y(), 2) + ", " + fixedText(point_m.z(), 2) + ") m";
}

std::string listText(const std::vector<int>& numbers, std::size_t most) {
  std::string text;
  for (std::size_t i = 0; i < std::min(most, numbers.size()); ++i)
    text += (i == 0 ? "" : ", ") + std::to_string(numbers[i]);
  return numbers.size() > most ? text + " and " + std::to_string(numbers.size() - most) + " more" : text;
}

std::string countText(std::size_t count, const std::string& one, const std::string& several) {
  return std::to_string(count) + " " + (count == 1 ? one : several);
}

}  // namespace fieldtrue
