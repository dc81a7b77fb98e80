#include "calib/core/number_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

namespace fieldtrue {

std::string fixedText(double value, int decimals) {
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
  return fixedText(rounded_value, std::clamp(digits - 1 - exponent, 0, 400));
}

std::string shortNumber(double value) {
  if (std::abs(value) < 1e-9) return "0";
  std::string number =
      fixedText(value, std::clamp(2 - static_cast<int>(std::floor(std::log10(std::abs(value)))), 0, 6));
  if (number.find('.') != std::string::npos) {
    number.erase(number.find_last_not_of('0') + 1);
    if (number.back() == '.') number.pop_back();
  }
  return number;
}

}  // namespace fieldtrue
