#pragma once

#include <QSocketNotifier>
#include <deque>
#include <memory>

#include "acquisition/emulators/emulator_endpoint.h"

namespace fieldtrue::acquisition {

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

}  // namespace fieldtrue::acquisition
