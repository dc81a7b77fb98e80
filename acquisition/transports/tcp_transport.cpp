#include "acquisition/transports/tcp_transport.h"

namespace fieldtrue::acquisition {
namespace {

constexpr int kConnectTimeout_ms = 3000;

}  // namespace

TcpTransport::TcpTransport(QString host, quint16 port, QObject* parent)
    : BufferedTransport(parent), host_(std::move(host)), port_(port), socket_(new QTcpSocket(this)) {
  patience_.setParent(this);
  patience_.setSingleShot(true);
  connect(&patience_, &QTimer::timeout, this,
          [this] { notConnected(where() + " did not answer within 3 s; check the network and the address"); });
  // Queued: a port of this machine may answer while connectToHost still runs, and openLine promises "later".
  connect(socket_, &QTcpSocket::connected, this, &TcpTransport::connected, Qt::QueuedConnection);
  connect(
      socket_, &QTcpSocket::errorOccurred, this, [this] { notConnected(connectError()); }, Qt::QueuedConnection);
  connect(socket_, &QTcpSocket::readyRead, this, [this] {
    if (isOpen()) received(socket_->readAll());
  });
  connect(socket_, &QTcpSocket::disconnected, this, [this] {
    if (isOpen()) lost(QString("%1:%2 closed the connection").arg(host_).arg(port_));
  });
}

std::string TcpTransport::where() const { return host_.toStdString() + ":" + std::to_string(port_); }

std::string TcpTransport::connectError() const {
  switch (socket_->error()) {
    case QAbstractSocket::ConnectionRefusedError:
      return "Nothing listens at " + where() + "; start the emulator or the bridge there, or correct the port";
    case QAbstractSocket::HostNotFoundError:
      return "There is no host named " + host_.toStdString();
    default:
      return "Cannot connect to " + where() + ": " + socket_->errorString().toStdString();
  }
}

Result<void> TcpTransport::openLine() {
  forgetLoss();
  opening_ = true;
  patience_.start(kConnectTimeout_ms);
  socket_->connectToHost(host_, port_);
  return {};
}

void TcpTransport::connected() {
  if (!opening_) return;
  opening_ = false;
  patience_.stop();
  if (socket_->state() != QAbstractSocket::ConnectedState) {
    lost(QString("%1:%2 closed the connection").arg(host_).arg(port_));
    return;
  }
  socket_->setSocketOption(QAbstractSocket::LowDelayOption, 1);
  openDevice();
  emit lineOpened();
  if (isOpen()) received(socket_->readAll());
}

void TcpTransport::notConnected(const std::string& why) {
  if (!opening_) return;
  opening_ = false;
  patience_.stop();
  socket_->abort();
  lost(QString::fromStdString(why));
}

void TcpTransport::close() {
  opening_ = false;
  patience_.stop();
  socket_->blockSignals(true);
  if (isOpen())
    socket_->disconnectFromHost();
  else
    socket_->abort();
  socket_->blockSignals(false);
  if (isOpen()) BufferedTransport::close();
}

qint64 TcpTransport::writeData(const char* from, qint64 size) {
  if (socket_->state() != QAbstractSocket::ConnectedState) return -1;
  const qint64 written = socket_->write(from, size);
  socket_->flush();
  return written;
}

}  // namespace fieldtrue::acquisition
