#include "tests/blind/score.h"

#include <algorithm>
#include <iostream>
#include <stdexcept>

#include "tests/blind/score_table.h"
#include "tests/blind/sealed_folder.h"

namespace blind {
namespace {

std::vector<Session> answeredSessions(const std::filesystem::path& folder) {
  std::vector<Session> sessions = sessionsOf(openSealed(folder), folder);
  if (std::none_of(sessions.begin(), sessions.end(), [](const Session& one) { return one.answer.is_answered; }))
    throw std::runtime_error(folder.string() + " holds no answers; run answer first");
  return sessions;
}

Scoreboard boardOf(const std::map<std::string, std::string>& options) {
  if (options.count("--in") == 0) throw std::invalid_argument("score: --in DIR is needed");
  std::vector<Session> sessions = answeredSessions(options.at("--in"));
  if (options.count("--controls") > 0) {
    const std::vector<Session> controls = answeredSessions(options.at("--controls"));
    sessions.insert(sessions.end(), controls.begin(), controls.end());
  }
  return scoreboardOf(sessions);
}

}  // namespace

int runScore(std::span<const std::string> words) {
  static constexpr std::string_view kWithValue[] = {"--in", "--controls", "--json", "--markdown"};
  return statusOf([&] {
    const auto options = optionsOf(words, "score", kWithValue, {});
    const Scoreboard board = boardOf(options);
    if (options.count("--json") > 0) replaceFile(options.at("--json"), toJson(board).dump(1) + "\n");
    if (options.count("--markdown") > 0) replaceFile(options.at("--markdown"), markdown(board));
    std::cout << plainText(board);
  });
}

}  // namespace blind
