#pragma once

#include <memory>
#include <string>
#include <vector>

#include "acquisition/emulators/emulated_unit.h"
#include "acquisition/protocols/openigtlink_parser.h"

namespace fieldtrue::acquisition {

struct IgtlEmulatorOptions : EmulatedUnitOptions {
  double start_utc_s = 0.0;  ///< What its clock shows when the emulator's is zero [s since 1970].
};

/// An OpenIGTLink server without its port: every cycle one TDATA message with all sensors that read, named Sensor1 on,
/// and a TRANSFORM message of each. Sends without being asked, and obeys STT_TDATA and STP_TDATA.
class IgtlEmulatorCore : public EmulatedUnit {
 public:
  IgtlEmulatorCore(std::unique_ptr<PoseSource> source, IgtlEmulatorOptions options);

  bool streaming() const override { return sends_; }
  void hostCame(double time_s) override;

 private:
  void hear(std::string_view bytes, Out& out) override;
  std::vector<int> activeSensors() const override;
  void send(const std::vector<Sample>& samples, bool every, Out& out) override;
  int sharing(std::size_t) const override { return 1; }
  std::string message(std::string_view type, const std::string& device, double time_s, const std::string& body);

  double start_utc_s_;
  IgtlParser heard_;
  bool sends_;
  std::uint64_t cycles_ = 0;
  std::uint64_t messages_ = 0;
};

/// An OpenIGTLink server of the scene's sensors on a TCP port, not yet started.
/// @error kBadInput when no port is named; of makeEmulator
Result<std::unique_ptr<EmulatorRunner>> makeIgtlEmulator(const Emulation& emulation);

}  // namespace fieldtrue::acquisition
