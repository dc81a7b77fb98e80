#include "acquisition/emulators/emulator_endpoint.h"

#include <QHostAddress>
#include <QTcpSocket>

namespace fieldtrue::acquisition {

TcpEndpoint::TcpEndpoint(quint16 port, QObject* parent) : EmulatorEndpoint(parent), port_(port) {
  connect(&server_, &QTcpServer::newConnection, this, &TcpEndpoint::accept);
}

Result<void> TcpEndpoint::open() {
  if (!server_.listen(QHostAddress::LocalHost, port_)) {
    return fail(ErrorCode::kIo, "Cannot listen on port " + std::to_string(port_) + ": " +
                                    server_.errorString().toStdString() + "; choose another with --listen");
  }
  port_ = server_.serverPort();
  return {};
}

void TcpEndpoint::accept() {
  QTcpSocket* host = server_.nextPendingConnection();
  if (host_) {
    emit notice("A second program was turned away: one host is connected already.");
    host->abort();
    host->deleteLater();
    return;
  }
  host_ = host;
  host_->setSocketOption(QAbstractSocket::LowDelayOption, 1);
  connect(host_, &QTcpSocket::readyRead, this, [this] { emit received(host_->readAll()); });
  connect(host_, &QTcpSocket::disconnected, this, [this, host] {
    host->deleteLater();
    if (host_ == host) host_ = nullptr;
  });
  emit hostCame();
}

void TcpEndpoint::send(const QByteArray& bytes) {
  if (!host_) return;
  host_->write(bytes);
  host_->flush();
}

void TcpEndpoint::unplug() {
  server_.close();
  if (host_) host_->disconnectFromHost();
}

QString TcpEndpoint::address() const { return QString("tcp:localhost:%1").arg(port_); }

LoopbackEndpoint::LoopbackEndpoint(std::unique_ptr<LoopbackTransport> device_end, QObject* parent)
    : EmulatorEndpoint(parent), line_(device_end.release()) {
  line_->setParent(this);
  connect(line_, &QIODevice::readyRead, this, [this] { emit received(line_->readAll()); });
}

Result<void> LoopbackEndpoint::open() { return line_->openLine(); }

void LoopbackEndpoint::send(const QByteArray& bytes) { line_->write(bytes); }

void LoopbackEndpoint::unplug() { line_->unplug(); }

}  // namespace fieldtrue::acquisition
