#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/emulators/emulated_unit.h"
#include "acquisition/protocols/fastrak.h"

namespace fieldtrue::acquisition {

struct FastrakEmulatorOptions : EmulatedUnitOptions {
  FastrakEmulatorOptions() {
    version = "G1.02";
    identity = "Fieldtrue Fastrak emulator";
  }
  int stations = kFastrakStations;
  std::string letters_it_lacks;  ///< Commands of a Fastrak's that it does not know.
};

/// A Fastrak without its line: interprets the commands of the manual and keeps their state. Hemisphere, alignment,
/// boresight, tip offset, increment and envelopes act on the readings; filters, mounting frame, stylus mode and line
/// rate are kept and read back only.
class FastrakEmulatorCore : public EmulatedUnit {
 public:
  FastrakEmulatorCore(std::unique_ptr<PoseSource> source, const FastrakEmulatorOptions& options = {});

  bool streaming() const override { return setup_.continuous; }

  FastrakStatus status() const;
  bool stationActive(int station) const { return setup_.active[static_cast<std::size_t>(station - 1)]; }
  const std::vector<int>& outputList(int station) const { return setup_.items[static_cast<std::size_t>(station - 1)]; }
  /// Numbers of a setting as last set, e.g. 'H' of station 2; station 0 for settings of the whole tracker ('x', 'v').
  const std::vector<double>& numbers(char letter, int station) const;

 protected:
  struct Setup {
    FastrakFormat format = FastrakFormat::kAscii;
    FastrakUnit unit = FastrakUnit::kInch;
    bool continuous = false;
    bool compensation = true;
    std::array<bool, kFastrakStations> active{};
    std::array<std::vector<int>, kFastrakStations> items;
    std::map<std::pair<char, int>, std::vector<double>> numbers;
    std::array<std::optional<Eigen::Quaterniond>, kFastrakStations> boresight;
    std::array<Pose, kFastrakStations> tracker_from_aligned;
    std::string identity;
  };
  /// What differs between trackers of this family.
  virtual std::string statusRecord() const { return encodeStatus(status()); }
  virtual std::string written(const FastrakRecord& record) const;
  virtual void setOutputList(const FastrakCommand& command, std::vector<EmulatedOutput>& out);
  /// A list with what a command changes in it; none where that was refused.
  std::optional<std::vector<int>> changedList(std::vector<int> items, const std::vector<std::string>& fields,
                                              const FastrakCommand& command, std::vector<EmulatedOutput>& out) const;
  void refuseAsOutOfRange(const FastrakCommand& command, std::vector<EmulatedOutput>& out) const;
  void answerReadBack(char letter, int station, const std::string& text, std::vector<EmulatedOutput>& out) const;

  Setup setup_, saved_;

 private:
  void hear(std::string_view bytes, std::vector<EmulatedOutput>& out) override;
  std::vector<int> activeSensors() const override;
  void send(const std::vector<Sample>& samples, bool every, std::vector<EmulatedOutput>& out) override;

  struct Memory {
    std::optional<Eigen::Vector3d> last_position_m;
    std::optional<Eigen::Vector3d> last_sent_m;
  };
  using Handler = void (FastrakEmulatorCore::*)(const FastrakCommand&, std::vector<EmulatedOutput>&);
  static const std::map<char, Handler>& handlers();

  Setup factorySetup() const;
  void obey(const FastrakCommand& command, std::vector<EmulatedOutput>& out);
  void refuse(const FastrakCommand& command, int code, std::vector<EmulatedOutput>& out) const;
  std::optional<int> stationOf(const FastrakCommand& command, std::vector<EmulatedOutput>& out) const;

  void setFlag(const FastrakCommand& command, std::vector<EmulatedOutput>& out);
  void sendPoint(const FastrakCommand& command, std::vector<EmulatedOutput>& out);
  void sendStatus(const FastrakCommand& command, std::vector<EmulatedOutput>& out);
  void setContinuous(const FastrakCommand& command, std::vector<EmulatedOutput>& out);
  void setActive(const FastrakCommand& command, std::vector<EmulatedOutput>& out);
  void setBoresight(const FastrakCommand& command, std::vector<EmulatedOutput>& out);
  void resetAlignment(const FastrakCommand& command, std::vector<EmulatedOutput>& out);
  void setNumbers(const FastrakCommand& command, std::vector<EmulatedOutput>& out);
  void setIdentity(const FastrakCommand& command, std::vector<EmulatedOutput>& out);
  void restart(const FastrakCommand& command, std::vector<EmulatedOutput>& out);
  void flow(const FastrakCommand& command, std::vector<EmulatedOutput>& out);
  void accept(const FastrakCommand&, std::vector<EmulatedOutput>&) {}
  void realign(int station);
  void changeUnit(FastrakUnit unit);

  Pose reported(int station, const Pose& tracker_from_sensor) const;
  char errorOf(const Sample& sample, int station, const Pose& pose) const;
  FastrakLayout layout(int station) const;

  int stations_;
  std::string letters_it_lacks_;
  FastrakCommandReader reader_;
  std::array<Memory, kFastrakStations> memory_;
};

}  // namespace fieldtrue::acquisition
