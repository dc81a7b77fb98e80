#pragma once

#include <QByteArray>

#include "acquisition/transports/transport.h"

namespace fieldtrue::acquisition {

/// The part every transport shares: a buffer of what came, and losing the line once.
class BufferedTransport : public Transport {
  Q_OBJECT
 public:
  using Transport::Transport;
  qint64 bytesAvailable() const override { return received_.size() + QIODevice::bytesAvailable(); }

 protected:
  qint64 readData(char* to, qint64 size) override;
  /// Takes bytes in and tells the reader.
  void received(const QByteArray& bytes);
  /// Tells once that the line is gone; what came before can still be read.
  void lost(const QString& reason);
  void openDevice();
  void forgetLoss() { lost_ = false; }  ///< Before a line is opened anew.
  bool isLost() const { return lost_; }

 private:
  QByteArray received_;
  bool lost_ = false;
};

}  // namespace fieldtrue::acquisition
