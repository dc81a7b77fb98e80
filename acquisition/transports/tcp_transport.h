#pragma once

#include <QTcpSocket>

#include "acquisition/transports/buffered_transport.h"

namespace fieldtrue {

/// A tracker behind a TCP port: an emulator, or a serial-to-network bridge in raw mode.
class TcpTransport : public BufferedTransport {
  Q_OBJECT
 public:
  TcpTransport(QString host, quint16 port, QObject* parent = nullptr);
  /// Waits up to three seconds for the connection.
  Result<void> openLine() override;
  void close() override;

 protected:
  qint64 writeData(const char* from, qint64 size) override;

 private:
  QString host_;
  quint16 port_;
  QTcpSocket* socket_;
};

}  // namespace fieldtrue
