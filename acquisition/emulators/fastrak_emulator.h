#pragma once

#include <memory>

#include "acquisition/emulators/fastrak_emulator_core.h"

namespace fieldtrue::acquisition {

/// An emulated Fastrak on a pty or a TCP port, not yet started. `endpoint().address()` is what a host opens once it is.
/// @error kBadInput when neither or both lines are named, or the recording is empty or holds other sensors than 0 to 3;
///        the scene's errors
Result<std::unique_ptr<EmulatorRunner>> makeFastrakEmulator(const Emulation& emulation);

}  // namespace fieldtrue::acquisition
