#include "acquisition/emulators/emulator_faults.h"

#include <algorithm>
#include <charconv>
#include <vector>

namespace fieldtrue::acquisition {

std::span<const EmulatorFault> emulatorFaults() {
  static const std::vector<EmulatorFault> kFaults = {
      {"garbage_at_open", "200 random bytes before the first answer", false,
       [](EmulatorFaults& f, std::uint64_t) { f.garbage_at_open = true; }},
      {"lost_bytes", "one byte in 400 is lost on the line", false,
       [](EmulatorFaults& f, std::uint64_t) { f.lost_bytes = true; }},
      {"split_writes", "every answer and record comes in pieces of 1 to 7 bytes", false,
       [](EmulatorFaults& f, std::uint64_t) { f.split_writes = true; }},
      {"error_status", "for one second in four the records carry error k (signal too low) and a wrong position", false,
       [](EmulatorFaults& f, std::uint64_t) { f.error_status = true; }},
      {"hemisphere_flip", "for one second in four positions are mirrored through the transmitter", false,
       [](EmulatorFaults& f, std::uint64_t) { f.hemisphere_flip = true; }},
      {"wrong_baud", "answers with 0xFF noise, as a line at the wrong rate does", false,
       [](EmulatorFaults& f, std::uint64_t) { f.wrong_baud = true; }},
      {"unplug_after", "the line is pulled after N records", true,
       [](EmulatorFaults& f, std::uint64_t n) { f.unplug_after = n; }},
      {"silence", "never answers", false, [](EmulatorFaults& f, std::uint64_t) { f.silence = true; }},
      {"already_streaming", "streams from the start, before anybody asks", false,
       [](EmulatorFaults& f, std::uint64_t) { f.already_streaming = true; }},
      {"slow_reply", "every answer comes 0.6 s late", false,
       [](EmulatorFaults& f, std::uint64_t) { f.slow_reply = true; }},
      {"outliers", "one record in a hundred is 0.1 to 0.3 m off", false,
       [](EmulatorFaults& f, std::uint64_t) { f.outliers = true; }},
      {"wrong_crc", "one message in ten has a CRC that does not fit", false,
       [](EmulatorFaults& f, std::uint64_t) { f.wrong_crc = true; }, "openigtlink,ndi"},
      {"unknown_types", "images and messages of an unknown type come between the poses", false,
       [](EmulatorFaults& f, std::uint64_t) { f.unknown_types = true; }, "openigtlink"},
      {"no_stamps", "messages carry no time", false, [](EmulatorFaults& f, std::uint64_t) { f.no_stamps = true; },
       "openigtlink"},
      {"waits_to_be_asked", "sends nothing until it is asked to", false,
       [](EmulatorFaults& f, std::uint64_t) { f.waits_to_be_asked = true; }, "openigtlink"},
      {"repeats", "every record is sent twice", false, [](EmulatorFaults& f, std::uint64_t) { f.repeats = true; },
       "flock"},
      {"stuck", "after three seconds the stream repeats one record for ever", false,
       [](EmulatorFaults& f, std::uint64_t) { f.stuck = true; }, "flock"},
      {"missing", "for one second in four the tools are MISSING", false,
       [](EmulatorFaults& f, std::uint64_t) { f.missing = true; }, "ndi"},
      {"out_of_volume", "for one second in four the tools are out of the measuring volume, and their poses wrong",
       false, [](EmulatorFaults& f, std::uint64_t) { f.out_of_volume = true; }, "ndi"},
      {"tool_unplugged", "the last tool is unplugged after three seconds of tracking", false,
       [](EmulatorFaults& f, std::uint64_t) { f.tool_unplugged = true; }, "ndi"},
  };
  return kFaults;
}

bool EmulatorFault::isOf(const std::string& tracker) const {
  return only_of.empty() || tracker.empty() || ("," + only_of + ",").find("," + tracker + ",") != std::string::npos;
}

namespace {

std::string knownFaults(const std::string& tracker) {
  std::string names;
  for (const auto& fault : emulatorFaults()) {
    if (!fault.isOf(tracker)) continue;
    names += (names.empty() ? "" : ", ") + fault.id + (fault.needs_count ? "=N" : "");
  }
  return names;
}

Result<void> applyFault(const std::string& text, const std::string& tracker, EmulatorFaults& faults) {
  const std::size_t equals = text.find('=');
  const std::string id = text.substr(0, equals);
  const auto rows = emulatorFaults();
  const auto row =
      std::find_if(rows.begin(), rows.end(), [&](const auto& fault) { return fault.id == id && fault.isOf(tracker); });
  if (row == rows.end()) {
    return fail(ErrorCode::kBadInput, "\"" + id + "\" is not a fault; known are " + knownFaults(tracker));
  }
  std::uint64_t count = 0;
  if (row->needs_count) {
    const std::string number = equals == std::string::npos ? "" : text.substr(equals + 1);
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), count);
    if (number.empty() || error != std::errc() || end != number.data() + number.size() || count == 0) {
      return fail(ErrorCode::kBadInput, "Fault " + id + " needs a count of at least 1: " + id + "=500");
    }
  } else if (equals != std::string::npos) {
    return fail(ErrorCode::kBadInput, "Fault " + id + " takes no value, got \"" + text.substr(equals + 1) + "\"");
  }
  row->set(faults, count);
  return {};
}

}  // namespace

Result<EmulatorFaults> parseFaults(const std::string& list, const std::string& tracker) {
  EmulatorFaults faults;
  for (std::size_t start = 0; start < list.size();) {
    const std::size_t comma = std::min(list.find(',', start), list.size());
    FT_TRY_VOID(applyFault(list.substr(start, comma - start), tracker, faults));
    start = comma + 1;
  }
  return faults;
}

}  // namespace fieldtrue::acquisition
