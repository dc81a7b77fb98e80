#pragma once

#include <memory>
#include <string>
#include <vector>

#include "acquisition/emulators/fastrak_emulator_core.h"
#include "acquisition/protocols/isotrak.h"

namespace fieldtrue::acquisition {

struct IsotrakEmulatorOptions : FastrakEmulatorOptions {
  IsotrakEmulatorOptions() {
    version = "1.10";
    identity.clear();
    stations = kIsotrakStations;
    letters_it_lacks = "DdXo";
  }
};

/// An Isotrak II without its line: a Fastrak's commands and their effects, with one output list for both stations, its
/// own status record, and packed binary records.
class IsotrakEmulator : public FastrakEmulatorCore {
 public:
  explicit IsotrakEmulator(std::unique_ptr<PoseSource> source, const IsotrakEmulatorOptions& options = {})
      : FastrakEmulatorCore(std::move(source), options) {}

 private:
  std::string statusRecord() const override;
  std::string written(const FastrakRecord& record) const override;
  void setOutputList(const FastrakCommand& command, std::vector<EmulatedOutput>& out) override;
};

/// An emulated Isotrak II on a pty or a TCP port, not yet started.
/// @error of makeEmulator
Result<std::unique_ptr<EmulatorRunner>> makeIsotrakEmulator(const Emulation& emulation);

}  // namespace fieldtrue::acquisition
