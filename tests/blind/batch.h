#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace blind {

/// What the commands share that go through the sessions of a set.
struct Batch {
  std::filesystem::path folder;
  std::filesystem::path cli;  ///< fieldtrue-cli; beside this program where none was named.
  std::size_t jobs = 1;
};

/// A whole number among the options.
/// @error std::invalid_argument when it is none from `low` to `high`
std::size_t wholeOption(const std::map<std::string, std::string>& options, const std::string& command,
                        const std::string& name, std::size_t otherwise, std::size_t low, std::size_t high);

/// @error std::invalid_argument without --in, or when --jobs is no number
Batch batchOf(const std::map<std::string, std::string>& options, const std::string& command);

/// @error std::runtime_error when fieldtrue-cli cannot be run
void needProgram(const Batch& batch);

/// Prints how many sessions were worked on and, where there are such, how many had been before.
void tellMade(std::size_t made, std::size_t asked, const std::string& what);

/// A document of a set with an entry a session, each with the hash of what it was made from. Processes can share it.
class ResultFile {
 public:
  /// @param path the document; beside it a lock is made
  ResultFile(std::filesystem::path path, std::string schema);

  /// Makes what is not there yet, or was made from something else; each entry is written as soon as it is made.
  /// @param sessions as truth.json has them
  /// @param made_from hash of all that goes into an entry
  /// @return how many were made
  std::size_t fill(std::size_t jobs, const std::vector<nlohmann::json>& sessions,
                   const std::function<std::string(const nlohmann::json& session)>& made_from,
                   const std::function<nlohmann::json(const nlohmann::json& session)>& make) const;

 private:
  nlohmann::json document() const;
  void keep(const nlohmann::json& entry) const;

  std::filesystem::path path_;
  std::string schema_;
};

}  // namespace blind
