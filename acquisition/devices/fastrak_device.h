#pragma once

#include <QElapsedTimer>
#include <QTimer>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "acquisition/devices/fastrak_startup.h"
#include "acquisition/devices/sample_clock.h"
#include "acquisition/devices/tracker_device.h"
#include "acquisition/transports/transport.h"

namespace fieldtrue::acquisition {

/// A Polhemus Fastrak on any line. Sensor n of its samples is station n + 1; times count from start().
class FastrakDevice : public TrackerDevice {
  Q_OBJECT
 public:
  using TransportFactory = std::function<Result<std::unique_ptr<Transport>>()>;
  /// @param make_line called by start(), in the device's thread
  /// @param clock_speed the tracker's seconds per second; other than 1 only for an emulated tracker
  FastrakDevice(FastrakSetup setup, TransportFactory make_line, double clock_speed = 1.0, QObject* parent = nullptr);
  ~FastrakDevice() override;

  void start() override;
  void stop() override;
  TableMetadata describe() const override;

 private:
  void beginStartup();
  void startupFinished();
  void readReady();
  void watch();
  void running();
  void noteStatus(const Sample& sample);
  void failWith(const QString& text);
  void closeLine();
  double now_s() const;
  double rate_hz() const;
  QString summary() const;

  FastrakSetup setup_;
  TransportFactory make_line_;
  double clock_speed_;
  std::unique_ptr<Transport> line_;
  std::unique_ptr<FastrakStartup> startup_;
  std::unique_ptr<LineExchange> farewell_;
  std::optional<FastrakIdentity> identity_;
  std::optional<FastrakParser> parser_;
  std::vector<SampleClock> clocks_;
  HemisphereWatch hemisphere_;
  std::array<std::string, kFastrakStations> last_status_;
  QElapsedTimer clock_;
  QTimer watch_;
  int quiet_ticks_ = 0;
  std::uint64_t records_seen_ = 0;
  std::uint64_t bytes_at_last_record_ = 0;
  bool running_ = false;
};

}  // namespace fieldtrue::acquisition
