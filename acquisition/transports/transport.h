#pragma once

#include <QIODevice>
#include <QString>
#include <memory>
#include <string>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// A byte line to a tracker as a QIODevice (non-blocking, readyRead when bytes are there), whatever carries it.
class Transport : public QIODevice {
  Q_OBJECT
 public:
  using QIODevice::QIODevice;
  bool isSequential() const override { return true; }

  /// Opens and configures the line (8 data bits, no parity, 1 stop bit) without waiting for anyone: where the far end
  /// must answer first (TCP) the line is not open yet on return, and lineOpened or lineLost follows.
  /// @error kDevice, one sentence: does not exist, busy (who has it, when known), no permission, cannot set the rate
  virtual Result<void> openLine() = 0;
  virtual void setRequestToSend(bool /*on*/) {}
  virtual void setBreak(bool /*on*/) {}
  virtual bool setBaud(int /*baud*/) { return false; }  ///< False when the line has no baud rate (pty, TCP).

 signals:
  /// A line that openLine left waiting is open now.
  void lineOpened();
  /// The line is gone (unplugged, peer closed). Nothing more will come.
  void lineLost(const QString& reason);
};

/// Makes the transport an address asks for: `tcp:HOST:PORT`; a real serial line through libserialport; a pty or
/// anything libserialport refuses through termios. `@BAUD` at the end sets the rate (default 115200).
/// @error kBadInput for an address that cannot be read
Result<std::unique_ptr<Transport>> makeTransport(const std::string& address);

}  // namespace fieldtrue::acquisition
