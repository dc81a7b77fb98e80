#pragma once

#include <QTimer>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "acquisition/devices/line_address.h"
#include "acquisition/devices/stream_reader.h"
#include "acquisition/devices/tracker_device.h"
#include "acquisition/devices/tracker_startup.h"
#include "acquisition/transports/followed_line.h"
#include "acquisition/transports/tracker_clock.h"
#include "acquisition/transports/transport.h"

namespace fieldtrue::acquisition {

/// A tracker on any line: opens it, has the tracker set up, turns its bytes into samples with times, watches that they
/// keep coming and that they are not mirrored, and takes leave. What differs from tracker to tracker is its startup.
/// Sensor n of its samples is station n + 1; times count from the first start(). Its last bytes are kept.
class LineDevice : public TrackerDevice {
  Q_OBJECT
 public:
  using TransportFactory = std::function<Result<std::unique_ptr<Transport>>()>;
  using StartupFactory = std::function<std::unique_ptr<TrackerStartup>(Transport& line)>;
  /// @param make_line called by start(), in the device's thread
  /// @param clock the tracker's, or its speed; other than the computer's only for an emulated tracker
  LineDevice(LineSetup setup, StartupFactory make_startup, TransportFactory make_line, TrackerClock clock = {},
             QObject* parent = nullptr);
  ~LineDevice() override;

  void start() override;
  void stop() override;
  TableMetadata describe() const override;
  std::optional<Trace> trace() const override;
  bool hasTrace() const override { return true; }

 private:
  void beginStartup();
  void startupFinished();
  void readReady();
  void askAgain(int gap_ms);
  void watch();
  void running();
  void seen(bool sent, const QByteArray& bytes, double at_s);
  void failWith(const QString& text);
  void closeLine();
  void say(const std::string& bytes);
  QString summary(const QString& part_name) const;

  LineSetup setup_;
  StartupFactory make_startup_;
  TransportFactory make_line_;
  std::unique_ptr<Transport> line_;
  std::unique_ptr<TrackerStartup> startup_;
  std::unique_ptr<LineExchange> farewell_;
  std::optional<TrackerIdentity> identity_;
  std::unique_ptr<StreamReader> reader_;
  LineTrace trace_;
  std::string end_;  ///< What ends its stream.
  TrackerClock clock_;
  QTimer watch_;
  QTimer gap_;  ///< Until it is asked again.
  int quiet_ticks_ = 0;
  bool heard_since_tick_ = false;
  bool noise_since_reading_ = false;
  std::uint64_t answers_ = 0;
  std::uint64_t answers_at_tick_ = 0;
  bool running_ = false;
};

/// A tracker whose startup is constructed from a line and the setup.
template <class Startup, class Setup>
std::unique_ptr<LineDevice> makeLineDevice(const Setup& setup, LineDevice::TransportFactory make_line,
                                           TrackerClock clock = {}) {
  return std::make_unique<LineDevice>(
      setup, [setup](Transport& line) { return std::make_unique<Startup>(line, setup); }, std::move(make_line),
      std::move(clock));
}

/// The same from what a person wrote, for a row of the registry.
/// @param setup the tracker's defaults
/// @param apply Result<void>(const Settings&, Setup&): takes over the settings
/// @error kBadInput for a line or a setting that cannot be read
template <class Startup, class Setup, class Apply>
Result<std::unique_ptr<TrackerDevice>> deviceAtAddress(const std::string& address, const std::vector<Setting>& declared,
                                                       Setup setup, Apply apply) {
  FT_TRY(const LineAddress read, readLineAddress(address, declared, setup));
  FT_TRY_VOID(apply(read.settings, setup));
  return makeLineDevice<Startup>(setup,
                                 [line = FollowedLine(read.line)]() mutable { return makeTransport(line.now()); });
}

}  // namespace fieldtrue::acquisition
