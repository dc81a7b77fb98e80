#include "acquisition/emulators/pty_endpoint.h"

#include <fcntl.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <QFile>
#include <QFileInfo>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "acquisition/emulators/emulator_endpoint.h"

namespace fieldtrue::acquisition {
namespace {

/// Over a quarter of an hour of unread records: the host has gone without stopping the stream.
constexpr qsizetype kAbandonedBytes = qsizetype{4} << 20;

}  // namespace

PtyEndpoint::PtyEndpoint(QString link, QObject* parent) : EmulatorEndpoint(parent), link_(std::move(link)) {}

PtyEndpoint::~PtyEndpoint() { close(); }

Result<void> PtyEndpoint::open() {
  auto opened = openTerminal();
  if (opened) opened = publishLink();
  if (!opened) {
    close();
    return opened;
  }
  readable_ = std::make_unique<QSocketNotifier>(master_, QSocketNotifier::Read);
  writable_ = std::make_unique<QSocketNotifier>(master_, QSocketNotifier::Write);
  writable_->setEnabled(false);
  connect(readable_.get(), &QSocketNotifier::activated, this, &PtyEndpoint::readReady);
  connect(writable_.get(), &QSocketNotifier::activated, this, &PtyEndpoint::writePending);
  return {};
}

Result<void> PtyEndpoint::openTerminal() {
  master_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  std::array<char, 128> name{};
  if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0 ||
      ::ptsname_r(master_, name.data(), name.size()) != 0) {
    return fail(ErrorCode::kIo, std::string("Cannot make a pseudo-terminal: ") + std::strerror(errno));
  }
  terminal_ = QString::fromLocal8Bit(name.data());
  slave_ = ::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios settings{};
  if (slave_ < 0 || ::tcgetattr(slave_, &settings) != 0) {
    return fail(ErrorCode::kIo, "Cannot open " + terminal_.toStdString() + ": " + std::strerror(errno));
  }
  // Raw before anybody can open it: an echoing terminal would send the records back as commands.
  ::cfmakeraw(&settings);
  ::tcsetattr(slave_, TCSANOW, &settings);
  return {};
}

Result<void> PtyEndpoint::publishLink() {
  if (link_.isEmpty()) return {};
  const QByteArray path = QFile::encodeName(link_);
  if (QFileInfo(link_).isSymLink()) {
    ::unlink(path.constData());
  } else if (QFileInfo::exists(link_)) {
    return fail(ErrorCode::kIo, link_.toStdString() + " exists and is not a link; choose another name with --pty");
  }
  if (::symlink(QFile::encodeName(terminal_).constData(), path.constData()) != 0) {
    return fail(ErrorCode::kIo, "Cannot make the link " + link_.toStdString() + ": " + std::strerror(errno));
  }
  link_made_ = true;
  return {};
}

void PtyEndpoint::readReady() {
  std::array<char, 4096> chunk;
  const ssize_t n = ::read(master_, chunk.data(), chunk.size());
  if (n <= 0) return;
  host_seen_ = true;
  emit received(QByteArray(chunk.data(), static_cast<qsizetype>(n)));
}

void PtyEndpoint::send(const QByteArray& bytes) {
  if (master_ < 0) return;
  pending_.push_back(bytes);
  pending_bytes_ += bytes.size();
  writePending();
  // Before a host has spoken nobody listens, as on a line with nothing at its end.
  const bool abandoned = pending_bytes_ > kAbandonedBytes;
  if (!pending_.empty() && (!host_seen_ || abandoned)) {
    pending_.clear();
    pending_bytes_ = 0;
    writable_->setEnabled(false);
    if (abandoned) emit notice("Nobody reads " + address() + ": the unread records were thrown away.");
  }
}

void PtyEndpoint::writePending() {
  while (!pending_.empty()) {
    QByteArray& first = pending_.front();
    const ssize_t n = ::write(master_, first.constData(), static_cast<std::size_t>(first.size()));
    if (n <= 0) break;
    pending_bytes_ -= n;
    if (n == first.size()) {
      pending_.pop_front();
    } else {
      first.remove(0, n);
    }
  }
  writable_->setEnabled(!pending_.empty());
}

void PtyEndpoint::unplug() { close(); }

void PtyEndpoint::close() {
  readable_.reset();
  writable_.reset();
  pending_.clear();
  pending_bytes_ = 0;
  if (link_made_) ::unlink(QFile::encodeName(link_).constData());
  link_made_ = false;
  if (slave_ >= 0) ::close(std::exchange(slave_, -1));
  if (master_ >= 0) ::close(std::exchange(master_, -1));
}

}  // namespace fieldtrue::acquisition
