#pragma once

#include <QByteArray>
#include <QObject>
#include <QSocketNotifier>
#include <QTcpServer>
#include <deque>
#include <memory>

#include "acquisition/transports/loopback_transport.h"
#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// The emulated device's end of a line.
class EmulatorEndpoint : public QObject {
  Q_OBJECT
 public:
  using QObject::QObject;
  /// Makes the line ready for a host. @error kIo, kDevice, one sentence
  virtual Result<void> open() = 0;
  /// Sends in one write; nothing is dropped while a host listens.
  virtual void send(const QByteArray& bytes) = 0;
  /// Pulls the cable: the host loses the line.
  virtual void unplug() = 0;
  /// What a host opens: a path, or tcp:HOST:PORT.
  virtual QString address() const = 0;

 signals:
  void received(const QByteArray& bytes);
  /// A host has connected, where the line tells so (TCP).
  void hostCame();
  /// Something the person who started the emulator should know.
  void notice(const QString& text);
};

/// A TCP port; one host at a time, a second one is turned away.
class TcpEndpoint : public EmulatorEndpoint {
  Q_OBJECT
 public:
  /// @param port 0 = any free one
  explicit TcpEndpoint(quint16 port, QObject* parent = nullptr);
  Result<void> open() override;
  void send(const QByteArray& bytes) override;
  void unplug() override;
  QString address() const override;

 private:
  void accept();
  quint16 port_;
  QTcpServer server_;
  QTcpSocket* host_ = nullptr;
};

/// A line inside this process.
class LoopbackEndpoint : public EmulatorEndpoint {
  Q_OBJECT
 public:
  /// @param device_end the other end of the pair is the host's transport
  explicit LoopbackEndpoint(std::unique_ptr<LoopbackTransport> device_end, QObject* parent = nullptr);
  Result<void> open() override;
  void send(const QByteArray& bytes) override;
  void unplug() override;
  QString address() const override { return QStringLiteral("in this program"); }

 private:
  LoopbackTransport* line_;
};

}  // namespace fieldtrue::acquisition
