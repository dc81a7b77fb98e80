#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "acquisition/devices/tracker_startup.h"
#include "calib/core/settings.h"

namespace fieldtrue::acquisition {

/// Settings as written, `key=value,key=value`, with the defaults filled in. @error kBadInput
Result<Settings> readDeviceSettings(const std::string& owner, const std::vector<Setting>& declared,
                                    const std::string& text);

/// The address of a tracker on a line, read: `PATH@BAUD[,setting=value]` or `tcp:HOST:PORT[,setting=value]`.
struct LineAddress {
  std::string line;  ///< What makeTransport reads.
  Settings settings;
};

/// @param setup gets the line's facts; its baud is the one meant where none is written
/// @error kBadInput for a line or a setting that cannot be read
Result<LineAddress> readLineAddress(const std::string& address, const std::vector<Setting>& declared, LineSetup& setup);

/// The setting `stations`: which of a tracker's receivers to read.
Setting stationsSetting(int most);
/// `auto` (an empty list: all that are plugged in), or `1+3`; where there are at most nine, `13` is the same.
/// @return ascending
/// @error kBadInput naming what was seen
Result<std::vector<int>> readStations(const Settings& settings, const std::string& owner, int most);
/// `1+3`.
std::string stationsText(const std::vector<int>& stations);
/// Those of the stations that are plugged in which are wanted; an empty list wants all.
std::vector<int> wantedStations(const std::vector<int>& wanted, unsigned plugged);

/// The setting `hemisphere`: the side of the transmitter on which the sensor is.
Setting hemisphereSetting();
/// "+x" to "-z" as a vector; zero for "tracked".
Eigen::Vector3d hemisphereVector(const std::string& name);

}  // namespace fieldtrue::acquisition
