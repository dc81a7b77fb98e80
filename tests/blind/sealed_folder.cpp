#include "tests/blind/sealed_folder.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "tests/blind/sha256.h"

namespace blind {
namespace {

using nlohmann::json;

const json* member(const json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(key);
  return found == object.end() || found->is_null() ? nullptr : &*found;
}

std::optional<double> numberAt(const json& object, const char* key) {
  const json* value = member(object, key);
  if (value == nullptr || !value->is_number()) return std::nullopt;
  return value->get<double>();
}

std::string wordAt(const json& object, const char* key) {
  const json* value = member(object, key);
  return value != nullptr && value->is_string() ? value->get<std::string>() : std::string();
}

const json& listAt(const json& object, const char* key) {
  static const json kEmpty = json::array();
  const json* value = member(object, key);
  return value != nullptr && value->is_array() ? *value : kEmpty;
}

std::optional<Eigen::Vector3d> pointAt(const json& object, const char* key) {
  const json& values = listAt(object, key);
  if (values.size() != 3) return std::nullopt;
  Eigen::Vector3d point;
  for (int axis = 0; axis < 3; ++axis) {
    const json& value = values[static_cast<std::size_t>(axis)];
    if (!value.is_number()) return std::nullopt;
    point[axis] = value.get<double>();
  }
  return point;
}

std::vector<std::string> wordsOf(const json& list) {
  std::vector<std::string> words;
  for (const json& word : list)
    if (word.is_string()) words.push_back(word.get<std::string>());
  return words;
}

TrueEffect trueEffectOf(const json& object) {
  TrueEffect effect;
  effect.id = wordAt(object, "id");
  effect.rho = numberAt(object, "rho").value_or(0.0);
  effect.location_m = pointAt(object, "location_m");
  if (const json* amplitude = member(object, "amplitude")) {
    effect.amplitude_name = wordAt(*amplitude, "name");
    effect.amplitude = numberAt(*amplitude, "value").value_or(0.0);
  }
  return effect;
}

NamedCause causeOf(const json& object) {
  NamedCause cause;
  cause.effect = wordAt(object, "effect");
  cause.equivalents = wordsOf(listAt(object, "class"));
  cause.probability = numberAt(object, "probability").value_or(0.0);
  cause.location_m = pointAt(object, "location_m");
  if (const json* parameters = member(object, "parameters"); parameters != nullptr && parameters->is_object()) {
    for (const auto& [name, parameter] : parameters->items()) {
      if (const std::optional<double> value = numberAt(parameter, "value"))
        cause.parameters[name] = {*value, numberAt(parameter, "low90"), numberAt(parameter, "high90")};
    }
  }
  return cause;
}

void readReport(const json& report, Answer& answer) {
  answer.verdict = wordAt(report, "verdict");
  static constexpr std::string_view kVerdicts[] = {"no_gap", "explained", "partly_explained", "unexplained"};
  if (!isAmong(kVerdicts, answer.verdict)) {
    answer.trouble = "verdict is '" + answer.verdict + "'";
    return;
  }
  for (const json& candidate : listAt(report, "candidates")) answer.candidates.push_back(causeOf(candidate));
  for (const json& selected : listAt(report, "selected")) answer.selected.push_back(causeOf(selected));
  for (const json& finding : listAt(report, "findings")) {
    if (std::string effect = wordAt(finding, "effect"); !effect.empty()) answer.findings.push_back(std::move(effect));
  }
  if (const json* remaining = member(report, "remaining")) {
    answer.remaining_fraction = numberAt(*remaining, "fraction_of_start");
    answer.remaining_low90 = numberAt(*remaining, "fraction_low90");
    answer.remaining_high90 = numberAt(*remaining, "fraction_high90");
  }
  answer.is_answered = true;
}

Answer answerOf(const std::filesystem::path& path, const json* record) {
  Answer answer;
  if (record != nullptr) {
    answer.seconds = numberAt(*record, "seconds").value_or(0.0);
    if (const double status = numberAt(*record, "exit_status").value_or(0.0); status != 0.0) {
      answer.trouble = "exit status " + std::to_string(static_cast<int>(status));
      return answer;
    }
  }
  if (!std::filesystem::exists(path)) {
    answer.trouble = "no answer";
    return answer;
  }
  const std::string text = textOf(path);
  if (record != nullptr) {
    const std::string written = wordAt(*record, "answer_sha256");
    if (!written.empty() && written != sha256Hex(text))
      throw std::runtime_error(path.string() + " was changed after it was answered; answer this session again");
  }
  const json report = json::parse(text, nullptr, false);
  if (report.is_discarded() || !report.is_object()) {
    answer.trouble = "report is no JSON object";
    return answer;
  }
  readReport(report, answer);
  return answer;
}

/// Documents with an entry a session that score reads.
constexpr const char* kResults[] = {"foretold", "oracle", "replicated", "next"};

/// Entries of a document of the set, by file; nothing where the command that writes it did not run.
std::map<std::string, json> entriesIn(const std::filesystem::path& path) {
  std::map<std::string, json> entries;
  if (!std::filesystem::exists(path)) return entries;
  const json document = documentOf(path);
  for (const json& entry : listAt(document, "sessions")) entries[wordAt(entry, "file")] = entry;
  return entries;
}

/// Share of the squares at the start that is left, in position.
std::optional<double> leftOf(const json& foretold, const char* where) {
  const json* squares = member(foretold, where);
  if (squares == nullptr) return std::nullopt;
  const double start_m2 = numberAt(*squares, "start_m2").value_or(0.0);
  const auto after_m2 = numberAt(*squares, "after_m2");
  return after_m2 && start_m2 > 0.0 ? std::optional(*after_m2 / start_m2) : std::nullopt;
}

Session sessionOf(const json& object, std::size_t index) {
  Session session;
  session.file = wordAt(object, "file");
  session.shelf = wordAt(object, "shelf");
  session.control = wordAt(object, "control");
  static constexpr std::string_view kShelves[] = {"none", "single", "pairs", "off", "unforeseen", "signals"};
  if (session.file.empty() || !isAmong(kShelves, session.shelf)) {
    throw std::runtime_error("truth.json, session " + std::to_string(index + 1) + " ('" + session.file +
                             "'): needs a file and a shelf none, single, pairs, off, unforeseen or signals, got '" +
                             session.shelf + "'");
  }
  for (const json& effect : listAt(object, "effects")) session.effects.push_back(trueEffectOf(effect));
  if (session.shelf != "none" && session.effects.empty())
    throw std::runtime_error("truth.json, " + session.file + ": shelf " + session.shelf + " needs an effect, got none");
  session.rho = numberAt(object, "rho").value_or(0.0);
  session.rho_level = numberAt(object, "rho_level");
  const json* position_only = member(object, "position_only");
  session.is_position_only = position_only != nullptr && position_only->is_boolean() && position_only->get<bool>();
  session.order = wordAt(object, "order");
  for (const json& ids : listAt(object, "classes")) session.classes.push_back(wordsOf(ids));
  for (const json& ids : listAt(object, "own_classes")) session.own_classes.push_back(wordsOf(ids));
  if (const json* oracle = member(object, "oracle")) session.oracle_fraction = numberAt(*oracle, "fraction");
  return session;
}

}  // namespace

bool isAmong(std::span<const std::string_view> words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::map<std::string, std::string> optionsOf(std::span<const std::string> words, std::string_view command,
                                             std::span<const std::string_view> with_value,
                                             std::span<const std::string_view> flags) {
  std::map<std::string, std::string> options;
  std::size_t at = !words.empty() && words[0] == command ? 1 : 0;
  for (; at < words.size(); ++at) {
    const std::string& word = words[at];
    if (isAmong(flags, word)) {
      options[word] = "";
    } else if (!isAmong(with_value, word)) {
      throw std::invalid_argument(std::string(command) + ": unknown option '" + word + "'; --help lists those it has");
    } else if (at + 1 == words.size()) {
      throw std::invalid_argument(std::string(command) + ": " + word + " needs a value");
    } else {
      options[word] = words[++at];
    }
  }
  return options;
}

int statusOf(const std::function<void()>& command) {
  try {
    command();
    return 0;
  } catch (const std::invalid_argument& error) {
    std::cerr << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}

std::string textOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path.string());
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

json documentOf(const std::filesystem::path& path) {
  json document = json::parse(textOf(path), nullptr, false);
  if (document.is_discarded()) throw std::runtime_error(path.string() + " is no JSON");
  return document;
}

void replaceFile(const std::filesystem::path& path, std::string_view text) {
  std::filesystem::path fresh = path;
  fresh += ".new" + std::to_string(::getpid());
  {
    std::ofstream file(fresh, std::ios::binary | std::ios::trunc);
    file.write(text.data(), static_cast<std::streamsize>(text.size()));
    file.flush();
    if (!file) throw std::runtime_error("cannot write " + fresh.string());
  }
  std::filesystem::rename(fresh, path);
}

json openSealed(const std::filesystem::path& folder) {
  const std::string truth_text = textOf(folder / "truth.json");
  const json seal = documentOf(folder / "seal.json");
  const std::string sealed = wordAt(seal, "truth_sha256");
  const std::string found = sha256Hex(truth_text);
  if (sealed != found) {
    throw std::runtime_error("truth.json does not match its seal: seal.json says SHA-256 '" + sealed +
                             "', the file has " + found + "; generate the set again");
  }
  json truth = json::parse(truth_text, nullptr, false);
  if (truth.is_discarded() || wordAt(truth, "schema") != "fieldtrue.blind/1")
    throw std::runtime_error((folder / "truth.json").string() + " is no fieldtrue.blind/1 document");
  const double sessions = numberAt(seal, "sessions").value_or(-1.0);
  if (static_cast<double>(listAt(truth, "sessions").size()) != sessions)
    throw std::runtime_error("seal.json counts other sessions than truth.json holds");
  return truth;
}

void sealTruth(const std::filesystem::path& folder, const json& truth) {
  const std::string text = truth.dump(1);
  replaceFile(folder / "truth.json", text);
  const json seal = {{"schema", "fieldtrue.blind-seal/1"},
                     {"truth_sha256", sha256Hex(text)},
                     {"sessions", listAt(truth, "sessions").size()},
                     {"role", wordAt(truth, "role")}};
  replaceFile(folder / "seal.json", seal.dump(1));
}

std::vector<Session> sessionsOf(const json& truth, const std::filesystem::path& folder) {
  json records = json::object();
  if (std::filesystem::exists(folder / "answers.json")) records = documentOf(folder / "answers.json");
  std::map<std::string, const json*> record_of;
  for (const json& record : listAt(records, "sessions")) record_of[wordAt(record, "file")] = &record;
  std::map<std::string, std::map<std::string, json>> entries;
  for (const char* name : kResults) entries[name] = entriesIn(folder / (std::string(name) + ".json"));
  std::vector<Session> sessions;
  for (const json& object : listAt(truth, "sessions")) {
    Session session = sessionOf(object, sessions.size());
    const auto record = record_of.find(session.file);
    session.answer =
        answerOf(folder / (session.file + ".gap.json"), record == record_of.end() ? nullptr : record->second);
    for (const auto& [name, of_file] : entries)
      if (const auto found = of_file.find(session.file); found != of_file.end()) session.results[name] = found->second;
    if (const auto foretold = session.results.find("foretold"); foretold != session.results.end()) {
      session.answer.cannot_be_simulated = member(foretold->second, "trouble") != nullptr;
      session.answer.left_inside = leftOf(foretold->second, "inside");
      session.answer.left_outside = leftOf(foretold->second, "outside");
    }
    sessions.push_back(std::move(session));
  }
  return sessions;
}

}  // namespace blind
