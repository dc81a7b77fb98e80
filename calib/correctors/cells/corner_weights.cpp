#include "calib/correctors/cells/corner_weights.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/core/declare.h"
#include "calib/core/json_reader.h"

namespace fieldtrue::correctors {
namespace {

constexpr double kAtCorner_m = 1e-9;
/// A sum of weights this small is rounding: eq. 11 in the centre of a cube.
constexpr double kNoWeight = 1e-9;

using Weights = std::array<double, 8>;

struct KindName {
  WeightKind kind;
  const char* name;
};
constexpr std::array<KindName, 7> kKindNames = {{{WeightKind::kBrysonLinear, "bryson_linear"},
                                                 {WeightKind::kBrysonBump, "bryson_bump"},
                                                 {WeightKind::kKindratenkoLinear, "linear"},
                                                 {WeightKind::kKindratenkoSquares, "quadratic"},
                                                 {WeightKind::kKindratenkoLog, "log"},
                                                 {WeightKind::kBriggs, "briggs"},
                                                 {WeightKind::kBriggsAsPublished, "briggs_as_published"}}};

const KindName* findKind(const std::string& name) {
  for (const KindName& row : kKindNames)
    if (row.name == name) return &row;
  return nullptr;
}

std::size_t nearestCorner(const Weights& d_m) {
  return static_cast<std::size_t>(std::min_element(d_m.begin(), d_m.end()) - d_m.begin());
}

Weights allTo(std::size_t corner) {
  Weights weights{};
  weights[corner] = 1.0;
  return weights;
}

/// Equation (9).
Weights normalised(const Weights& r) {
  double sum = 0.0;
  for (const double value : r) sum += value;
  Weights weights{};
  for (std::size_t i = 0; i < 8; ++i) weights[i] = sum > kNoWeight ? r[i] / sum : 0.125;
  return weights;
}

/// Equation (10), left: at a corner every product but its own has a factor 0.
Weights brysonLinear(const Weights& d_m) {
  // Distances in units of the largest, so that the products stay near 1 in cells of any size.
  const double unit_m = *std::max_element(d_m.begin(), d_m.end());
  Weights r{};
  for (std::size_t i = 0; i < 8; ++i) {
    r[i] = 1.0;
    for (std::size_t j = 0; j < 8; ++j)
      if (j != i) r[i] *= d_m[j] / unit_m;
  }
  double sum = 0.0;
  for (const double value : r) sum += value;
  // Small products are no rounding here: near a corner the sum is small and its parts are exact.
  for (double& value : r) value = sum > 0.0 ? value / sum : 0.125;
  return r;
}

/// Equation (10), right.
Weights brysonBump(const WeightRule& rule, const CellLengths& lengths, const Weights& d_m) {
  const double d_max_m = rule.d_max_m.value_or(lengths.smallest_distance_m);
  const double nearest_m = *std::min_element(d_m.begin(), d_m.end());
  Weights r{};
  // Divided by the largest of the weights, which leaves eq. 9 as it is and small units from underflowing.
  for (std::size_t i = 0; i < 8; ++i)
    r[i] = d_m[i] < d_max_m ? std::exp(-(d_m[i] - nearest_m) / rule.length_unit_m) : 0.0;
  return normalised(r);
}

/// Equation (11).
Weights kindratenko(WeightKind kind, const CellLengths& lengths, const Weights& d_m) {
  const std::size_t nearest = nearestCorner(d_m);
  if (d_m[nearest] < kAtCorner_m) return allTo(nearest);
  const double d_max_m = 0.5 * lengths.longest_diagonal_m;
  Weights r{};
  for (std::size_t i = 0; i < 8; ++i) {
    const double share = d_m[i] / d_max_m;
    if (!(share < 1.0)) continue;
    r[i] = kind == WeightKind::kKindratenkoLinear    ? 1.0 - share
           : kind == WeightKind::kKindratenkoSquares ? 1.0 - share * share
                                                     : -std::log(share);
  }
  return normalised(r);
}

/// Equation (13).
Weights briggs(bool as_published, const Weights& d_m) {
  const std::size_t nearest = nearestCorner(d_m);
  if (d_m[nearest] < kAtCorner_m) return allTo(nearest);
  Weights r{};
  double sum_r = 0.0;
  double sum_squares_m2 = 0.0;
  for (std::size_t i = 0; i < 8; ++i) {
    r[i] = 1.0 / (d_m[i] * d_m[i]);
    sum_r += r[i];
    sum_squares_m2 += d_m[i] * d_m[i];
  }
  for (double& value : r) value *= as_published ? sum_squares_m2 : 1.0 / sum_r;
  return r;
}

}  // namespace

CellLengths cellLengths(const HexahedralCells& cells, std::size_t cell) {
  CellLengths lengths{std::numeric_limits<double>::infinity(), 0.0};
  for (std::size_t a = 0; a < 8; ++a)
    for (std::size_t b = a + 1; b < 8; ++b) {
      const double distance_m = (cells.corner_m(cell, a) - cells.corner_m(cell, b)).norm();
      lengths.smallest_distance_m = std::min(lengths.smallest_distance_m, distance_m);
      if (a + b == 7) lengths.longest_diagonal_m = std::max(lengths.longest_diagonal_m, distance_m);
    }
  return lengths;
}

std::array<double, 8> cornerWeights(const WeightRule& rule, const CellLengths& lengths,
                                    const std::array<double, 8>& d_m) {
  switch (rule.kind) {
    case WeightKind::kBrysonLinear:
      return brysonLinear(d_m);
    case WeightKind::kBrysonBump:
      return brysonBump(rule, lengths, d_m);
    case WeightKind::kKindratenkoLinear:
    case WeightKind::kKindratenkoSquares:
    case WeightKind::kKindratenkoLog:
      return kindratenko(rule.kind, lengths, d_m);
    case WeightKind::kBriggs:
    case WeightKind::kBriggsAsPublished:
      break;
  }
  return briggs(rule.kind == WeightKind::kBriggsAsPublished, d_m);
}

Setting lengthUnitSetting() {
  return declare::number("length_unit_m", "Length unit of e^-d", {0.001, 10.0, "m"}, 0.3048,
                         "Unit of d in Bryson's bump, who states none; the default is the foot at which he measured.");
}

Setting bumpEndSetting() {
  return declare::autoNumber("d_max_m", "End of the bump", {0.001, 10.0, "m"}, "auto",
                             "Distance at which a corner's weight in Bryson's bump ends; auto is the smallest distance "
                             "between two corners of the cell, the largest he allows.");
}

WeightKind weightKind(const std::string& name) {
  const KindName* const found = findKind(name);
  FT_CHECK(found != nullptr);
  return found->kind;
}

WeightRule weightRule(WeightKind kind, const Settings& settings) {
  WeightRule rule;
  rule.kind = kind;
  if (settings.contains("length_unit_m")) rule.length_unit_m = numberSetting(settings, "length_unit_m");
  const auto d_max = settings.find("d_max_m");
  if (d_max != settings.end() && std::holds_alternative<double>(d_max->second))
    rule.d_max_m = std::get<double>(d_max->second);
  return rule;
}

nlohmann::json toJson(const WeightRule& rule) {
  const auto found =
      std::find_if(kKindNames.begin(), kKindNames.end(), [&](const KindName& row) { return row.kind == rule.kind; });
  return {{"weights", found->name},
          {"length_unit_m", rule.length_unit_m},
          {"d_max_m", rule.d_max_m ? nlohmann::json(*rule.d_max_m) : nlohmann::json("auto")}};
}

WeightRule weightRuleFrom(const JsonReader& json) {
  const std::string name = json["weights"].text();
  const KindName* const found = findKind(name);
  if (found == nullptr) json["weights"].refuse("the name of a weight of corners");
  WeightRule rule;
  rule.kind = found->kind;
  rule.length_unit_m = json["length_unit_m"].number();
  if (!(rule.length_unit_m > 0.0)) json["length_unit_m"].refuse("above 0");
  if (const JsonReader d_max = json["d_max_m"]; d_max.raw() != "auto") {
    rule.d_max_m = d_max.number();
    if (!(*rule.d_max_m > 0.0)) d_max.refuse("auto or a length above 0");
  }
  return rule;
}

std::string bumpNote(const WeightRule& rule, const HexahedralCells& cells) {
  if (rule.kind != WeightKind::kBrysonBump || !rule.d_max_m) return {};
  std::size_t n_past = 0;
  for (std::size_t cell = 0; cell < cells.size(); ++cell)
    n_past += cellLengths(cells, cell).smallest_distance_m < *rule.d_max_m ? 1U : 0U;
  if (n_past == 0) return {};
  return "The bump reaches past the nearest corner in " + std::to_string(n_past) + " of " +
         std::to_string(cells.size()) + " cells: there the correction misses the measured places.";
}

}  // namespace fieldtrue::correctors
