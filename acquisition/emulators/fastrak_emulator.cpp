#include "acquisition/emulators/fastrak_emulator.h"

namespace fieldtrue::acquisition {

Result<std::unique_ptr<EmulatorRunner>> makeFastrakEmulator(const Emulation& emulation) {
  return makeEmulator<FastrakEmulatorCore>(emulation, {"Fastrak", kFastrakStations, 0.0}, FastrakEmulatorOptions{});
}

}  // namespace fieldtrue::acquisition
