#pragma once

#include <QObject>
#include <QTimer>
#include <deque>
#include <memory>
#include <random>

#include "acquisition/emulators/emulated_tracker.h"
#include "acquisition/emulators/emulator_endpoint.h"
#include "acquisition/emulators/emulator_faults.h"
#include "acquisition/transports/tracker_clock.h"

namespace fieldtrue::acquisition {

/// Joins an emulated tracker and a line: gives it time from a monotonic clock, so that it neither drifts nor drops, and
/// spoils the line as the faults say.
class EmulatorRunner : public QObject {
  Q_OBJECT
 public:
  /// @param clock the tracker's, or its speed
  EmulatorRunner(std::unique_ptr<EmulatedTracker> tracker, std::unique_ptr<EmulatorEndpoint> endpoint,
                 EmulatorFaults faults = {}, TrackerClock clock = {}, QObject* parent = nullptr);

  /// Opens the line. @error of the endpoint
  Result<void> start();
  EmulatedTracker& tracker() { return *tracker_; }
  EmulatorEndpoint& endpoint() { return *endpoint_; }
  /// The tracker's clock, zero at start.
  double time_s() const { return clock_.now_s(); }
  std::uint64_t recordsSent() const { return records_sent_; }
  void unplug();

 signals:
  void bytesFromHost(const QByteArray& bytes);
  void bytesToHost(const QByteArray& bytes);
  void unplugged();
  void notice(const QString& text);

 private:
  struct Late {
    double due_s;
    std::string bytes;
  };
  void receive(const QByteArray& bytes);
  void tick();
  void deliver(std::vector<EmulatedOutput>& out);
  void transmit(const std::string& bytes);
  void sendGarbage();

  std::unique_ptr<EmulatedTracker> tracker_;
  EmulatorEndpoint* endpoint_;
  EmulatorFaults faults_;
  TrackerClock clock_;
  QTimer timer_;
  std::mt19937_64 random_{7};
  std::deque<Late> late_;
  bool greeted_ = false;
  bool unplugged_ = false;
  std::uint64_t records_sent_ = 0;
};

}  // namespace fieldtrue::acquisition
