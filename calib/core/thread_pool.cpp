#include "calib/core/thread_pool.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace fieldtrue {
namespace {

thread_local bool inside_parallel_loop = false;

/// The shared state of one loop: who takes which index, and the first thing that went wrong.
class Loop {
 public:
  Loop(std::size_t count, const std::function<void(std::size_t)>& body) : count_(count), body_(body) {}

  void work() {
    inside_parallel_loop = true;
    try {
      for (std::size_t i = next_++; i < count_; i = next_++) body_(i);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!error_) error_ = std::current_exception();
      next_ = count_;
    }
    inside_parallel_loop = false;
  }

  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  std::size_t count_;
  const std::function<void(std::size_t)>& body_;
  std::atomic<std::size_t> next_ = 0;
  std::mutex mutex_;
  std::exception_ptr error_;
};

}  // namespace

int threadCount(int requested) {
  if (requested > 0) return requested;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

ParallelFor threadedFor(int threads) {
  const auto n_threads = static_cast<std::size_t>(threadCount(threads));
  return [n_threads](std::size_t count, const std::function<void(std::size_t)>& body) {
    const std::size_t n_helpers = std::min(n_threads, count) - (count > 0 ? 1 : 0);
    if (inside_parallel_loop || n_helpers == 0) {
      serialFor(count, body);
      return;
    }
    Loop loop(count, body);
    {
      std::vector<std::jthread> helpers;
      helpers.reserve(n_helpers);
      try {
        for (std::size_t i = 0; i < n_helpers; ++i) helpers.emplace_back([&loop] { loop.work(); });
      } catch (const std::system_error&) {
        // The system grants no more threads: those that run, and this one, do all the work.
      }
      loop.work();
    }
    loop.rethrow();
  };
}

}  // namespace fieldtrue
