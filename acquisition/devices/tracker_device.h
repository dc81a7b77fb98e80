#pragma once

#include <QByteArray>
#include <QMetaType>
#include <QObject>
#include <QString>
#include <optional>
#include <vector>

#include "acquisition/devices/line_trace.h"
#include "calib/core/calibration_table.h"

namespace fieldtrue::acquisition {

enum class DeviceState { kClosed, kConnecting, kRunning, kFailed };

/// A tracker that streams. Lives in one thread; all I/O is asynchronous. One row of the device registry makes each
/// kind.
class TrackerDevice : public QObject {
  Q_OBJECT
 public:
  using QObject::QObject;

  /// Opens the line and starts the stream; answers with stateChanged.
  virtual void start() = 0;
  virtual void stop() = 0;

  /// Tells where the operator has been sent. Only the simulated tracker cares: its virtual operator carries the jig
  /// there.
  /// @param reference_from_sensor true pose in the rig's frame
  virtual void guideTo(const Pose& /*reference_from_sensor*/) {}

  /// What the device said of itself (identity, units, filter, compensation), for the session's metadata.
  virtual TableMetadata describe() const { return {}; }

  /// The last bytes that went over its line, from whatever was connected since it was made; none where it has no line.
  virtual std::optional<Trace> trace() const { return std::nullopt; }
  /// Whether it has one; asked often, for it copies nothing.
  virtual bool hasTrace() const { return false; }

 signals:
  /// @param text what happened in words; for kFailed what was seen and what to do
  void stateChanged(fieldtrue::acquisition::DeviceState state, const QString& text);
  void samplesReceived(const std::vector<fieldtrue::Sample>& samples);
  /// Raw bytes as they went by.
  void bytesSeen(bool sent, const QByteArray& bytes);
};

}  // namespace fieldtrue::acquisition

Q_DECLARE_METATYPE(fieldtrue::acquisition::DeviceState)
