#pragma once

#include <string>

#include "acquisition/devices/tracker_device.h"

namespace fieldtrue::cli {

/// Why a trace cannot be written where it is to be, or would not fit there; empty where it can.
std::string noPlaceFor(const std::string& trace);
/// Why the trace that is asked for cannot be written; said before a day's recording, not after it. Empty where it can,
/// or none is asked for.
/// @param address of the device, as it was typed
std::string noTraceOf(const acquisition::TrackerDevice& device, const std::string& address, const std::string& trace);

}  // namespace fieldtrue::cli
