#pragma once

#include <string>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// Under this name a session keeps which sensors a person chose to record (SessionStore::state).
inline constexpr const char* kSensorsState = "sensors";

/// Under this name it keeps with which of its own it goes on, once places are taken: another one may be dead.
inline constexpr const char* kGoingOnState = "sensors_going_on";

/// Of a session's sensors, the leading one first, those that are chosen, in their order; the lowest leads where the
/// leading one is not among them. None chosen = all.
std::vector<int> goingOn(std::vector<int> of_session, const std::vector<int>& chosen);
/// What it means that a session goes on with some of its sensors. Both with the leading one first.
std::string goingOnText(const std::vector<int>& of_session, const std::vector<int>& going_on);
bool isAmong(int sensor, const std::vector<int>& others);
/// Whether each of some sensors is one of others.
bool areAmong(const std::vector<int>& some, const std::vector<int>& others);

/// "1", or "0+2" of which the first leads; "all" and nothing at all are every sensor that reports: empty.
/// @error kBadInput: what it may be
Result<std::vector<int>> readSensors(const std::string& text);
/// As readSensors reads it.
std::string textOf(const std::vector<int>& sensors);

}  // namespace fieldtrue::acquisition
