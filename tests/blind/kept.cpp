#include "tests/blind/kept.h"

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <map>
#include <stdexcept>
#include <vector>

#include "tests/blind/next.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/sha256.h"

namespace blind {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr const char* kKeptSchema = "fieldtrue.blind-kept/1";
/// Documents of commands that look at some of the sessions only: kept as far as they are.
constexpr const char* kOthers[] = {"oracle", "replicated", "next"};

using Entries = std::map<std::string, json>;

json rounded(const json& value) {
  if (value.is_number_float()) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value.get<double>());
    return json::parse(text);
  }
  if (!value.is_structured()) return value;
  json all = value;
  for (json& one : all) one = rounded(one);
  return all;
}

/// Some members of an object, where it has them.
json membersOf(const json& object, std::initializer_list<const char*> keys) {
  json some = json::object();
  for (const char* key : keys)
    if (object.contains(key)) some[key] = object.at(key);
  return some;
}

/// A candidate; the first one with all that its parameters are said to be.
json reducedCandidate(const json& cause, bool is_first) {
  json reduced = membersOf(cause, {"effect", "probability"});
  if (!is_first) return reduced;
  reduced.update(membersOf(cause, {"class", "location_m"}));
  if (!cause.contains("parameters") || !cause.at("parameters").is_object()) return reduced;
  for (const auto& [name, parameter] : cause.at("parameters").items())
    if (parameter.is_object()) reduced["parameters"][name] = membersOf(parameter, {"value", "low90", "high90"});
  return reduced;
}

/// Those that are of any account: the first, and the others down to 1 in 1000.
json reducedCandidates(const json& report) {
  constexpr double kOfAccount = 1e-3;
  const json all = report.value("candidates", json::array());
  json candidates = json::array();
  for (const json& candidate : all)
    if (candidates.empty() || candidate.value("probability", 0.0) >= kOfAccount)
      candidates.push_back(reducedCandidate(candidate, candidates.empty()));
  return candidates;
}

/// Entries of a list that name an effect, with nothing but its name.
json namesIn(const json& report, const char* key) {
  const json all = report.value(key, json::array());
  json names = json::array();
  for (const json& one : all)
    if (!one.value("effect", "").empty()) names.push_back(membersOf(one, {"effect"}));
  return names;
}

json reducedForetold(const json& entry) {
  json reduced = membersOf(entry, {"trouble"});
  for (const char* where : {"inside", "outside"})
    if (entry.contains(where)) reduced[where] = membersOf(entry.at(where), {"start_m2", "after_m2"});
  return reduced;
}

Entries entriesOf(const fs::path& path) {
  Entries entries;
  if (!fs::exists(path)) return entries;
  const json document = documentOf(path);
  for (const json& entry : document.at("sessions")) entries[entry.at("file")] = entry;
  return entries;
}

std::string sealOf(const fs::path& set) { return documentOf(set / "seal.json").at("truth_sha256"); }

fs::path partPath(const fs::path& folder, std::size_t part) {
  char name[32];
  std::snprintf(name, sizeof name, "part_%02zu.json", part);
  return folder / name;
}

/// @error std::runtime_error where a document that is kept belongs to another set
json ofThisSet(const fs::path& path, const std::string& seal) {
  json document = documentOf(path);
  if (document.value("schema", "") != kKeptSchema) throw std::runtime_error(path.string() + " is no " + kKeptSchema);
  if (document.value("truth_sha256", "") != seal)
    throw std::runtime_error(path.string() + " keeps another set: its truth has SHA-256 " +
                             document.value("truth_sha256", "") + ", this one " + seal);
  return document;
}

json keptSession(const fs::path& set, const json& record, const json* foretold) {
  json session = membersOf(record, {"file", "seconds", "exit_status"});
  if (record.contains("answer_sha256")) {
    session["report_sha256"] = record.value("report_sha256", record.at("answer_sha256"));
    const std::string text = textOf(set / (record.at("file").get<std::string>() + ".gap.json"));
    if (sha256Hex(text) != record.at("answer_sha256"))
      throw std::runtime_error(record.at("file").get<std::string>() + ": the report was changed after it was answered");
    session["report"] = reducedReport(json::parse(text));
  }
  if (record.contains("scene_sha256")) session["scene_sha256"] = record.at("scene_sha256");
  if (foretold != nullptr) session["foretold"] = reducedForetold(*foretold);
  return rounded(session);
}

/// @return null while a session of the part has no answer, or a scene that was not foretold: controls have no places
/// for it
json keptPart(const fs::path& set, std::span<const json> sessions, const Entries& records, const Entries& foretold) {
  json kept = json::array();
  for (const json& session : sessions) {
    const auto record = records.find(session.at("file"));
    if (record == records.end()) return nullptr;
    const auto found = foretold.find(session.at("file"));
    const bool can_be_foretold = record->second.contains("scene_sha256") && !session.contains("control");
    if (can_be_foretold && found == foretold.end()) return nullptr;
    kept.push_back(keptSession(set, record->second, found == foretold.end() ? nullptr : &found->second));
  }
  return kept;
}

void keepOthers(const fs::path& set, const fs::path& folder, const json& head) {
  for (const char* name : kOthers) {
    const std::string file = std::string(name) + ".json";
    if (!fs::exists(set / file)) continue;
    json document = head;
    document["document"] = documentOf(set / file);
    const std::string text = document.dump() + "\n";
    const bool keeps_more = fs::exists(folder / file) &&
                            ofThisSet(folder / file, head.at("truth_sha256")).at("document").at("sessions").size() >
                                document.at("document").at("sessions").size();
    if (!keeps_more) replaceFile(folder / file, text);
  }
}

/// Puts entries of a session into a document of the set, unless it has them.
void putBack(const fs::path& path, const json& fresh, Entries entries) {
  if (entries.empty()) return;
  json document = fs::exists(path) ? documentOf(path) : fresh;
  for (const json& entry : document.at("sessions")) entries[entry.at("file")] = entry;
  document["sessions"] = json::array();
  for (const auto& [file, entry] : entries) document["sessions"].push_back(entry);
  replaceFile(path, document.dump(1));
}

json recordOf(const fs::path& set, const json& session) {
  json record = membersOf(session, {"file", "seconds", "exit_status", "report_sha256"});
  if (!session.contains("report")) return record;
  const std::string text = session.at("report").dump(1);
  replaceFile(set / (session.at("file").get<std::string>() + ".gap.json"), text);
  record["answer_sha256"] = sha256Hex(text);
  return record;
}

fs::path folderIn(const std::map<std::string, std::string>& options, const std::string& command,
                  const std::string& name) {
  const auto found = options.find(name);
  if (found == options.end()) throw std::invalid_argument(command + ": " + name + " DIR is needed");
  return found->second;
}

}  // namespace

json reducedReport(const json& report) {
  json reduced = membersOf(report, {"verdict"});
  reduced["candidates"] = reducedCandidates(report);
  reduced["selected"] = namesIn(report, "selected");
  reduced["findings"] = namesIn(report, "findings");
  // `next` reads the sentence as an operator would.
  if (report.contains("next_measurement") && leavesOpen(report))
    reduced["next_measurement"] = membersOf(report.at("next_measurement"), {"text"});
  if (report.contains("remaining"))
    reduced["remaining"] =
        membersOf(report.at("remaining"), {"fraction_of_start", "fraction_low90", "fraction_high90"});
  return rounded(reduced);
}

std::size_t keepParts(const fs::path& set, const fs::path& folder, const std::string& engine) {
  const json sessions = openSealed(set).at("sessions");
  const std::vector<json> all(sessions.begin(), sessions.end());
  const Entries records = entriesOf(set / "answers.json"), foretold = entriesOf(set / "foretold.json");
  const json head = {{"schema", kKeptSchema}, {"engine", engine}, {"truth_sha256", sealOf(set)}};
  fs::create_directories(folder);
  std::size_t written = 0;
  for (std::size_t first = 0, part = 1; first < all.size(); first += kPart, ++part) {
    const fs::path path = partPath(folder, part);
    if (fs::exists(path)) {
      if (ofThisSet(path, head.at("truth_sha256")).value("engine", "") != engine)
        throw std::runtime_error(path.string() + " was answered by another engine");
      continue;
    }
    const std::size_t count = std::min(kPart, all.size() - first);
    json document = head;
    document["sessions"] = keptPart(set, std::span(all).subspan(first, count), records, foretold);
    if (document["sessions"].is_null()) continue;
    replaceFile(path, document.dump() + "\n");
    ++written;
  }
  keepOthers(set, folder, head);
  return written;
}

std::size_t restoreParts(const fs::path& set, const fs::path& folder) {
  const std::string seal = sealOf(set);
  const std::size_t n_sessions = openSealed(set).at("sessions").size();
  const Entries answered = entriesOf(set / "answers.json");
  Entries records, foretold;
  for (std::size_t part = 1; (part - 1) * kPart < n_sessions; ++part) {
    if (!fs::exists(partPath(folder, part))) continue;
    const json document = ofThisSet(partPath(folder, part), seal);
    for (const json& session : document.at("sessions")) {
      if (answered.count(session.at("file")) > 0) continue;
      records[session.at("file")] = recordOf(set, session);
      if (!session.contains("foretold")) continue;
      json& entry = foretold[session.at("file")] = session.at("foretold");
      entry["file"] = session.at("file");
    }
  }
  const std::size_t restored = records.size();
  putBack(set / "foretold.json", {{"schema", "fieldtrue.blind-foretold/1"}, {"sessions", json::array()}}, foretold);
  putBack(set / "answers.json", {{"sessions", json::array()}}, records);
  for (const char* name : kOthers) {
    const fs::path path = folder / (std::string(name) + ".json");
    if (!fs::exists(path)) continue;
    const json document = ofThisSet(path, seal).at("document");
    Entries entries;
    for (const json& entry : document.at("sessions")) entries[entry.at("file")] = entry;
    json fresh = document;
    fresh["sessions"] = json::array();
    putBack(set / (std::string(name) + ".json"), fresh, entries);
  }
  return restored;
}

int runKeep(std::span<const std::string> words) {
  static constexpr std::string_view kWithValue[] = {"--in", "--kept", "--engine"};
  return statusOf([&] {
    const auto options = optionsOf(words, "keep", kWithValue, {});
    const fs::path set = folderIn(options, "keep", "--in"), folder = folderIn(options, "keep", "--kept");
    const auto engine = options.find("--engine");
    const auto is_hex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
    if (engine == options.end() || engine->second.size() != 40 ||
        !std::all_of(engine->second.begin(), engine->second.end(), is_hex))
      throw std::invalid_argument("keep: --engine needs the whole commit id of the program that answered, 40 digits");
    std::cout << keepParts(set, folder, engine->second) << " parts written to " << folder.string() << "\n";
  });
}

int runRestore(std::span<const std::string> words) {
  static constexpr std::string_view kWithValue[] = {"--in", "--kept"};
  return statusOf([&] {
    const auto options = optionsOf(words, "restore", kWithValue, {});
    const std::size_t restored =
        restoreParts(folderIn(options, "restore", "--in"), folderIn(options, "restore", "--kept"));
    std::cout << restored << " answers put back\n";
  });
}

}  // namespace blind
