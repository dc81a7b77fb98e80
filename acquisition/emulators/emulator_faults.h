#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// What an emulated tracker does wrong on purpose, to exercise a driver.
struct EmulatorFaults {
  bool garbage_at_open = false;
  bool lost_bytes = false;
  bool split_writes = false;
  bool error_status = false;
  bool hemisphere_flip = false;
  bool wrong_baud = false;
  std::uint64_t unplug_after = 0;  ///< Records; 0 = never.
  bool silence = false;
  bool already_streaming = false;
  bool slow_reply = false;
  bool outliers = false;
};

/// One row of the fault table.
struct EmulatorFault {
  std::string id;
  std::string help;
  bool needs_count = false;  ///< Written `id=N`.
  void (*set)(EmulatorFaults& faults, std::uint64_t count) = nullptr;
};
std::span<const EmulatorFault> emulatorFaults();

/// Reads `garbage_at_open,lost_bytes,unplug_after=500`; empty = none.
/// @error kBadInput for an unknown fault (the known ones are listed) or a missing or wrong count
Result<EmulatorFaults> parseFaults(const std::string& list);

}  // namespace fieldtrue::acquisition
