#include "tests/blind/side_by_side.h"

#include <atomic>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

namespace blind {

void sideBySide(std::size_t jobs, std::size_t count, const std::function<std::string(std::size_t)>& name_of,
                const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next{0};
  std::mutex guard;
  std::string problem;
  const auto worker = [&] {
    for (std::size_t n = next++; n < count; n = next++) try {
        work(n);
      } catch (const std::exception& error) {
        const std::lock_guard lock(guard);
        if (problem.empty()) problem = name_of(n) + ": " + error.what();
        next = count;
      }
  };
  std::vector<std::thread> threads;
  for (std::size_t t = 1; t < jobs; ++t) threads.emplace_back(worker);
  worker();
  for (std::thread& thread : threads) thread.join();
  if (!problem.empty()) throw std::runtime_error(problem);
}

}  // namespace blind
