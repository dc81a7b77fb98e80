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
  /// Of a reading and those before it, what is of the sensor that is recorded: nothing until it is known which one is.
  std::vector<Sample> recorded(const Sample& sample);
  /// Whether the recorded sensor is not among those that report; true once a stream.
  bool findsItMissing();
  void add(const Sample& sample);
  std::optional<Trace> trace() const { return device ? device->trace() : last_trace; }
  void cut();   ///< Stops the device, and hears no more of it.
  void drop();  ///< Gives the device away.

  QObject* owner;  ///< Hears the device.
  std::unique_ptr<TrackerDevice> device;
  std::optional<Trace> last_trace;  ///< Of the device that was given away last.
  DeviceState state = DeviceState::kClosed;
  QString text;
  std::optional<int> sensor;            ///< The one recorded: the lowest that reports, unless another is asked for.
  std::optional<int> asked_sensor;      ///< By a person.
  std::map<int, int> heard;             ///< Readings of each sensor of this stream; of a long one no longer counted.
  bool told_missing = false;            ///< That the recorded one is not among them.
  std::vector<Sample> unsorted;         ///< Before it was known which one is recorded.
  std::optional<double> time_offset_s;  ///< Session time minus the device's.
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
