#pragma once

#include <QByteArray>
#include <QObject>
#include <QSocketNotifier>
#include <QTcpServer>
#include <deque>
#include <memory>

#include "acquisition/transports/loopback_transport.h"
#include "calib/core/error.h"

namespace fieldtrue {

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
  /// Something the person who started the emulator should know.
  void notice(const QString& text);
};

/// A pseudo-terminal behind a symbolic link.
class PtyEndpoint : public EmulatorEndpoint {
  Q_OBJECT
 public:
  /// @param link path of the symbolic link to make; empty = none, the host opens the terminal's own path
  explicit PtyEndpoint(QString link, QObject* parent = nullptr);
  ~PtyEndpoint() override;
  Result<void> open() override;
  void send(const QByteArray& bytes) override;
  void unplug() override;
  QString address() const override { return link_.isEmpty() ? terminal_ : link_; }
  QString terminal() const { return terminal_; }

 private:
  Result<void> openTerminal();
  Result<void> publishLink();
  void readReady();
  void writePending();
  void close();

  QString link_;
  QString terminal_;
  int master_ = -1;
  int slave_ = -1;  ///< Our own, so that the master reads no error while no host is there.
  bool host_seen_ = false;
  bool link_made_ = false;
  std::unique_ptr<QSocketNotifier> readable_;
  std::unique_ptr<QSocketNotifier> writable_;
  std::deque<QByteArray> pending_;
  qsizetype pending_bytes_ = 0;
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

}  // namespace fieldtrue
