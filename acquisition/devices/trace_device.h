#pragma once

#include <QElapsedTimer>
#include <QTimer>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "acquisition/devices/tracker_device.h"
#include "calib/core/settings.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::acquisition {

/// A recording as a row of pieces, each with when it is due.
class Playback {
 public:
  struct Piece {
    std::vector<Sample> samples;
    QStringList remarks;
  };
  virtual ~Playback() = default;
  virtual std::size_t pieces() const = 0;
  /// By the recording's clock, never less than of the piece before.
  virtual double due_s(std::size_t piece) const = 0;
  /// Whether the tracker was lost before this piece, and found again.
  virtual bool breaksBefore(std::size_t /*piece*/) const { return false; }
  /// The samples of a piece, with their recorded times; called in order.
  virtual Piece play(std::size_t piece) = 0;
  /// From its first piece to that of its next round.
  virtual double round_s() const = 0;
  /// Begins anew.
  virtual void rewind() = 0;
  virtual QString summary() const = 0;
  virtual TableMetadata describe() const = 0;
};

/// How a recording is to be played.
struct TraceSetup {
  std::filesystem::path file;  ///< `*.trace.zip`, or a sample table (`*.csv`).
  double rate = 1.0;           ///< Its seconds per second.
  bool loop = false;           ///< Starts anew at its end; the times go on.
};

/// What is in the file, ready to be played. @error kIo, kBadInput: one sentence that names the file
Result<std::unique_ptr<Playback>> openPlayback(const std::filesystem::path& file);

/// Plays a recording at its own times: the bytes of a line through the parser of their tracker, or a table's samples.
/// Samples have the times they were recorded with, whatever the rate. Where the tracker was lost it fails as the
/// tracker did, and started again it goes on.
class TraceDevice : public TrackerDevice {
  Q_OBJECT
 public:
  explicit TraceDevice(TraceSetup setup, QObject* parent = nullptr);

  void start() override;
  void stop() override;
  TableMetadata describe() const override;

 private:
  void playDue();
  void breakOff();
  void goOn();
  void play();
  void end();

  TraceSetup setup_;
  std::unique_ptr<Playback> playback_;
  std::size_t next_ = 0;
  double from_s_ = 0.0;   ///< Due of the first piece.
  double round_s_ = 0.0;  ///< What rounds before this one have taken.
  bool broken_ = false;   ///< The tracker was lost before the next piece, and is not asked for again yet.
  std::optional<std::size_t> found_again_;  ///< The piece that was gone on with.
  QElapsedTimer clock_;
  QTimer timer_;
};

std::vector<Setting> traceSettings();
/// @param address FILE[,rate=1][,loop=0] @error kBadInput
Result<std::unique_ptr<TrackerDevice>> makeTraceDevice(const std::string& address, const simulation::Scene& scene);

}  // namespace fieldtrue::acquisition
