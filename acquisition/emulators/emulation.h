#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "acquisition/emulators/emulator_faults.h"
#include "calib/core/calibration_table.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::acquisition {

/// What an emulated tracker is to be, whatever its make.
struct Emulation {
  std::string pty_link;               ///< Offers a pty behind this link.
  std::optional<int> tcp_port;        ///< Or a TCP port of this machine; 0 = any free one.
  simulation::Scene scene;            ///< The room it stands in; its operator walks from place to place.
  int sensors = 1;                    ///< On the jig in the operator's hands, 4 cm apart along its y.
  std::optional<SampleTable> replay;  ///< Or a recording, played once at the times it was recorded.
  EmulatorFaults faults;
  std::uint64_t seed = 1;
  double speed = 1.0;
};

}  // namespace fieldtrue::acquisition
