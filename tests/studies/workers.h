#pragma once

#include <atomic>
#include <chrono>
#include <cstdio>
#include <functional>
#include <thread>
#include <vector>

namespace fieldtrue::testing {

/// Runs body(0) to body(count - 1) on some threads and tells on stderr how far it is.
inline void inParallel(int threads, std::size_t count, const char* what, const std::function<void(std::size_t)>& body) {
  std::atomic<std::size_t> next{0};
  std::atomic<std::size_t> done{0};
  const auto start = std::chrono::steady_clock::now();
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      body(i);
      const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      std::fprintf(stderr, "%s: %zu of %zu after %.0f s\n", what, ++done, count, elapsed_s);
    }
  };
  std::vector<std::jthread> workers;
  for (int i = 1; i < threads; ++i) workers.emplace_back(work);
  work();
}

}  // namespace fieldtrue::testing
