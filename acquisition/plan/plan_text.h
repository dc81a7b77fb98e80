#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "acquisition/plan/plan.h"

namespace fieldtrue::acquisition {

inline constexpr double kMaxCoordinate_m = 1000.0;

/// The whole text as a number, or none.
template <class Number>
std::optional<Number> parseNumber(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Reads `NXxNYxNZ@PX[xPYxPZ]` into counts and pitch. @error kBadInput
Result<void> readGridText(std::string_view text, Plan& plan);

/// Places times visits; beyond kMaxPlaces only that it is beyond.
std::int64_t stopsOf(const Plan& plan);

/// @param name stands in the message
/// @error kBadInput when the plan has more stops than kMaxPlaces
Result<void> checkPlanSize(const Plan& plan, const std::string& name);

}  // namespace fieldtrue::acquisition
