#pragma once

#include <QString>
#include <QStringList>
#include <map>
#include <string_view>
#include <vector>

#include "acquisition/devices/sample_clock.h"
#include "acquisition/devices/tracker_startup.h"

namespace fieldtrue::acquisition {

/// Bytes of a stream to samples with times: a tracker's parser, the clocks, and the watch over mirrored readings. What
/// comes out depends on the bytes, how they were cut and when they arrived, and on nothing else.
class StreamReader {
 public:
  /// @param rate_hz of each sensor
  /// @param clock_speed the tracker's seconds per second; other than 1 only for an emulated tracker
  /// @param summary what is said of the tracker while nothing is wrong
  StreamReader(StreamPlan plan, double rate_hz, double clock_speed, QString summary);

  struct Batch {
    std::vector<Sample> samples;
    QStringList remarks;  ///< What changed: a station's status, the tracker's clock.
  };
  /// @param arrival_s when the bytes were read, never less than before
  Batch read(std::string_view bytes, double arrival_s);

  const StreamPlan& plan() const { return plan_; }
  const QString& summary() const { return summary_; }

 private:
  Sample stamped(Reading& reading, double arrival_s, std::size_t later_in_bunch, QStringList& remarks);
  void noteStatus(const Sample& sample, QStringList& remarks);

  StreamPlan plan_;
  double rate_hz_;
  QString summary_;
  std::map<int, SampleClock> clocks_;  ///< By sensor, where the tracker has no clock of its own.
  UnitClock unit_clock_;
  HemisphereWatch hemisphere_;
  std::map<int, std::string> last_status_;  ///< By sensor.
};

}  // namespace fieldtrue::acquisition
