#include "acquisition/plan/plan_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

#include "calib/core/file_io.h"
#include "calib/core/json_text.h"

namespace fieldtrue::acquisition {

namespace {

constexpr double kMinPitch_m = 1e-4;

/// A piece of the plan's text and what stands before it in messages.
struct Part {
  std::string_view text;
  std::string_view whole;

  tl::unexpected<Error> expected(const std::string& what) const {
    const auto position = static_cast<std::size_t>(text.data() - whole.data()) + 1;
    const std::string seen = text.empty() ? "nothing" : std::string(text);
    return fail(ErrorCode::kBadInput, std::string(whole) + ": expected " + what + ", got " + seen + " (at character " +
                                          std::to_string(position) + ")");
  }

  std::vector<Part> split(char separator) const {
    std::vector<Part> parts;
    std::size_t begin = 0;
    for (std::size_t end; (end = text.find(separator, begin)) != std::string_view::npos; begin = end + 1) {
      parts.push_back({text.substr(begin, end - begin), whole});
    }
    parts.push_back({text.substr(begin), whole});
    return parts;
  }
};

std::optional<double> parseCoordinate_m(std::string_view text) {
  const std::optional<double> value = parseNumber<double>(text);
  return value && std::abs(*value) <= kMaxCoordinate_m ? value : std::nullopt;
}

Result<void> readCounts(const Part& part, Plan& plan) {
  const std::vector<Part> counts = part.split('x');
  if (counts.size() != 3) return part.expected("NXxNYxNZ");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::optional<int> count = parseNumber<int>(counts[axis].text);
    if (!count || *count < 1 || *count > kMaxPlaces) {
      return counts[axis].expected("a count from 1 to " + std::to_string(kMaxPlaces));
    }
    plan.counts[axis] = *count;
  }
  return {};
}

Result<void> readPitch(const Part& part, Plan& plan) {
  const std::vector<Part> pitches = part.split('x');
  if (pitches.size() != 1 && pitches.size() != 3) return part.expected("PX or PXxPYxPZ in metres");
  for (int axis = 0; axis < 3; ++axis) {
    const Part& pitch = pitches.size() == 1 ? pitches[0] : pitches[static_cast<std::size_t>(axis)];
    const std::optional<double> value = parseCoordinate_m(pitch.text);
    if (!value || !(*value >= kMinPitch_m)) return pitch.expected("a pitch from 0.0001 to 1000 m");
    plan.pitch_m[axis] = *value;
  }
  return {};
}

Result<void> readGrid(const Part& part, Plan& plan) {
  const std::vector<Part> halves = part.split('@');
  if (halves.size() != 2) return part.expected("NXxNYxNZ@PX or NXxNYxNZ@PXxPYxPZ");
  if (auto counts = readCounts(halves[0], plan); !counts) return counts;
  return readPitch(halves[1], plan);
}

Result<void> readOrigin(const Part& value, Plan& plan) {
  const std::vector<Part> parts = value.split(',');
  if (parts.size() != 3) return value.expected("x,y,z in metres after origin=");
  Eigen::Vector3d origin;
  for (int axis = 0; axis < 3; ++axis) {
    const Part& part = parts[static_cast<std::size_t>(axis)];
    const std::optional<double> coordinate = parseCoordinate_m(part.text);
    if (!coordinate) return part.expected("a coordinate in metres");
    origin[axis] = *coordinate;
  }
  plan.origin_m = origin;
  return {};
}

Result<void> readOrder(const Part& value, Plan& plan) {
  if (value.text != "serpentine" && value.text != "random") return value.expected("order serpentine or random");
  plan.order = value.text == "random" ? PlanOrder::kRandom : PlanOrder::kSerpentine;
  return {};
}

Result<void> readSeed(const Part& value, Plan& plan) {
  const auto seed = parseNumber<std::uint64_t>(value.text);
  if (!seed) return value.expected("seed as a whole number from 0");
  plan.seed = *seed;
  return {};
}

Result<void> readOrientations(const Part& value, Plan& plan) {
  const auto count = parseNumber<int>(value.text);
  if (!count || *count < 1 || *count > kMaxOrientations) {
    return value.expected("orientations from 1 to " + std::to_string(kMaxOrientations));
  }
  plan.orientations = *count;
  return {};
}

Result<void> readReseat(const Part& value, Plan& plan) {
  const auto count = parseNumber<int>(value.text);
  if (!count || *count < 1 || *count > 1000) return value.expected("reseat from 1 to 1000");
  plan.reseat = *count;
  return {};
}

struct Option {
  std::string_view key;
  Result<void> (*read)(const Part& value, Plan& plan);
};
constexpr std::array<Option, 5> kOptions{{{"origin", readOrigin},
                                          {"order", readOrder},
                                          {"seed", readSeed},
                                          {"orientations", readOrientations},
                                          {"reseat", readReseat}}};

Result<Plan> planFromText(const std::string& text) {
  Plan plan;
  std::vector<Part> parts = Part{text, text}.split(':');
  parts.erase(parts.begin());
  FT_TRY_VOID(readGrid(parts[0], plan));
  std::set<std::string_view> given;
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const std::size_t equals = parts[i].text.find('=');
    const std::string_view key = parts[i].text.substr(0, equals);
    const auto option = std::find_if(kOptions.begin(), kOptions.end(), [&](const Option& o) { return o.key == key; });
    if (equals == std::string_view::npos || option == kOptions.end()) {
      return parts[i].expected("origin=, order=, seed=, orientations= or reseat=");
    }
    if (!given.insert(key).second) return parts[i].expected(std::string(key) + "= only once");
    const Part value{parts[i].text.substr(equals + 1), text};
    FT_TRY_VOID(option->read(value, plan));
  }
  FT_TRY_VOID(checkPlanSize(plan, text));
  return plan;
}

}  // namespace

std::int64_t stopsOf(const Plan& plan) {
  std::int64_t stops = plan.explicit_places.empty() ? static_cast<std::int64_t>(plan.counts[0]) * plan.counts[1]
                                                    : static_cast<std::int64_t>(plan.explicit_places.size());
  // Counts are at most 1e5 each, so the first product cannot overflow; the others are stopped at the limit.
  const std::int64_t levels = plan.explicit_places.empty() ? plan.counts[2] : 1;
  for (const std::int64_t factor : {levels, static_cast<std::int64_t>(plan.orientations), std::int64_t{plan.reseat}}) {
    if (stops <= kMaxPlaces) stops *= factor;
  }
  return stops;
}

Result<void> checkPlanSize(const Plan& plan, const std::string& name) {
  if (stopsOf(plan) > kMaxPlaces) {
    return fail(ErrorCode::kBadInput,
                name + ": more than " + std::to_string(kMaxPlaces) + " stops; use a wider pitch or fewer visits");
  }
  return {};
}

Result<void> readGridText(std::string_view text, Plan& plan) { return readGrid({text, text}, plan); }

Result<Plan> readPlan(const std::string& text_or_path) {
  if (text_or_path.starts_with("grid:")) return planFromText(text_or_path);
  if (!text_or_path.ends_with(".json")) {
    return fail(ErrorCode::kBadInput, text_or_path + ": expected grid:NXxNYxNZ@PX... or the path of a *.plan.json");
  }
  FT_TRY(const std::string content, readFile(text_or_path));
  FT_TRY(const nlohmann::json object, parseJson(content, text_or_path));
  return planFromJson(object, text_or_path);
}

}  // namespace fieldtrue::acquisition
