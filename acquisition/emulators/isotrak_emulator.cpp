#include "acquisition/emulators/isotrak_emulator.h"

#include "acquisition/protocols/command_text.h"

namespace fieldtrue::acquisition {

std::string IsotrakEmulator::statusRecord() const {
  const unsigned flags = (setup_.format == FastrakFormat::kBinary ? 1u : 0u) |
                         (setup_.unit == FastrakUnit::kCentimetre ? 2u : 0u) | (setup_.continuous ? 8u : 0u);
  return encodeIsotrakStatus(1, flags, options_.version);
}

std::string IsotrakEmulator::written(const FastrakRecord& record) const {
  if (setup_.format == FastrakFormat::kAscii) return FastrakEmulatorCore::written(record);
  return encodeIsotrakRecord(record, outputList(record.station));
}

void IsotrakEmulator::setOutputList(const FastrakCommand& command, std::vector<EmulatedOutput>& out) {
  if (command.text.empty()) {
    std::string text;
    for (const int item : outputList(1)) text += (item < 10 ? " " : "") + std::to_string(item);
    return answerReadBack('O', 1, text, out);
  }
  const auto wanted = changedList(outputList(1), splitAtCommas(command.text), command, out);
  if (!wanted) return;
  if (!isotrakRecordBytes(*wanted)) return refuseAsOutOfRange(command, out);
  for (auto& items : setup_.items) items = *wanted;
}

Result<std::unique_ptr<EmulatorRunner>> makeIsotrakEmulator(const Emulation& emulation) {
  return makeEmulator<IsotrakEmulator>(emulation, {"Isotrak II", kIsotrakStations, kIsotrakRate_hz},
                                       IsotrakEmulatorOptions{});
}

}  // namespace fieldtrue::acquisition
