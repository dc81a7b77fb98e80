#include "calib/core/nearest_name.h"

#include <algorithm>
#include <numeric>

namespace fieldtrue {

namespace {

/// A name without its unit is one slip, however long the unit.
std::size_t slips(std::string_view name, std::string_view known) {
  const bool lacks_its_end = !name.empty() && known.starts_with(name);
  return lacks_its_end ? std::min<std::size_t>(1, known.size() - name.size()) : editDistance(name, known);
}

}  // namespace

std::size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row[b.size()];
}

std::string nearestName(std::string_view name, const std::vector<std::string>& known) {
  const auto nearest = std::min_element(known.begin(), known.end(), [&](const std::string& a, const std::string& b) {
    return slips(name, a) < slips(name, b);
  });
  return nearest == known.end() ? std::string() : *nearest;
}

std::string unknownName(std::string_view name, const std::vector<std::string>& known) {
  std::string text(name);
  text += " is not known";
  if (known.empty()) return text + "; nothing is expected here.";
  text += "; did you mean " + nearestName(name, known) + "? Known:";
  for (std::size_t i = 0; i < known.size(); ++i) text += (i == 0 ? " " : ", ") + known[i];
  return text + ".";
}

}  // namespace fieldtrue
