#include "acquisition/sampling/take_length.h"

#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include "calib/core/number_text.h"

namespace fieldtrue::acquisition {

namespace {

/// What a length is counted in, in the order of TakeLength::Until.
struct LengthUnit {
  std::string_view symbol;
  double unit;  ///< In what `amount` is counted in.
  double least, most;
  const char* words;
};
constexpr std::array<LengthUnit, 3> kUnits{{
    {"", 1.0, 1.0, 100000.0, "1 to 100000 samples"},
    {"s", 1.0, 0.1, 600.0, "0.1 to 600 s"},
    {"mm", 1e-3, 0.001, 100.0, "a standard error of 0.001 to 100 mm"},
}};

const LengthUnit& unitOf(const TakeLength& length) { return kUnits[static_cast<std::size_t>(length.until)]; }

}  // namespace

Result<TakeLength> checked(const TakeLength& length) {
  const LengthUnit& unit = unitOf(length);
  const double amount = length.amount / unit.unit;
  const bool is_whole = length.until != TakeLength::Until::kSamples || amount == std::floor(amount);
  // A last bit is lost between metres and millimetres.
  constexpr double kRounding = 1e-9;
  if (is_whole && amount >= unit.least * (1.0 - kRounding) && amount <= unit.most * (1.0 + kRounding)) return length;
  return fail(ErrorCode::kBadInput, std::string("A take may be of ") + unit.words + ", got " + shortNumber(amount) +
                                        std::string(unit.symbol));
}

Result<TakeLength> readTakeLength(const std::string& text) {
  double amount = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), amount);
  const std::string_view symbol(end, static_cast<std::size_t>(text.data() + text.size() - end));
  for (std::size_t i = 0; i < kUnits.size() && error == std::errc(); ++i) {
    if (symbol == kUnits[i].symbol) return checked({static_cast<TakeLength::Until>(i), amount * kUnits[i].unit});
  }
  return fail(ErrorCode::kBadInput,
              "'" + text + "' is no length of a take: 60 (samples), 2.5s or 0.05mm (standard error) are");
}

std::string textOf(const TakeLength& length) {
  const LengthUnit& unit = unitOf(length);
  return shortNumber(length.amount / unit.unit) + std::string(unit.symbol);
}

}  // namespace fieldtrue::acquisition
