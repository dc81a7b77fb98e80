#include "tests/blind/subprocess.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>

extern char** environ;

namespace blind {

namespace {

using Clock = std::chrono::steady_clock;

/// Reads to the end of a pipe. @return false where the deadline came before
bool isReadToEnd(int pipe, std::optional<Clock::time_point> deadline, std::string& output) {
  std::array<char, 4096> buffer{};
  while (true) {
    int wait_ms = -1;
    if (deadline)
      wait_ms = static_cast<int>(
          std::max<std::int64_t>(0, std::chrono::ceil<std::chrono::milliseconds>(*deadline - Clock::now()).count()));
    pollfd waited{pipe, POLLIN, 0};
    const int ready = ::poll(&waited, 1, wait_ms);
    if (ready == 0) return false;
    if (ready < 0 && errno == EINTR) continue;
    const ssize_t got = ::read(pipe, buffer.data(), buffer.size());
    if (got <= 0) return true;
    output.append(buffer.data(), static_cast<std::size_t>(got));
  }
}

}  // namespace

Finished runProgram(const std::vector<std::string>& words, std::optional<double> limit_s) {
  std::vector<std::string> copies = words;
  std::vector<char*> arguments;
  for (std::string& word : copies) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return {127, ""};
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t pid = 0;
  const int trouble = ::posix_spawn(&pid, arguments[0], &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  Finished finished;
  std::optional<Clock::time_point> deadline;
  if (limit_s)
    deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(*limit_s));
  if (trouble == 0 && !isReadToEnd(ends[0], deadline, finished.output)) ::kill(pid, SIGKILL);
  ::close(ends[0]);
  int raw = 0;
  if (trouble != 0 || ::waitpid(pid, &raw, 0) < 0) return {127, ""};
  finished.exit_status = WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw);
  return finished;
}

}  // namespace blind
