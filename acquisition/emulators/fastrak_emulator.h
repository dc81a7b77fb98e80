#pragma once

#include <memory>
#include <optional>
#include <string>

#include "acquisition/emulators/emulation.h"
#include "acquisition/emulators/emulator_runner.h"
#include "acquisition/emulators/fastrak_emulator_core.h"
#include "acquisition/emulators/simulated_jig.h"
#include "calib/core/calibration_table.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::acquisition {

/// An emulated Fastrak on a pty or a TCP port, not yet started. `endpoint().address()` is what a host opens once it is.
/// @error kBadInput when neither or both lines are named, or the recording is empty or holds other sensors than 0 to 3;
///        the scene's errors
Result<std::unique_ptr<EmulatorRunner>> makeFastrakEmulator(const Emulation& emulation);

/// An emulated Fastrak at one end of a line inside this process.
std::unique_ptr<EmulatorRunner> makeFastrakEmulator(std::unique_ptr<PoseSource> source,
                                                    std::unique_ptr<LoopbackTransport> device_end,
                                                    const FastrakEmulatorOptions& options = {}, double speed = 1.0);

}  // namespace fieldtrue::acquisition
