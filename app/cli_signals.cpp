#include "app/cli_signals.h"

#include <fcntl.h>
#include <unistd.h>

#include <QSocketNotifier>
#include <array>
#include <csignal>

#include "calib/core/error.h"

namespace fieldtrue::cli {
namespace {

constexpr std::array kSignals = {SIGINT, SIGTERM};
std::array<int, 2> signal_pipe = {-1, -1};

/// Only what a signal handler may do: one write, and the default action for the next signal.
void onSignal(int number) {
  const char byte = 1;
  [[maybe_unused]] const ssize_t written = ::write(signal_pipe[1], &byte, 1);
  std::signal(number, SIG_DFL);
}

}  // namespace

EndRequest::EndRequest(std::function<void()> on_request) {
  FT_CHECK(signal_pipe[0] < 0);
  FT_CHECK(::pipe2(signal_pipe.data(), O_CLOEXEC | O_NONBLOCK) == 0);
  notifier_ = std::make_unique<QSocketNotifier>(signal_pipe[0], QSocketNotifier::Read);
  QObject::connect(notifier_.get(), &QSocketNotifier::activated, notifier_.get(), [on_request = std::move(on_request)] {
    char byte = 0;
    if (::read(signal_pipe[0], &byte, 1) == 1) on_request();
  });
  for (const int number : kSignals) std::signal(number, onSignal);
}

EndRequest::~EndRequest() {
  for (const int number : kSignals) std::signal(number, SIG_DFL);
  notifier_.reset();
  for (int& end : signal_pipe) {
    ::close(end);
    end = -1;
  }
}

}  // namespace fieldtrue::cli
