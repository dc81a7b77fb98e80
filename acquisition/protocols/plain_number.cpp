#include "acquisition/protocols/plain_number.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>

namespace fieldtrue::acquisition {
namespace {

std::string written(double value, std::chars_format format, int decimals) {
  std::array<char, 400> text{};  // Room for the largest double in fixed form.
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value, format, decimals);
  return error == std::errc() ? std::string(text.data(), end) : std::string("nan");
}

}  // namespace

std::string fixedText(double value, int decimals, int width) {
  std::string text = written(value, std::chars_format::fixed, decimals);
  const auto wanted = static_cast<std::size_t>(std::max(0, width));
  if (text.size() < wanted) text.insert(0, wanted - text.size(), ' ');
  return text;
}

std::string exponentText(double value, int decimals) {
  std::string text = written(value, std::chars_format::scientific, decimals);
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::toupper(letter)); });
  return text.starts_with('-') ? text : " " + text;
}

}  // namespace fieldtrue::acquisition
