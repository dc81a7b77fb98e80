#include "acquisition/transports/tcp_transport.h"

namespace fieldtrue {
namespace {

std::string connectError(const QString& host, quint16 port, const QTcpSocket& socket) {
  const std::string where = host.toStdString() + ":" + std::to_string(port);
  switch (socket.error()) {
    case QAbstractSocket::ConnectionRefusedError:
      return "Nothing listens at " + where + "; start the emulator or the bridge there, or correct the port";
    case QAbstractSocket::HostNotFoundError:
      return "There is no host named " + host.toStdString();
    case QAbstractSocket::SocketTimeoutError:
      return where + " did not answer within 3 s; check the network and the address";
    default:
      return "Cannot connect to " + where + ": " + socket.errorString().toStdString();
  }
}

}  // namespace

TcpTransport::TcpTransport(QString host, quint16 port, QObject* parent)
    : BufferedTransport(parent), host_(std::move(host)), port_(port), socket_(new QTcpSocket(this)) {
  connect(socket_, &QTcpSocket::readyRead, this, [this] { received(socket_->readAll()); });
  connect(socket_, &QTcpSocket::disconnected, this,
          [this] { lost(QString("%1:%2 closed the connection").arg(host_).arg(port_)); });
}

Result<void> TcpTransport::openLine() {
  constexpr int kConnectTimeout_ms = 3000;
  socket_->connectToHost(host_, port_);
  if (!socket_->waitForConnected(kConnectTimeout_ms)) {
    const std::string text = connectError(host_, port_, *socket_);
    socket_->abort();
    return fail(ErrorCode::kDevice, text);
  }
  socket_->setSocketOption(QAbstractSocket::LowDelayOption, 1);
  openDevice();
  return {};
}

void TcpTransport::close() {
  socket_->blockSignals(true);
  socket_->disconnectFromHost();
  socket_->blockSignals(false);
  if (isOpen()) BufferedTransport::close();
}

qint64 TcpTransport::writeData(const char* from, qint64 size) {
  if (socket_->state() != QAbstractSocket::ConnectedState) return -1;
  const qint64 written = socket_->write(from, size);
  socket_->flush();
  return written;
}

}  // namespace fieldtrue
