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
  bool wrong_crc = false;
  bool unknown_types = false;
  bool no_stamps = false;
  bool waits_to_be_asked = false;
  bool repeats = false;
  bool stuck = false;
  bool missing = false;
  bool out_of_volume = false;
  bool tool_unplugged = false;
};

/// One row of the fault table.
struct EmulatorFault {
  std::string id;
  std::string help;
  bool needs_count = false;  ///< Written `id=N`.
  void (*set)(EmulatorFaults& faults, std::uint64_t count) = nullptr;
  std::string only_of = {};  ///< Ids of the trackers that have it, with commas; empty = all.

  bool isOf(const std::string& tracker) const;
};
std::span<const EmulatorFault> emulatorFaults();

/// Reads `garbage_at_open,lost_bytes,unplug_after=500`; empty = none.
/// @param tracker the id of its kind, whose faults are known; empty = those of every kind
/// @error kBadInput for an unknown fault (the known ones are listed) or a missing or wrong count
Result<EmulatorFaults> parseFaults(const std::string& list, const std::string& tracker = {});

}  // namespace fieldtrue::acquisition
