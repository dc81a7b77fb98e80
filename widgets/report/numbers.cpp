#include "widgets/report/numbers.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

namespace fieldtrue {

std::string decimalText(double value, int decimals) {
  if (!std::isfinite(value)) return "n/a";
  std::array<char, 1024> text{};
  const auto [end, error] =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, decimals);
  if (error != std::errc()) return "n/a";
  const std::string result(text.data(), end);
  const bool zero = result.find_first_of("123456789") == std::string::npos;
  return zero && result.front() == '-' ? result.substr(1) : result;
}

std::string significantText(double value, int digits) {
  if (!std::isfinite(value)) return "n/a";
  if (value == 0.0) return "0";
  // Rounded first: 9.996 is 10.0 and not 10.00.
  std::array<char, 64> text{};
  const auto rounded =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::scientific, digits - 1);
  const std::string_view written(text.data(), static_cast<std::size_t>(rounded.ptr - text.data()));
  const std::string exponent_text(written.substr(written.find('e') + 1));
  const int exponent = std::stoi(exponent_text);
  double rounded_value = 0.0;
  std::from_chars(text.data(), rounded.ptr, rounded_value);
  return decimalText(rounded_value, std::clamp(digits - 1 - exponent, 0, 400));
}

std::string errorFigure(double value) {
  const bool tiny = value > 0.0 && value < 0.001;
  return tiny ? "<0.001" : significantText(value);
}

std::string durationText(double seconds) {
  if (seconds < 1e-6) return significantText(seconds * 1e9) + " ns";
  if (seconds < 1e-3) return significantText(seconds * 1e6) + " us";
  if (seconds < 1.0) return significantText(seconds * 1e3) + " ms";
  return significantText(seconds) + " s";
}

}  // namespace fieldtrue
