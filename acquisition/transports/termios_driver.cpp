#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "acquisition/transports/line_driver.h"
#include "acquisition/transports/line_errors.h"

namespace fieldtrue::acquisition {
namespace {

constexpr std::pair<int, speed_t> kSpeeds[] = {
    {1200, B1200},     {2400, B2400},     {4800, B4800},     {9600, B9600},       {19200, B19200},
    {38400, B38400},   {57600, B57600},   {115200, B115200}, {230400, B230400},   {460800, B460800},
    {500000, B500000}, {576000, B576000}, {921600, B921600}, {1000000, B1000000},
};

bool setSpeed(termios& settings, int baud) {
  for (const auto& [rate, constant] : kSpeeds) {
    if (rate != baud) continue;
    return ::cfsetispeed(&settings, constant) == 0 && ::cfsetospeed(&settings, constant) == 0;
  }
  return false;
}

class TermiosDriver : public LineDriver {
 public:
  ~TermiosDriver() override { TermiosDriver::close(); }

  Result<int> open(const std::string& path, int baud) override {
    descriptor_ = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (descriptor_ < 0) return tl::unexpected(lineOpenError(path, errno));
    pseudo_terminal_ = isPseudoTerminal(path);
    auto ready = configure(path, baud);
    if (!ready) {
      close();
      return tl::unexpected(ready.error());
    }
    return descriptor_;
  }

  void close() override {
    if (descriptor_ < 0) return;
    if (!pseudo_terminal_) ::ioctl(descriptor_, TIOCNXCL);
    ::close(descriptor_);
    descriptor_ = -1;
  }

  long read(char* to, std::size_t size) override {
    const ssize_t n = ::read(descriptor_, to, size);
    if (n > 0) return n;
    return n < 0 && (errno == EAGAIN || errno == EINTR) ? 0 : -1;
  }

  long write(const char* from, std::size_t size) override {
    const ssize_t n = ::write(descriptor_, from, size);
    if (n >= 0) return n;
    return errno == EAGAIN || errno == EINTR ? 0 : -1;
  }

  bool setBaud(int baud) override {
    termios settings{};
    if (pseudo_terminal_ || ::tcgetattr(descriptor_, &settings) != 0) return false;
    return setSpeed(settings, baud) && ::tcsetattr(descriptor_, TCSANOW, &settings) == 0;
  }

  void setRequestToSend(bool on) override {
    int line = TIOCM_RTS;
    ::ioctl(descriptor_, on ? TIOCMBIS : TIOCMBIC, &line);
  }

  void setBreak(bool on) override { ::ioctl(descriptor_, on ? TIOCSBRK : TIOCCBRK); }

 private:
  Result<void> configure(const std::string& path, int baud) {
    termios settings{};
    if (::tcgetattr(descriptor_, &settings) != 0) return tl::unexpected(lineOpenError(path, errno));
    if (auto locked = lockLine(path, descriptor_); !locked) return locked;
    ::cfmakeraw(&settings);
    settings.c_cflag |= CLOCAL | CREAD;
    settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
    settings.c_cc[VMIN] = 1;
    settings.c_cc[VTIME] = 0;
    if ((!setSpeed(settings, baud) && !pseudo_terminal_) || ::tcsetattr(descriptor_, TCSANOW, &settings) != 0) {
      return fail(ErrorCode::kDevice, path + " cannot be set to " + std::to_string(baud) +
                                          " baud; the tracker's rates are 2400 4800 9600 19200 38400 57600 115200");
    }
    return {};
  }

  int descriptor_ = -1;
  bool pseudo_terminal_ = false;
};

}  // namespace

std::unique_ptr<LineDriver> makeTermiosDriver() { return std::make_unique<TermiosDriver>(); }

}  // namespace fieldtrue::acquisition
