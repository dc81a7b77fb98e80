#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/emulators/emulated_unit.h"
#include "acquisition/protocols/liberty.h"

namespace fieldtrue::acquisition {

struct LibertyEmulatorOptions : EmulatedUnitOptions {
  explicit LibertyEmulatorOptions(const LibertyMake& which = libertyMake("liberty")) : make(&which) {
    version = "2.01";
    identity = std::string("Fieldtrue ") + which.name + " emulator";
  }
  const LibertyMake* make;
};

/// A Liberty or Patriot without its line. Every station has the whole rate. Hemisphere, alignment origin, boresight and
/// tip offset act on the readings; filters are kept and read back only.
class LibertyEmulator : public EmulatedUnit {
 public:
  LibertyEmulator(std::unique_ptr<PoseSource> source, const LibertyEmulatorOptions& options = LibertyEmulatorOptions());

  bool streaming() const override { return continuous_; }
  bool isBinary() const { return setup_.binary; }
  bool isMetric() const { return setup_.metric; }
  const std::vector<int>& outputList(int station) const { return stationSetup(station).items; }
  const Eigen::Vector3d& hemisphere(int station) const { return stationSetup(station).hemisphere; }
  const std::array<double, 4>& filter(char letter) const { return setup_.filters.at(letter); }

 private:
  struct StationSetup {
    bool active = false;
    std::vector<int> items = {2, 4, 1};
    Eigen::Vector3d hemisphere = Eigen::Vector3d::UnitX();
    Eigen::Vector3d tip = Eigen::Vector3d::Zero();
    std::optional<Eigen::Quaterniond> boresight;
    Pose tracker_from_aligned;
  };
  struct Setup {
    bool binary = false;
    bool metric = false;
    std::map<int, StationSetup> stations;  ///< Those plugged in.
    std::map<char, std::array<double, 4>> filters{{'X', {0.2, 0.2, 0.8, 0.95}}, {'Y', {0.2, 0.2, 0.8, 0.95}}};
  };
  using Handler = void (LibertyEmulator::*)(const LibertyCommand&, Out&);
  static const std::map<char, Handler>& handlers();

  void hear(std::string_view bytes, Out& out) override;
  std::vector<int> activeSensors() const override;
  void send(const std::vector<Sample>& samples, bool every, Out& out) override;
  int sharing(std::size_t) const override { return 1; }

  void obey(const LibertyCommand& command, Out& out);
  void reply(char command, int station, const std::string& binary, const std::string& text, Out& out) const;
  void refuse(const LibertyCommand& command, const std::string& why, Out& out) const;
  /// The stations a command names; empty where it names none that is there, which has been refused.
  std::vector<int> stationsOf(const LibertyCommand& command, Out& out) const;
  /// Its numbers behind the station.
  std::optional<std::vector<double>> numbersOf(const LibertyCommand& command, std::size_t skipped, Out& out) const;

  void setFormat(const LibertyCommand& command, Out& out);
  void setUnits(const LibertyCommand& command, Out& out);
  void sendPoint(const LibertyCommand& command, Out& out);
  void sendContinuously(const LibertyCommand& command, Out& out);
  void tellWho(const LibertyCommand& command, Out& out);
  void stationState(const LibertyCommand& command, Out& out);
  void setOutput(const LibertyCommand& command, Out& out);
  void setHemisphere(const LibertyCommand& command, Out& out);
  void setTip(const LibertyCommand& command, Out& out);
  void setAlignment(const LibertyCommand& command, Out& out);
  void resetAlignment(const LibertyCommand& command, Out& out);
  void setBoresight(const LibertyCommand& command, Out& out);
  void resetBoresight(const LibertyCommand& command, Out& out);
  void setFilter(const LibertyCommand& command, Out& out);
  void resetCounters(const LibertyCommand& command, Out& out);
  void restart(const LibertyCommand& command, Out& out);
  void accept(const LibertyCommand&, Out&) {}

  Setup factorySetup() const;
  StationSetup& stationSetup(int station) { return setup_.stations.at(station); }
  const StationSetup& stationSetup(int station) const { return setup_.stations.at(station); }
  Pose reported(int station, const Pose& tracker_from_sensor) const;
  double metresPerUnit() const { return setup_.metric ? 0.01 : 0.0254; }

  const LibertyMake& make_;
  Setup setup_;
  LibertyCommandReader reader_;
  bool continuous_ = false;
  char record_command_ = 'P';
  double zero_s_ = 0.0;  ///< Of the time stamps.
  std::uint32_t frame_ = 0;
};

/// An emulated Liberty or Patriot on a pty or a TCP port, not yet started. @error of makeEmulator
Result<std::unique_ptr<EmulatorRunner>> makeLibertyEmulator(const Emulation& emulation);
Result<std::unique_ptr<EmulatorRunner>> makePatriotEmulator(const Emulation& emulation);

}  // namespace fieldtrue::acquisition
