#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue {

/// One fact about a set-up. Another transmitter, sensor, filter or room has another field error: where a fact that
/// identifies differs, a calibration is somebody else's.
struct SetupFact {
  std::string_view file_key;  ///< In the metadata of tables: `setup.room`.
  std::string_view key;       ///< `room`.
  std::string_view label;     ///< For people.
  bool identifies = true;
  bool is_asked = false;  ///< No tracker tells it: a person does.
};

/// Every fact, in the order of the files.
std::span<const SetupFact> setupFacts();

/// What is stated of a set-up: values by key, never empty; what is not stated is not there.
using Setup = std::map<std::string, std::string>;

inline constexpr std::string_view kSetupPrefix = "setup.";  ///< Of the keys in a table's metadata.

/// States a fact; an empty value, or "unknown", takes it back. @error kBadInput for a key that is not a fact's
Result<void> state(Setup& setup, std::string_view key, std::string_view value);

/// The fact's value, none where it is not stated.
std::optional<std::string> factOf(const Setup& setup, std::string_view key);

enum class SetupMatch { kYes, kNo, kUnknown };
/// As files name it: yes, no, unknown.
std::string_view nameOf(SetupMatch match);

/// Facts stated on both sides with different values, in the order of the facts; letters large or small are the same.
std::vector<SetupFact> differences(const Setup& one, const Setup& other);

/// Whether readings are of the set-up that was calibrated: no where an identifying fact differs, yes where every one
/// that the calibration states is stated of the readings, and at least one beside the sensor's number; otherwise nobody
/// can tell.
SetupMatch match(const Setup& calibrated, const Setup& readings);

/// "room 'Lab 2' instead of 'Lab 1'; filter 'off' instead of 'on'"; empty where nothing differs.
std::string differenceText(const Setup& calibrated, const Setup& readings);

/// "room Lab 2, tracker fastrak", in the order of the facts; empty where nothing is stated.
std::string setupText(const Setup& setup);

}  // namespace fieldtrue
