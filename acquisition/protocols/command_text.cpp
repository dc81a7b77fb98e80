#include "acquisition/protocols/command_text.h"

#include <algorithm>
#include <charconv>

#include "acquisition/protocols/plain_number.h"
#include "calib/core/trimmed.h"

namespace fieldtrue::acquisition {

std::string commandNumber(double value) {
  std::string result = fixedText(value, 4);
  result.erase(result.find_last_not_of('0') + 1);
  if (result.back() == '.') result.pop_back();
  return result == "-0" ? "0" : result;
}

std::vector<std::string> commandNumbers(std::initializer_list<Eigen::Vector3d> vectors) {
  std::vector<std::string> fields;
  for (const auto& v : vectors) {
    for (const double x : v) fields.push_back(commandNumber(x));
  }
  return fields;
}

std::string joinedByCommas(const std::vector<std::string>& fields) {
  std::string out;
  for (std::size_t i = 0; i < fields.size(); ++i) out += (i > 0 ? "," : "") + fields[i];
  return out;
}

std::vector<std::string> splitAtCommas(std::string_view text) {
  std::vector<std::string> fields;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t comma = std::min(text.find(',', start), text.size());
    fields.emplace_back(trimmed(text.substr(start, comma - start)));
    start = comma + 1;
  }
  return fields;
}

std::optional<double> fieldNumber(const std::string& text) {
  double value = 0.0;
  const char* first = text.data() + (text.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(first, text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace fieldtrue::acquisition
