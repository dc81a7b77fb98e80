#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace blind {

bool isAmong(std::span<const std::string_view> words, std::string_view word);

/// `--key value` and bare `--key` of a command; the command's own name may stand first.
/// @error std::invalid_argument when a word is neither in `with_value` nor in `flags`, or a value is missing
std::map<std::string, std::string> optionsOf(std::span<const std::string> words, std::string_view command,
                                             std::span<const std::string_view> with_value,
                                             std::span<const std::string_view> flags);

/// Runs a command. @return 0, or 2 for wrong usage (std::invalid_argument) and 1 for any other exception, told in a
/// line on standard error
int statusOf(const std::function<void()>& command);

/// @error std::runtime_error when the file cannot be read
std::string textOf(const std::filesystem::path& path);
/// @error std::runtime_error when the file cannot be read or is no JSON
nlohmann::json documentOf(const std::filesystem::path& path);
/// Writes beside the file and renames, so that a reader sees the old or the new file whole.
/// @error std::runtime_error when the folder cannot be written
void replaceFile(const std::filesystem::path& path, std::string_view text);

/// The truth of a folder, after its bytes were found to match the seal.
/// @error std::runtime_error when truth or seal is missing, malformed, or one was changed after sealing
nlohmann::json openSealed(const std::filesystem::path& folder);

/// Writes truth.json and the seal.json of exactly these bytes.
void sealTruth(const std::filesystem::path& folder, const nlohmann::json& truth);

/// One effect that a session really carries.
struct TrueEffect {
  std::string id;
  double rho = 0.0;                           ///< Gap to noise of this effect alone.
  std::optional<Eigen::Vector3d> location_m;  ///< Tracker frame.
  std::string amplitude_name;                 ///< "" when there is none to compare.
  double amplitude = 0.0;
};

/// One parameter of an answer with its 90 % interval.
struct AnsweredParameter {
  double value = 0.0;
  std::optional<double> low90;
  std::optional<double> high90;
};

struct NamedCause {
  std::string effect;
  std::vector<std::string> equivalents;
  double probability = 0.0;
  std::optional<Eigen::Vector3d> location_m;  ///< Tracker frame of the fitted alignment.
  std::map<std::string, AnsweredParameter> parameters;
};

/// What the diagnosis said of a session; not answered when it failed or left no readable report.
struct Answer {
  bool is_answered = false;
  std::string trouble;  ///< Why it is not answered.
  double seconds = 0.0;
  std::string verdict;
  std::vector<NamedCause> candidates;
  std::vector<NamedCause> selected;
  std::vector<std::string> findings;  ///< Effects named in findings.
  std::optional<double> remaining_fraction;
  std::optional<double> remaining_low90, remaining_high90;
  bool cannot_be_simulated = false;                 ///< The scene it left, by `foretell`.
  std::optional<double> left_inside, left_outside;  ///< Excess that `foretell` found left of its start, in squares.
};

struct Session {
  std::string file;
  std::string shelf;
  std::string control;  ///< "" unless this is a negative control.
  std::vector<TrueEffect> effects;
  double rho = 0.0;
  std::optional<double> rho_level;
  bool is_position_only = false;
  std::string order;
  std::vector<std::vector<std::string>> classes;      ///< As plan-check declared them before answering.
  std::vector<std::vector<std::string>> own_classes;  ///< By the physics of the generator; empty when not stated.
  std::optional<double> oracle_fraction;
  Answer answer;
  std::map<std::string, nlohmann::json> results;  ///< Entries of oracle.json and its like, by the document's name.
};

/// Sessions of a truth document, each with its answer from the folder.
/// @error std::runtime_error when a session lacks what scoring needs, or an answer was changed after it was written
std::vector<Session> sessionsOf(const nlohmann::json& truth, const std::filesystem::path& folder);

}  // namespace blind
