#pragma once

#include <array>
#include <string>
#include <vector>

#include "acquisition/devices/line_address.h"
#include "calib/core/settings.h"

namespace fieldtrue::acquisition {

/// What every Polhemus lets one choose: stations, hemisphere, filter, raw frame, restart.
std::vector<Setting> polhemusSettings(int most_stations);

/// Takes over the settings of polhemusSettings. @error kBadInput for stations that are none
template <class Setup>
Result<void> applyPolhemusSettings(const Settings& settings, int most_stations, Setup& setup) {
  FT_TRY(setup.stations, readStations(settings, setup.id, most_stations));
  setup.hemisphere = choiceSetting(settings, "hemisphere");
  setup.filter = choiceSetting(settings, "filter");
  setup.raw_frame = boolSetting(settings, "raw_frame");
  setup.may_reset = boolSetting(settings, "may_reset");
  return {};
}

/// Rates of their serial lines [baud], the most usual first.
const std::vector<int>& polhemusRates();

/// Sensitivity, low and high bound and factor of a filter by its name: the maker's macros; 0, 1, 0, 0 is off.
std::array<double, 4> polhemusFilter(const std::string& name);

}  // namespace fieldtrue::acquisition
