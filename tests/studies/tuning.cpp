#include "tests/studies/tuning.h"

#include <algorithm>
#include <map>
#include <optional>

#include "calib/core/file_io.h"
#include "calib/tables/table_io.h"
#include "tests/blind/batch.h"
#include "tests/blind/controls.h"
#include "tests/blind/judgement.h"
#include "tests/blind/sha256.h"
#include "tests/studies/rooms.h"
#include "tests/studies/staged_diagnosis.h"

namespace fieldtrue::testing {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr const char* kSchema = "fieldtrue.tuning/1";

blind::NamedCause causeOf(const gap::GapCandidate& candidate) {
  blind::NamedCause cause{candidate.effect, candidate.equivalents, candidate.probability, candidate.location_m, {}};
  for (const gap::Estimate& estimate : candidate.parameters)
    cause.parameters[estimate.name] = {estimate.value, estimate.low90, estimate.high90};
  return cause;
}

bool isAsWanted(const blind::Session& session) {
  const blind::Wanted wanted = blind::wantedOf(session.control).value_or(blind::Wanted::kNoCause);
  if (wanted == blind::Wanted::kNoGap) return blind::isSilent(session);
  return wanted == blind::Wanted::kNoCause ? !blind::namesCause(session) : !blind::namesOtherCause(session);
}

/// All that a reader of the report sees decided: verdict, causes with their classes, findings, flagged rows.
std::string wordsOf(const gap::GapReport& report) {
  std::string words(gap::idOf(report.verdict));
  const auto add = [&](const gap::GapCandidate& cause) {
    words += "\n" + cause.effect;
    for (const std::string& other : cause.equivalents) words += "," + other;
  };
  for (const gap::SelectedEffect& effect : report.selected) add(effect);
  if (!report.candidates.empty()) add(report.candidates.front());
  for (const recording::GapFinding& finding : report.findings) words += "\n" + finding.text;
  for (const gap::GapNode& node : report.nodes) words += node.is_flagged ? '1' : '0';
  return words;
}

json diagnosedUnder(const std::vector<Trial>& trials, const fs::path& nodes, blind::Session session) {
  StagedDiagnosis diagnosis(orThrow(readNodeTable(nodes)).table);
  json scores = json::object();
  for (const Trial& trial : trials) {
    const gap::GapReport report = diagnosis.under(trial.thresholds);
    session.answer = answerOf(report);
    json score = scoreOf(session);
    score["words"] = blind::sha256Hex(wordsOf(report)).substr(0, 8);
    scores[trial.name] = std::move(score);
  }
  return {{"scores", scores}};
}

/// Scores of all sessions under one trial.
using Scores = std::vector<const json*>;

/// One figure over all sessions.
struct Column {
  std::string title;
  std::string key;
  bool is_mean = false;  ///< Else a count of those that are true.
};

const std::vector<Column> kColumns = {
    {"first right", "first_right"},      {"other cause named", "other_named"}, {"sets exact", "set_exact"},
    {"catalogue refused", "refused"},    {"outside so called", "so_called"},   {"false alarms", "alarm"},
    {"controls as wanted", "as_wanted"}, {"places held", "held", true},        {"Brier", "squared_error", true}};

std::string figureOf(const Scores& scores, const Column& column) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const json* score : scores) {
    const json& value = score->at(column.key);
    if (value.is_null()) continue;
    sum += value.is_boolean() ? (value.get<bool>() ? 1.0 : 0.0) : value.get<double>();
    ++count;
  }
  if (!column.is_mean) return formatNumber(sum);
  return count == 0 ? "" : formatNumber(std::round(1000.0 * sum / static_cast<double>(count)) / 1000.0);
}

std::size_t countedIn(const Scores& scores, const Column& column) {
  return static_cast<std::size_t>(
      std::count_if(scores.begin(), scores.end(), [&](const json* score) { return !score->at(column.key).is_null(); }));
}

std::size_t changedWords(const Scores& usual, const Scores& other) {
  std::size_t changed = 0;
  for (std::size_t i = 0; i < usual.size(); ++i) changed += usual[i]->at("words") != other[i]->at("words") ? 1 : 0;
  return changed;
}

std::string pairText(const std::string& half, const std::string& twice, const std::string& usual) {
  return half == usual && twice == usual ? "=" : half + " · " + twice;
}

}  // namespace

std::vector<Deciding> chosen(const std::vector<std::string>& names) {
  std::vector<Deciding> ones;
  for (const Deciding& one : decidingOnes()) {
    const bool is_named = names.empty() || std::find(names.begin(), names.end(), one.name) != names.end();
    if (is_named && one.is_tried) ones.push_back(one);
  }
  if (!names.empty() && ones.size() != names.size())
    throw std::invalid_argument("not every name is one of a figure that is tried");
  return ones;
}

std::vector<Trial> trialsOf(const std::vector<Deciding>& ones) {
  std::vector<Trial> all{{"default", {}}};
  for (const Deciding& one : ones) {
    for (const auto& [word, factor] : {std::pair("half of ", 0.5), std::pair("double of ", 2.0)}) {
      all.push_back({word + one.name, {}});
      one.scale(all.back().thresholds, factor);
    }
  }
  return all;
}

blind::Answer answerOf(const gap::GapReport& report) {
  blind::Answer answer;
  answer.is_answered = true;
  answer.verdict = gap::idOf(report.verdict);
  for (const gap::GapCandidate& candidate : report.candidates) answer.candidates.push_back(causeOf(candidate));
  for (const gap::SelectedEffect& effect : report.selected) answer.selected.push_back(causeOf(effect));
  return answer;
}

json scoreOf(const blind::Session& session) {
  const bool is_set = session.control.empty();
  const bool is_single = is_set && session.shelf == "single";
  const bool is_in_catalogue = is_set && (is_single || session.shelf == "pairs" || session.shelf == "none");
  const auto where = [](bool applies, auto value) { return applies ? json(value) : json(nullptr); };
  const std::vector<bool> held = is_single ? blind::locationCoverage(session) : std::vector<bool>();
  const auto n_held = static_cast<double>(std::count(held.begin(), held.end(), true));
  // What single readings show is not looked for here.
  const bool is_foretold = is_set && session.shelf != "signals";
  const auto forecast = is_foretold ? blind::forecastOf(session) : std::nullopt;
  const double error = forecast ? forecast->probability - (forecast->is_right ? 1.0 : 0.0) : 0.0;
  return {{"first_right", where(is_single, blind::isRight(session, blind::firstNamed(session)))},
          {"other_named", where(is_in_catalogue, blind::namesOtherCause(session))},
          {"set_exact",
           where(is_set && session.shelf == "pairs", blind::trueClasses(session) == blind::selectedClasses(session))},
          {"refused", where(is_single, blind::isAbstention(session))},
          {"so_called", where(is_set && blind::isOutsideCatalogue(session), blind::isAbstention(session))},
          {"alarm", where(is_set && session.shelf == "none", !blind::isSilent(session))},
          {"as_wanted", where(!is_set, isAsWanted(session))},
          {"held", where(!held.empty(), n_held / std::max(1.0, static_cast<double>(held.size())))},
          {"squared_error", where(forecast.has_value(), error * error)}};
}

void runTrials(const std::vector<fs::path>& folders, const std::vector<Deciding>& ones, std::size_t most,
               std::size_t jobs) {
  const std::vector<Trial> trials = trialsOf(ones);
  std::string names;
  for (const Trial& trial : trials) names += trial.name + "\n";
  for (const fs::path& folder : folders) {
    const json truth = blind::openSealed(folder);
    std::map<std::string, blind::Session> session_of;
    for (blind::Session& session : blind::sessionsOf(truth, folder)) session_of[session.file] = session;
    const auto nodesOf = [&](const json& session) {
      return folder / (session.at("file").get<std::string>() + ".nodes.csv");
    };
    const auto made_from = [&](const json& session) {
      return blind::sha256Hex(kSchema + names + session.dump() + blind::textOf(nodesOf(session)));
    };
    const auto make = [&](const json& session) {
      return diagnosedUnder(trials, nodesOf(session), session_of.at(session.at("file").get<std::string>()));
    };
    std::vector<json> sessions = truth.at("sessions");
    sessions.resize(std::min(sessions.size(), most));
    blind::ResultFile(folder / "tuning.json", kSchema).fill(jobs, sessions, made_from, make);
  }
}

std::string tuningTable(const std::vector<fs::path>& folders, const std::vector<Deciding>& ones) {
  std::vector<json> documents;
  for (const fs::path& folder : folders) documents.push_back(blind::documentOf(folder / "tuning.json"));
  std::map<std::string, Scores> scores_of;
  for (const json& document : documents)
    for (const json& session : document.at("sessions"))
      for (const auto& [trial, score] : session.at("scores").items()) scores_of[trial].push_back(&score);
  const Scores& usual = scores_of["default"];
  std::string head = "| figure | value |";
  std::string line = "|---|---|";
  std::string first = "| as it is | |";
  for (const Column& column : kColumns) {
    head += " " + column.title + (column.is_mean ? "" : ", of " + std::to_string(countedIn(usual, column))) + " |";
    line += "---|";
    first += " " + figureOf(usual, column) + " |";
  }
  std::string table =
      head + " words changed, of " + std::to_string(usual.size()) + " |\n" + line + "---|\n" + first + " |\n";
  std::string idle;
  for (const Deciding& one : ones) {
    const Scores& half = scores_of["half of " + one.name];
    const Scores& twice = scores_of["double of " + one.name];
    std::vector<std::string> cells;
    for (const Column& column : kColumns)
      cells.push_back(pairText(figureOf(half, column), figureOf(twice, column), figureOf(usual, column)));
    cells.push_back(
        pairText(std::to_string(changedWords(usual, half)), std::to_string(changedWords(usual, twice)), "0"));
    if (std::all_of(cells.begin(), cells.end(), [](const std::string& cell) { return cell == "="; })) {
      idle += (idle.empty() ? "`" : ", `") + one.name + "`";
      continue;
    }
    table += "| `" + one.name + "` | " + formatNumber(one.value({})) + " |";
    for (const std::string& cell : cells) table += " " + cell + " |";
    table += "\n";
  }
  return table + (idle.empty() ? "" : "\nNothing changes with half and double of " + idle + ".\n");
}

}  // namespace fieldtrue::testing
