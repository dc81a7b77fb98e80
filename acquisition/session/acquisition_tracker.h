#pragma once

#include <QElapsedTimer>
#include <QTimer>
#include <deque>
#include <map>

#include "acquisition/devices/tracker_device.h"

namespace fieldtrue::acquisition {

/// The tracker that is connected: what it said last, and the watch over its stream.
struct TrackerLink {
  explicit TrackerLink(QObject* receiver);

  bool running() const { return state == DeviceState::kRunning; }
  bool silent() const;
  bool justReturned() const;
  double rate_hz() const;
  void retryLater();
  void beginStream();
  /// Of a reading and those before it, what is of the sensors that are recorded: nothing until it is known which ones
  /// are. @param takes_newcomers a sensor that begins to report is recorded too
  std::vector<Sample> recorded(const Sample& sample, bool takes_newcomers = true);
  /// Whether a sensor began to report with this reading, when others had for a while.
  bool joinsLate(const Sample& sample) const;
  std::vector<int> reporting() const;  ///< Every sensor heard in this stream, in order.
  bool leads(const Sample& sample) const { return !sensors.empty() && sample.sensor == sensors.front(); }
  /// Recorded ones that have sent nothing for a while though others do.
  std::vector<int> silentSensors() const;
  bool isSure() const;  ///< That by now each one that is there has reported.
  /// Recorded ones that have sent nothing since the stream began, once it is sure that others do.
  std::vector<int> missingSensors() const;
  void add(const Sample& sample);
  std::optional<Trace> trace() const { return device ? device->trace() : last_trace; }
  void cut();   ///< Stops the device, and hears no more of it.
  void drop();  ///< Gives the device away.

  QObject* owner;  ///< Hears the device.
  std::unique_ptr<TrackerDevice> device;
  std::optional<Trace> last_trace;  ///< Of the device that was given away last.
  DeviceState state = DeviceState::kClosed;
  QString text;
  /// Those recorded, the leading one first: all that report, unless others are asked for. Empty until it is known.
  std::vector<int> sensors;
  std::vector<int> asked_sensors;        ///< Before there is a session, the leading one first; empty = all that report.
  std::map<int, int> heard;              ///< Readings of each sensor of this stream; of a long one no longer counted.
  std::map<int, double> newest_s;        ///< When each was heard last, by the device's clock.
  std::optional<double> began_s, now_s;  ///< The first and the last reading of any, by the same clock.
  bool told_missing = false;             ///< That some that are recorded are not among those heard.
  std::vector<Sample> unsorted;          ///< Before it was known which one is recorded.
  std::optional<double> time_offset_s;   ///< Session time minus the device's.
  std::optional<Sample> live;
  std::deque<double> recent_times_s;
  QElapsedTimer since_sample;
  QTimer silence_timer;
  bool reconnects = true;
  bool lost = false;  ///< It ran and is gone; retry_timer starts it again.
  int retries = 0;
  QElapsedTimer since_return;  ///< Since a lost one was back.
  QTimer retry_timer;
};

}  // namespace fieldtrue::acquisition
