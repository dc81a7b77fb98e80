#pragma once

#include <QObject>
#include <QStringList>
#include <vector>

#include "acquisition/devices/tracker_device.h"

namespace fieldtrue::testing {

/// Listens to a device and keeps what it said.
class DeviceProbe : public QObject {
 public:
  explicit DeviceProbe(acquisition::TrackerDevice& device) {
    connect(&device, &acquisition::TrackerDevice::stateChanged, this,
            [this](acquisition::DeviceState now, const QString& text) {
              state = now;
              last_text = text;
              texts << text;
              if (now == acquisition::DeviceState::kFailed) ++failures;
            });
    connect(&device, &acquisition::TrackerDevice::samplesReceived, this, [this](const std::vector<Sample>& more) {
      samples.insert(samples.end(), more.begin(), more.end());
      ++batches;
    });
    connect(&device, &acquisition::TrackerDevice::bytesSeen, this,
            [this](bool sent, const QByteArray& bytes) { (sent ? bytes_sent : bytes_received) += bytes; });
  }

  std::vector<Sample> good() const {
    std::vector<Sample> result;
    for (const auto& sample : samples) {
      if (sample.status.empty()) result.push_back(sample);
    }
    return result;
  }

  acquisition::DeviceState state = acquisition::DeviceState::kClosed;
  QString last_text;
  QStringList texts;
  int failures = 0;
  int batches = 0;
  std::vector<Sample> samples;
  QByteArray bytes_sent, bytes_received;
};

}  // namespace fieldtrue::testing
