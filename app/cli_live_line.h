#pragma once

#include <string>

#include "acquisition/session/acquisition_controller.h"

namespace fieldtrue::cli {

/// What the tracker does now, on a terminal's last line; nothing where there is no terminal.
class LiveLine {
 public:
  LiveLine();
  LiveLine(const LiveLine&) = delete;
  LiveLine& operator=(const LiveLine&) = delete;
  ~LiveLine();

  void show(const acquisition::AcquisitionStatus& status);
  void clear();

 private:
  bool terminal_;
  std::string shown_;
};

}  // namespace fieldtrue::cli
