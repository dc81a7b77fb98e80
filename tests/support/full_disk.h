#pragma once

#include <signal.h>
#include <sys/resource.h>

namespace fieldtrue::testing {

/// No file that this program writes grows beyond so many bytes while it lives: what a full disk does, without one.
class FullDisk {
 public:
  explicit FullDisk(rlim_t most_bytes) {
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit full{most_bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &full);
  }
  ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
};

}  // namespace fieldtrue::testing
