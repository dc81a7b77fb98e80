#include "app/cli_live_line.h"

#include <unistd.h>

#include <iostream>

namespace fieldtrue::cli {

LiveLine::LiveLine() : terminal_(isatty(STDERR_FILENO) != 0) {}

LiveLine::~LiveLine() { clear(); }

void LiveLine::show(const acquisition::AcquisitionStatus& status) {
  if (!terminal_) return;
  std::string text;
  if (status.take == acquisition::TakeState::kCollecting)
    text = std::to_string(status.collected) + "/" + std::to_string(status.wanted) + "  ";
  text += status.reason.toStdString();
  if (text == shown_) return;
  shown_ = text;
  std::cerr << "\r\033[K" << text << std::flush;
}

void LiveLine::clear() {
  if (!shown_.empty()) std::cerr << "\r\033[K" << std::flush;
  shown_.clear();
}

}  // namespace fieldtrue::cli
