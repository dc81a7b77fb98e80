#include "acquisition/transports/buffered_transport.h"

#include <algorithm>
#include <cstring>

namespace fieldtrue::acquisition {

qint64 BufferedTransport::readData(char* to, qint64 size) {
  const qint64 n = std::min<qint64>(size, received_.size());
  std::memcpy(to, received_.constData(), static_cast<std::size_t>(n));
  received_.remove(0, n);
  return n;
}

void BufferedTransport::received(const QByteArray& bytes) {
  if (bytes.isEmpty()) return;
  received_.append(bytes);
  emit readyRead();
}

void BufferedTransport::lost(const QString& reason) {
  if (lost_) return;
  lost_ = true;
  emit lineLost(reason);
}

void BufferedTransport::openDevice() {
  lost_ = false;
  received_.clear();
  QIODevice::open(QIODevice::ReadWrite | QIODevice::Unbuffered);
}

}  // namespace fieldtrue::acquisition
