#pragma once

#include <memory>

#include "acquisition/transports/buffered_transport.h"
#include "acquisition/transports/loopback_transport.h"

namespace fieldtrue::testing {

/// A line whose bytes only make sense at one rate.
class RatedLine : public acquisition::BufferedTransport {
 public:
  RatedLine(std::unique_ptr<acquisition::LoopbackTransport> inner, int right_baud, int baud)
      : inner_(std::move(inner)), right_baud_(right_baud), baud_(baud) {
    connect(inner_.get(), &QIODevice::readyRead, this, [this] {
      const QByteArray bytes = inner_->readAll();
      received(baud_ == right_baud_ ? bytes : QByteArray(bytes.size(), '\xF8'));
    });
  }
  Result<void> openLine() override {
    openDevice();
    return inner_->openLine();
  }
  bool setBaud(int baud) override {
    baud_ = baud;
    return true;
  }

 protected:
  qint64 writeData(const char* from, qint64 size) override {
    inner_->write(baud_ == right_baud_ ? QByteArray(from, size) : QByteArray(size, '\xFE'));
    return size;
  }

 private:
  std::unique_ptr<acquisition::LoopbackTransport> inner_;
  int right_baud_;
  int baud_;
};

}  // namespace fieldtrue::testing
