#include "acquisition/transports/local_transport.h"

#include <poll.h>

#include <array>

namespace fieldtrue::acquisition {
namespace {

bool hungUp(int descriptor) {
  pollfd line{descriptor, POLLIN, 0};
  return ::poll(&line, 1, 0) > 0 && (line.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
}

}  // namespace

LocalTransport::LocalTransport(std::string path, int baud, std::vector<std::unique_ptr<LineDriver>> drivers,
                               QObject* parent)
    : BufferedTransport(parent), path_(std::move(path)), baud_(baud), drivers_(std::move(drivers)) {
  FT_CHECK(!drivers_.empty());
}

LocalTransport::~LocalTransport() { LocalTransport::close(); }

Result<void> LocalTransport::openLine() {
  Result<int> descriptor = fail(ErrorCode::kUnsupported, path_ + " is not a serial line");
  for (const auto& driver : drivers_) {
    descriptor = driver->open(path_, baud_);
    driver_ = driver.get();
    if (descriptor || descriptor.error().code != ErrorCode::kUnsupported) break;
  }
  if (!descriptor) {
    driver_ = nullptr;
    return fail(ErrorCode::kDevice, descriptor.error().message);
  }
  readable_ = std::make_unique<QSocketNotifier>(*descriptor, QSocketNotifier::Read);
  writable_ = std::make_unique<QSocketNotifier>(*descriptor, QSocketNotifier::Write);
  writable_->setEnabled(false);
  connect(readable_.get(), &QSocketNotifier::activated, this, &LocalTransport::readReady);
  connect(writable_.get(), &QSocketNotifier::activated, this, &LocalTransport::writePending);
  pending_.clear();
  openDevice();
  return {};
}

void LocalTransport::close() {
  if (!driver_) return;
  readable_.reset();
  writable_.reset();
  driver_->close();
  driver_ = nullptr;
  if (isOpen()) BufferedTransport::close();
}

void LocalTransport::readReady() {
  std::array<char, 4096> chunk;
  QByteArray bytes;
  long n = 0;
  while ((n = driver_->read(chunk.data(), chunk.size())) > 0) bytes.append(chunk.data(), static_cast<qsizetype>(n));
  // A pulled adapter reads as an error or, like a closed peer, as readable without bytes.
  const bool ended = n < 0 || (bytes.isEmpty() && hungUp(static_cast<int>(readable_->socket())));
  received(bytes);
  if (ended) gone();
}

qint64 LocalTransport::writeData(const char* from, qint64 size) {
  if (!driver_ || isLost()) return -1;
  pending_.append(from, size);
  writePending();
  return isLost() ? -1 : size;
}

void LocalTransport::writePending() {
  while (!pending_.isEmpty()) {
    const long n = driver_->write(pending_.constData(), static_cast<std::size_t>(pending_.size()));
    if (n < 0) return gone();
    if (n == 0) break;
    pending_.remove(0, static_cast<qsizetype>(n));
  }
  writable_->setEnabled(!pending_.isEmpty());
}

void LocalTransport::gone() {
  if (readable_) readable_->setEnabled(false);
  if (writable_) writable_->setEnabled(false);
  lost(QString::fromStdString(path_) + " is gone: it was unplugged or its other end was closed");
}

void LocalTransport::setRequestToSend(bool on) {
  if (driver_) driver_->setRequestToSend(on);
}

void LocalTransport::setBreak(bool on) {
  if (driver_) driver_->setBreak(on);
}

bool LocalTransport::setBaud(int baud) { return driver_ && driver_->setBaud(baud); }

}  // namespace fieldtrue::acquisition
