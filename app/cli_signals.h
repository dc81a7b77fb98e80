#pragma once

#include <functional>
#include <memory>

class QSocketNotifier;

namespace fieldtrue::cli {

/// Turns SIGINT and SIGTERM into a call on the event loop, so that files and links are left in order. At most one at a
/// time; the signals act as usual again when it is gone. A second signal while the first is served ends the program.
class EndRequest {
 public:
  explicit EndRequest(std::function<void()> on_request);
  EndRequest(const EndRequest&) = delete;
  EndRequest& operator=(const EndRequest&) = delete;
  ~EndRequest();

 private:
  std::unique_ptr<QSocketNotifier> notifier_;
};

}  // namespace fieldtrue::cli
