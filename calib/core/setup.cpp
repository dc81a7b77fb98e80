#include "calib/core/setup.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "calib/core/trimmed.h"

namespace fieldtrue {

namespace {

constexpr std::array<SetupFact, 10> kFacts{{
    {"setup.tracker_kind", "tracker_kind", "tracker"},
    {"setup.tracker_serial", "tracker_serial", "serial number of the tracker", true, true},
    {"setup.transmitter_serial", "transmitter_serial", "serial number of the transmitter", true, true},
    {"setup.sensor", "sensor", "sensor"},
    {"setup.sensor_serial", "sensor_serial", "serial number of the sensor", true, true},
    {"setup.filter", "filter", "filter"},
    {"setup.units", "units", "units"},
    {"setup.factory_compensation", "factory_compensation", "factory compensation"},
    {"setup.room", "room", "room", true, true},
    {"setup.date", "date", "date", false},
}};

constexpr std::string_view kBlank = " \t";

const SetupFact* findFact(std::string_view key) {
  const auto found = std::find_if(kFacts.begin(), kFacts.end(), [&](const SetupFact& fact) { return fact.key == key; });
  return found == kFacts.end() ? nullptr : &*found;
}

/// Letters large or small are the same.
bool isSame(std::string_view a, std::string_view b) {
  const auto small = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return small(x) == small(y); });
}

}  // namespace

std::span<const SetupFact> setupFacts() { return kFacts; }

Result<void> state(Setup& setup, std::string_view key, std::string_view value) {
  if (!findFact(key)) {
    std::string known;
    for (const SetupFact& fact : kFacts) known += (known.empty() ? "" : ", ") + std::string(fact.key);
    return fail(ErrorCode::kBadInput, "A set-up has no '" + std::string(key) + "'; it has: " + known);
  }
  const std::string_view stated = trimmed(value, kBlank);
  if (stated.empty() || isSame(stated, "unknown"))
    setup.erase(std::string(key));
  else
    setup[std::string(key)] = stated;
  return {};
}

std::optional<std::string> factOf(const Setup& setup, std::string_view key) {
  const auto found = setup.find(std::string(key));
  if (found == setup.end()) return std::nullopt;
  return found->second;
}

std::string_view nameOf(SetupMatch match) {
  switch (match) {
    case SetupMatch::kYes:
      return "yes";
    case SetupMatch::kNo:
      return "no";
    case SetupMatch::kUnknown:
      break;
  }
  return "unknown";
}

std::vector<SetupFact> differences(const Setup& one, const Setup& other) {
  std::vector<SetupFact> different;
  for (const SetupFact& fact : kFacts) {
    const auto a = factOf(one, fact.key), b = factOf(other, fact.key);
    if (a && b && !isSame(*a, *b)) different.push_back(fact);
  }
  return different;
}

/// Every tracker has a sensor of that number: alone it tells nothing.
constexpr std::string_view kSensorNumber = "sensor";

SetupMatch match(const Setup& calibrated, const Setup& readings) {
  bool any = false, all = true;
  for (const SetupFact& fact : kFacts) {
    const auto known = factOf(calibrated, fact.key);
    if (!fact.identifies || !known) continue;
    const auto given = factOf(readings, fact.key);
    if (given && !isSame(*known, *given)) return SetupMatch::kNo;
    any = any || (given && fact.key != kSensorNumber);
    all = all && given;
  }
  return any && all ? SetupMatch::kYes : SetupMatch::kUnknown;
}

std::string differenceText(const Setup& calibrated, const Setup& readings) {
  std::string text;
  for (const SetupFact& fact : differences(calibrated, readings)) {
    if (!fact.identifies) continue;
    text += (text.empty() ? "" : "; ") + std::string(fact.label) + " '" + *factOf(readings, fact.key) +
            "' instead of '" + *factOf(calibrated, fact.key) + "'";
  }
  return text;
}

std::string setupText(const Setup& setup) {
  std::string text;
  for (const SetupFact& fact : kFacts)
    if (const auto value = factOf(setup, fact.key))
      text += (text.empty() ? "" : ", ") + std::string(fact.label) + " " + *value;
  return text;
}

}  // namespace fieldtrue
