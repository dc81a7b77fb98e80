#pragma once

#include <QPointer>
#include <memory>
#include <utility>

#include "acquisition/transports/buffered_transport.h"

namespace fieldtrue::acquisition {

/// One end of a line inside this process: what is written to one end is read at the other once control is back
/// in the event loop.
class LoopbackTransport : public BufferedTransport {
  Q_OBJECT
 public:
  /// Two connected ends; they live in one thread.
  static std::pair<std::unique_ptr<LoopbackTransport>, std::unique_ptr<LoopbackTransport>> pair();
  ~LoopbackTransport() override;
  Result<void> openLine() override;
  /// Ends the line as if its cable was pulled: the other end loses it.
  void unplug();

 protected:
  qint64 writeData(const char* from, qint64 size) override;

 private:
  LoopbackTransport() = default;
  void deliverLater(const QByteArray& bytes);

  QByteArray on_the_way_;
  QPointer<LoopbackTransport> other_;
};

}  // namespace fieldtrue::acquisition
