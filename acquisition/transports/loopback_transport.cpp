#include "acquisition/transports/loopback_transport.h"

namespace fieldtrue::acquisition {

std::pair<std::unique_ptr<LoopbackTransport>, std::unique_ptr<LoopbackTransport>> LoopbackTransport::pair() {
  std::unique_ptr<LoopbackTransport> a(new LoopbackTransport);
  std::unique_ptr<LoopbackTransport> b(new LoopbackTransport);
  a->other_ = b.get();
  b->other_ = a.get();
  return {std::move(a), std::move(b)};
}

LoopbackTransport::~LoopbackTransport() { unplug(); }

Result<void> LoopbackTransport::openLine() {
  if (!other_) return fail(ErrorCode::kDevice, "The other end of the line inside this program is gone");
  openDevice();
  return {};
}

void LoopbackTransport::unplug() {
  if (!other_) return;
  LoopbackTransport* other = other_.data();
  other->other_.clear();
  other_.clear();
  QMetaObject::invokeMethod(
      other, [other] { other->lost("The line inside this program was unplugged"); }, Qt::QueuedConnection);
}

qint64 LoopbackTransport::writeData(const char* from, qint64 size) {
  if (!other_) return -1;
  other_->deliverLater(QByteArray(from, size));
  return size;
}

void LoopbackTransport::deliverLater(const QByteArray& bytes) {
  const bool announced = !on_the_way_.isEmpty();
  on_the_way_ += bytes;
  if (announced) return;
  QMetaObject::invokeMethod(
      this,
      [this] {
        const QByteArray arrived = std::exchange(on_the_way_, {});
        if (isOpen()) received(arrived);
      },
      Qt::QueuedConnection);
}

}  // namespace fieldtrue::acquisition
