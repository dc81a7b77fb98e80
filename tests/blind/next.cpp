#include "tests/blind/next.h"

#include <map>
#include <stdexcept>

#include "tests/blind/batch.h"
#include "tests/blind/diagnosis_run.h"
#include "tests/blind/remake.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/sha256.h"
#include "tests/blind/suggestion.h"

namespace blind {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr const char* kNextSchema = "fieldtrue.blind-next/1";

/// Sessions with an effect whose answer leaves its cause open, with the answer's report.
std::vector<json> openSessions(const fs::path& folder, const json& truth, std::size_t most) {
  const json answers = documentOf(folder / "answers.json");
  std::map<std::string, std::string> sha_of;
  for (const json& record : answers.at("sessions"))
    if (record.contains("answer_sha256")) sha_of[record.at("file")] = record.at("answer_sha256");
  std::vector<json> open;
  for (const json& session : truth.at("sessions")) {
    if (open.size() == most) break;
    const std::string file = session.at("file").get<std::string>();
    const bool is_placed = session.at("shelf") == "single" || session.at("shelf") == "pairs";
    if (!is_placed || sha_of.count(file) == 0) continue;
    const fs::path path = folder / (file + ".gap.json");
    if (sha256Hex(textOf(path)) != sha_of[file])
      throw std::runtime_error(path.string() + " was changed after it was answered");
    if (leavesOpen(documentOf(path))) open.push_back(session);
  }
  if (open.empty()) throw std::runtime_error(folder.string() + " holds no answer that leaves a cause open");
  return open;
}

/// Hash of each report as it was answered, also where only a part of it is kept.
std::map<std::string, std::string> wholeReports(const fs::path& folder) {
  const json answers = documentOf(folder / "answers.json");
  std::map<std::string, std::string> sha_of;
  for (const json& record : answers.at("sessions"))
    if (record.contains("answer_sha256"))
      sha_of[record.at("file")] =
          record.contains("report_sha256") ? record.at("report_sha256") : record.at("answer_sha256");
  return sha_of;
}

/// A table's rows without metadata and header.
std::string bodyOf(const std::string& csv) {
  std::size_t at = 0;
  while (at < csv.size() && csv[at] == '#') at = csv.find('\n', at) + 1;
  return csv.substr(csv.find('\n', at) + 1);
}

/// The recording with further rows of the same world: same rig, seating and scatter of the readings.
Recording extended(const MadeSession& made, const Recording& recording, const std::vector<Row>& rows, Random& random) {
  Setup further = made.setup;
  further.rows = rows;
  const bool has_samples = !recording.samples_csv.empty();
  const GeneratedSession more =
      recordSession(further, worldOf(made.effects), Alignment(further), {}, has_samples, random);
  return {recording.nodes_csv + bodyOf(more.nodes_csv),
          has_samples ? recording.samples_csv + bodyOf(more.samples_csv) : ""};
}

/// What score needs of a report: causes, probabilities and widths of 90 % intervals, those that the report tells.
json causesIn(const json& report) {
  if (report.is_null()) return nullptr;
  json causes = json::array();
  for (const json& candidate : report.at("candidates")) {
    json widths = json::object();
    const json parameters = candidate.value("parameters", json::object());
    for (const auto& [name, parameter] : parameters.items())
      if (parameter.at("low90").is_number() && parameter.at("high90").is_number())
        widths[name] = parameter.at("high90").get<double>() - parameter.at("low90").get<double>();
    causes.push_back({{"effect", candidate.at("effect")},
                      {"probability", candidate.at("probability")},
                      {"widths90", std::move(widths)}});
  }
  return causes;
}

json measuredFurther(const Batch& batch, const json& truth, const std::string& file) {
  const json report = documentOf(batch.folder / (file + ".gap.json"));
  const MadeSession made = remadeSession(batch.folder, truth, file);
  const Suggestion suggestion = suggestionIn(report.at("next_measurement").at("text").get<std::string>(), made.setup);
  if (suggestion.kind.empty()) return {{"kind", nullptr}};
  const Recording recording = recordingOf(batch.folder, file);
  // A stream of its own for each recording, the same whenever it is made.
  const std::uint64_t seed = std::stoull(sha256Hex(recording.nodes_csv).substr(0, 15), nullptr, 16);
  Random seating(seed), elsewhere(seed + 1);
  const std::vector<Row> random_rows = randomRows(made.setup, suggestion.rows, elsewhere);
  return {{"kind", suggestion.kind},
          {"rows", suggestion.rows.size()},
          {"before", causesIn(report)},
          {"suggested", causesIn(diagnosed(batch.cli, extended(made, recording, suggestion.rows, seating)))},
          {"random", causesIn(diagnosed(batch.cli, extended(made, recording, random_rows, elsewhere)))}};
}

}  // namespace

bool leavesOpen(const json& report) {
  const json& candidates = report.at("candidates");
  if (candidates.empty() || report.at("verdict") == "no_gap") return false;
  const json& first = candidates.front();
  return first.at("class").size() > 1 || first.at("probability").get<double>() < 0.9;
}

int runNext(std::span<const std::string> words) {
  static constexpr std::string_view kWithValue[] = {"--in", "--cli", "--jobs", "--sessions"};
  return statusOf([&] {
    const auto options = optionsOf(words, "next", kWithValue, {});
    const Batch batch = batchOf(options, "next");
    const std::size_t most = wholeOption(options, "next", "--sessions", 150, 1, 99999);
    const json truth = openSealed(batch.folder);
    if (!fs::exists(batch.folder / "answers.json"))
      throw std::runtime_error(batch.folder.string() + " holds no answers; run answer first");
    const std::vector<json> sessions = openSessions(batch.folder, truth, most);
    needProgram(batch);
    const std::map<std::string, std::string> whole_report = wholeReports(batch.folder);
    const auto made_from = [&](const json& session) {
      const std::string file = session.at("file").get<std::string>();
      const Recording recording = recordingOf(batch.folder, file);
      return sha256Hex(kNextSchema + recording.nodes_csv + recording.samples_csv + whole_report.at(file));
    };
    const auto make = [&](const json& session) {
      return measuredFurther(batch, truth, session.at("file").get<std::string>());
    };
    const std::size_t made =
        ResultFile(batch.folder / "next.json", kNextSchema).fill(batch.jobs, sessions, made_from, make);
    tellMade(made, sessions.size(), "measured further");
  });
}

}  // namespace blind
