#include "tests/blind/answer.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <thread>

#include "tests/blind/file_lock.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/sha256.h"
#include "tests/blind/temporary_folder.h"

namespace blind {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::json;
namespace fs = std::filesystem;

constexpr int kTimedOut = 124;

struct Request {
  fs::path folder;
  fs::path cli;
  std::size_t jobs = 1;
  std::size_t from = 1;
  std::size_t to = 0;
  double limit_s = 600.0;
  bool replaces = false;
};

/// A folder with the tables of one session under names that tell nothing.
class Desk {
 public:
  Desk(const fs::path& folder, const std::string& file) {
    replaceFile(path() / "nodes.csv", textOf(folder / (file + ".nodes.csv")));
    const fs::path samples = folder / (file + ".samples.csv");
    has_samples_ = fs::exists(samples);
    if (has_samples_) replaceFile(path() / "samples.csv", textOf(samples));
  }

  const fs::path& path() const { return folder_.path(); }
  bool hasSamples() const { return has_samples_; }
  fs::path report() const { return path() / "report.gap.json"; }
  fs::path scene() const { return path() / "updated.scene.json"; }

 private:
  TemporaryFolder folder_;
  bool has_samples_ = false;
};

struct Running {
  pid_t pid = 0;
  std::string file;
  Clock::time_point start;
  std::unique_ptr<Desk> desk;
};

double positiveNumber(const std::string& option, const std::string& text) {
  std::size_t used = 0;
  double value = 0.0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used != text.size() || !(value > 0.0) || value > 1e9)
    throw std::invalid_argument("answer: " + option + " needs a number above 0, got '" + text + "'");
  return value;
}

Request requestOf(std::span<const std::string> words) {
  static constexpr std::string_view kWithValue[] = {"--in", "--cli", "--jobs", "--from", "--to", "--limit"};
  static constexpr std::string_view kFlags[] = {"--again"};
  const auto options = optionsOf(words, "answer", kWithValue, kFlags);
  Request request;
  for (const auto& [option, text] : options) {
    if (option == "--in") request.folder = text;
    if (option == "--cli") request.cli = text;
    if (option == "--again") request.replaces = true;
    if (option == "--limit") request.limit_s = positiveNumber(option, text);
    if (option == "--jobs") request.jobs = static_cast<std::size_t>(std::max(1.0, positiveNumber(option, text)));
    if (option == "--from") request.from = static_cast<std::size_t>(std::max(1.0, positiveNumber(option, text)));
    if (option == "--to") request.to = static_cast<std::size_t>(std::max(1.0, positiveNumber(option, text)));
  }
  if (request.folder.empty()) throw std::invalid_argument("answer: --in DIR is needed");
  request.cli = request.cli.empty() ? fs::path() : fs::absolute(request.cli);
  if (request.cli.empty()) request.cli = fs::read_symlink("/proc/self/exe").parent_path() / "fieldtrue-cli";
  return request;
}

std::vector<std::string> filesOf(const json& truth, const Request& request) {
  std::vector<std::string> files;
  const json& sessions = truth.at("sessions");
  const std::size_t last = request.to == 0 ? sessions.size() : std::min(request.to, sessions.size());
  for (std::size_t at = request.from; at <= last; ++at) files.push_back(sessions[at - 1].at("file").get<std::string>());
  if (files.empty())
    throw std::runtime_error("sessions " + std::to_string(request.from) + " to " + std::to_string(last) +
                             ": the set holds none of them");
  return files;
}

json recordsIn(const fs::path& folder) {
  const fs::path path = folder / "answers.json";
  if (!fs::exists(path)) return {{"sessions", json::array()}};
  json records = documentOf(path);
  if (!records.is_object() || !records.contains("sessions") || !records["sessions"].is_array())
    throw std::runtime_error(path.string() + " holds no list of sessions");
  return records;
}

/// What has a record is answered; a report without one is left over from a run that was stopped.
std::vector<std::string> unanswered(const Request& request, const std::vector<std::string>& files) {
  if (request.replaces) return files;
  const json records = recordsIn(request.folder);
  const json& list = records["sessions"];
  std::vector<std::string> open;
  for (const std::string& file : files)
    if (std::none_of(list.begin(), list.end(), [&](const json& record) { return record.value("file", "") == file; }))
      open.push_back(file);
  return open;
}

/// Copies a file and tells its hash.
std::string keptSha256(const fs::path& from, const fs::path& to) {
  const std::string text = textOf(from);
  replaceFile(to, text);
  return sha256Hex(text);
}

void recordAnswer(const Request& request, const Running& done, double seconds, int status) {
  const fs::path report = request.folder / (done.file + ".gap.json");
  json entry = {{"file", done.file}, {"seconds", seconds}, {"exit_status", status}};
  const fs::path scene = request.folder / (done.file + ".scene.json");
  if (status == 0 && fs::exists(done.desk->report()) && fs::exists(done.desk->scene())) {
    entry["answer_sha256"] = keptSha256(done.desk->report(), report);
    entry["scene_sha256"] = keptSha256(done.desk->scene(), scene);
  } else {
    fs::remove(report);
    fs::remove(scene);
  }
  const FileLock lock(request.folder / "answers.lock");
  json records = recordsIn(request.folder);
  json& list = records["sessions"];
  const auto old =
      std::find_if(list.begin(), list.end(), [&](const json& record) { return record.value("file", "") == done.file; });
  if (old != list.end())
    *old = entry;
  else
    list.push_back(entry);
  std::sort(list.begin(), list.end(),
            [](const json& a, const json& b) { return a.value("file", "") < b.value("file", ""); });
  replaceFile(request.folder / "answers.json", records.dump(1));
}

[[noreturn]] void becomeDiagnosis(std::vector<std::string>& words, const fs::path& folder,
                                  const std::string& log_path) {
  const int nothing = ::open("/dev/null", O_RDWR);
  const int log = ::open(log_path.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0644);
  if (nothing >= 0) {
    ::dup2(nothing, STDIN_FILENO);
    ::dup2(nothing, STDOUT_FILENO);
  }
  if (log >= 0) ::dup2(log, STDERR_FILENO);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  if (::chdir(folder.c_str()) == 0) ::execv(arguments[0], arguments.data());
  ::_exit(127);
}

Running startDiagnosis(const Request& request, const std::string& file) {
  Running running{0, file, {}, std::make_unique<Desk>(request.folder, file)};
  std::vector<std::string> words = {request.cli.string(), "diagnose", "--nodes", "nodes.csv"};
  if (running.desk->hasSamples()) words.insert(words.end(), {"--samples", "samples.csv"});
  words.insert(words.end(), {"--out", running.desk->report().filename().string(), "--updated-scene",
                             running.desk->scene().filename().string(), "--threads", "1"});
  const std::string log_path = fs::absolute(request.folder / (file + ".stderr")).string();
  running.start = Clock::now();
  running.pid = ::fork();
  if (running.pid < 0) throw std::runtime_error("cannot start another process");
  if (running.pid == 0) becomeDiagnosis(words, running.desk->path(), log_path);
  return running;
}

/// @return true when the process has ended and its answer was recorded
bool wasCollected(const Request& request, const Running& running, std::size_t& failed) {
  int raw = 0;
  const double seconds = std::chrono::duration<double>(Clock::now() - running.start).count();
  const bool is_late = seconds > request.limit_s;
  if (is_late) ::kill(running.pid, SIGKILL);
  if (::waitpid(running.pid, &raw, is_late ? 0 : WNOHANG) == 0) return false;
  const int status = is_late ? kTimedOut : WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw);
  const fs::path log_path = request.folder / (running.file + ".stderr");
  if (status == 0) {
    fs::remove(log_path);
  } else {
    ++failed;
    std::cerr << running.file << ": exit status " << status << ", see " << log_path.string() << "\n";
  }
  recordAnswer(request, running, seconds, status);
  return true;
}

std::size_t answerAll(const Request& request, const std::vector<std::string>& files) {
  std::vector<Running> running;
  std::size_t next = 0;
  std::size_t failed = 0;
  while (next < files.size() || !running.empty()) {
    while (next < files.size() && running.size() < request.jobs)
      running.push_back(startDiagnosis(request, files[next++]));
    std::erase_if(running, [&](const Running& one) { return wasCollected(request, one, failed); });
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return failed;
}

}  // namespace

int runAnswer(std::span<const std::string> words) {
  return statusOf([&] {
    const Request request = requestOf(words);
    const std::vector<std::string> asked = filesOf(openSealed(request.folder), request);
    if (::access(request.cli.c_str(), X_OK) != 0)
      throw std::runtime_error("cannot run " + request.cli.string() + "; name the program with --cli PATH");
    const std::vector<std::string> files = unanswered(request, asked);
    const std::size_t failed = answerAll(request, files);
    std::cout << files.size() << " sessions answered, " << failed << " of them failed";
    if (files.size() < asked.size())
      std::cout << "; " << asked.size() - files.size() << " had been answered before (--again replaces them)";
    std::cout << "\n";
  });
}

}  // namespace blind
