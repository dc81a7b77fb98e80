#pragma once

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <vector>

#include "calib/core/error.h"

namespace fieldtrue::testing {

/// A port of this machine that lets nobody in and turns nobody away: its queue is full, and a further host waits for an
/// answer as it would for a machine that is switched off.
class SilentPort {
 public:
  SilentPort() {
    address_.sin_family = AF_INET;
    address_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    sockets_.push_back(::socket(AF_INET, SOCK_STREAM, 0));
    socklen_t size = sizeof address_;
    FT_CHECK(::bind(sockets_[0], asSocketAddress(), size) == 0 && ::listen(sockets_[0], 0) == 0);
    FT_CHECK(::getsockname(sockets_[0], asSocketAddress(), &size) == 0);
    while (isAnswered()) FT_CHECK(sockets_.size() < 100);
  }
  SilentPort(const SilentPort&) = delete;
  SilentPort& operator=(const SilentPort&) = delete;
  ~SilentPort() {
    for (const int socket : sockets_) ::close(socket);
  }
  int number() const { return ntohs(address_.sin_port); }

 private:
  sockaddr* asSocketAddress() { return reinterpret_cast<sockaddr*>(&address_); }
  bool isAnswered() {
    sockets_.push_back(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0));
    if (::connect(sockets_.back(), asSocketAddress(), sizeof address_) == 0) return true;
    pollfd waiting{sockets_.back(), POLLOUT, 0};
    return ::poll(&waiting, 1, 200) == 1;
  }

  sockaddr_in address_{};
  std::vector<int> sockets_;
};

}  // namespace fieldtrue::testing
