#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// What the parser of a tracker's stream is made from, as text: kept beside the bytes of a line, so that they can be
/// read again without the tracker.
using StreamSettings = std::map<std::string, std::string>;

/// @error kBadInput where the key is missing; the other readers also where its text is something else
Result<std::string> streamText(const StreamSettings& settings, const std::string& key);
Result<double> streamNumber(const StreamSettings& settings, const std::string& key);
Result<bool> streamFlag(const StreamSettings& settings, const std::string& key);
/// Stations, counted from 1: "1+3". @param most the tracker can have
Result<std::vector<int>> streamStations(const StreamSettings& settings, int most);
/// Sensors by what the tracker calls them: "10=0+11=-1".
Result<std::map<int, int>> streamSensors(const StreamSettings& settings);
std::string sensorsText(const std::map<int, int>& sensors);

}  // namespace fieldtrue::acquisition
