#include "tests/blind/batch.h"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <iostream>
#include <mutex>
#include <stdexcept>

#include "tests/blind/file_lock.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/side_by_side.h"

namespace blind {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

std::string fileOf(const json& session) { return session.at("file").get<std::string>(); }

}  // namespace

std::size_t wholeOption(const std::map<std::string, std::string>& options, const std::string& command,
                        const std::string& name, std::size_t otherwise, std::size_t low, std::size_t high) {
  const auto given = options.find(name);
  if (given == options.end()) return otherwise;
  const std::string& text = given->second;
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < low || value > high)
    throw std::invalid_argument(command + ": " + name + " needs a whole number from " + std::to_string(low) + " to " +
                                std::to_string(high) + ", got '" + text + "'");
  return value;
}

Batch batchOf(const std::map<std::string, std::string>& options, const std::string& command) {
  if (options.count("--in") == 0) throw std::invalid_argument(command + ": --in DIR is needed");
  Batch batch{options.at("--in"), fs::read_symlink("/proc/self/exe").parent_path() / "fieldtrue-cli", 1};
  if (options.count("--cli") > 0) batch.cli = fs::absolute(options.at("--cli"));
  batch.jobs = wholeOption(options, command, "--jobs", 1, 1, 256);
  return batch;
}

void needProgram(const Batch& batch) {
  if (::access(batch.cli.c_str(), X_OK) != 0)
    throw std::runtime_error("cannot run " + batch.cli.string() + "; name the program with --cli PATH");
}

void tellMade(std::size_t made, std::size_t asked, const std::string& what) {
  std::cout << made << " sessions " << what;
  if (made < asked) std::cout << "; " << asked - made << " had been before";
  std::cout << "\n";
}

ResultFile::ResultFile(fs::path path, std::string schema) : path_(std::move(path)), schema_(std::move(schema)) {}

json ResultFile::document() const {
  if (!fs::exists(path_)) return {{"schema", schema_}, {"sessions", json::array()}};
  json found = documentOf(path_);
  if (!found.is_object() || found.value("schema", "") != schema_ || !found.contains("sessions") ||
      !found["sessions"].is_array())
    throw std::runtime_error(path_.string() + " is no " + schema_ + " document");
  return found;
}

void ResultFile::keep(const json& entry) const {
  fs::path lock_path = path_;
  const FileLock lock(lock_path.replace_extension(".lock"));
  json all = document();
  json& list = all["sessions"];
  list.erase(std::remove_if(list.begin(), list.end(),
                            [&](const json& other) { return other.value("file", "") == fileOf(entry); }),
             list.end());
  const auto after = std::find_if(list.begin(), list.end(),
                                  [&](const json& other) { return other.value("file", "") > fileOf(entry); });
  list.insert(after, entry);
  replaceFile(path_, all.dump(1));
}

std::size_t ResultFile::fill(std::size_t jobs, const std::vector<json>& sessions,
                             const std::function<std::string(const json&)>& made_from,
                             const std::function<json(const json&)>& make) const {
  std::map<std::string, std::string> hash_of;
  const json found = document();
  for (const json& entry : found.at("sessions")) hash_of[entry.value("file", "")] = entry.value("made_from", "");
  std::vector<std::pair<json, std::string>> open;
  for (const json& session : sessions) {
    std::string hash = made_from(session);
    if (hash_of[fileOf(session)] != hash) open.emplace_back(session, std::move(hash));
  }
  std::mutex guard;
  sideBySide(
      jobs, open.size(), [&](std::size_t n) { return fileOf(open[n].first); },
      [&](std::size_t n) {
        json entry = {{"file", fileOf(open[n].first)}, {"made_from", open[n].second}};
        entry.update(make(open[n].first));
        const std::lock_guard one_at_a_time(guard);
        keep(entry);
      });
  return open.size();
}

}  // namespace blind
