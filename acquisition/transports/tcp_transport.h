#pragma once

#include <QTcpSocket>
#include <QTimer>

#include "acquisition/transports/buffered_transport.h"

namespace fieldtrue::acquisition {

/// A tracker behind a TCP port: an emulator, or a serial-to-network bridge in raw mode.
class TcpTransport : public BufferedTransport {
  Q_OBJECT
 public:
  TcpTransport(QString host, quint16 port, QObject* parent = nullptr);
  /// Begins to connect; lineOpened or, after three seconds at most, lineLost follows.
  Result<void> openLine() override;
  void close() override;

 protected:
  qint64 writeData(const char* from, qint64 size) override;

 private:
  void connected();
  void notConnected(const std::string& why);
  std::string where() const;
  std::string connectError() const;

  QString host_;
  quint16 port_;
  QTcpSocket* socket_;
  QTimer patience_;
  bool opening_ = false;
};

}  // namespace fieldtrue::acquisition
