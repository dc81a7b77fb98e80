#include "acquisition/devices/polhemus_settings.h"

#include <map>

#include "calib/core/declare.h"

namespace fieldtrue::acquisition {

std::vector<Setting> polhemusSettings(int most_stations) {
  return {
      stationsSetting(most_stations),
      hemisphereSetting(),
      declare::choice(
          "filter", "Filter", {"off", "low", "medium", "heavy"}, "off",
          "The tracker's own smoothing; off for a calibration, because smoothed readings are not independent."),
      declare::flag("raw_frame", "Raw frame", true,
                    "Reset alignment and boresight, so that poses are in the transmitter's own frame."),
      declare::flag("may_reset", "May re-initialise", true,
                    "Restart the tracker (about 12 s) when it does not answer."),
  };
}

const std::vector<int>& polhemusRates() {
  static const std::vector<int> kRates = {115200, 57600, 38400, 19200, 9600, 4800, 2400};
  return kRates;
}

std::array<double, 4> polhemusFilter(const std::string& name) {
  static const std::map<std::string, std::array<double, 4>> kFilters = {{"off", {0.0, 1.0, 0.0, 0.0}},
                                                                        {"low", {0.2, 0.2, 0.8, 0.8}},
                                                                        {"medium", {0.2, 0.2, 0.8, 0.95}},
                                                                        {"heavy", {0.05, 0.05, 0.8, 0.98}}};
  return kFilters.at(name);
}

}  // namespace fieldtrue::acquisition
