#include "tests/blind/replicate.h"

#include <set>
#include <stdexcept>

#include "tests/blind/batch.h"
#include "tests/blind/diagnosis_run.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/session_table.h"
#include "tests/blind/sha256.h"

namespace blind {
namespace {

using nlohmann::json;

constexpr const char* kReplicatedSchema = "fieldtrue.blind-replicated/1";
constexpr std::size_t kMostPlaces = 100;

std::size_t placesOf(const SessionTable& nodes) {
  std::set<std::string> places;
  for (const auto& row : nodes.rows) places.insert(row[nodes.neededColumn("node")]);
  return places.size();
}

std::vector<json> smallSessions(const Batch& batch, const json& truth, std::size_t most) {
  std::vector<json> sessions;
  for (const json& session : truth.at("sessions")) {
    if (sessions.size() == most) break;
    const std::string file = session.at("file").get<std::string>();
    if (session.at("shelf") == "single" && placesOf(readTable(batch.folder / (file + ".nodes.csv"))) <= kMostPlaces)
      sessions.push_back(session);
  }
  if (sessions.empty())
    throw std::runtime_error(batch.folder.string() + " holds no session of one effect and at most " +
                             std::to_string(kMostPlaces) + " places");
  return sessions;
}

/// What was selected, and how many of the replicates named the same.
json replicatedEntry(const json& report) {
  if (report.is_null()) return {{"trouble", "the diagnosis failed"}};
  json selected = json::array();
  for (const json& one : report.at("selected")) selected.push_back(one.at("effect"));
  const json& replicates = report.at("replicates");
  if (replicates.is_null()) return {{"trouble", "the report has no replicates"}, {"selected", selected}};
  return {{"selected", selected}, {"n", replicates.at("n")}, {"named_so", replicates.at("named_right")}};
}

}  // namespace

int runReplicate(std::span<const std::string> words) {
  static constexpr std::string_view kWithValue[] = {"--in", "--cli", "--jobs", "--sessions", "--replicates"};
  return statusOf([&] {
    const auto options = optionsOf(words, "replicate", kWithValue, {});
    const Batch batch = batchOf(options, "replicate");
    const std::size_t most = wholeOption(options, "replicate", "--sessions", 60, 1, 99999);
    const std::string wanted = std::to_string(wholeOption(options, "replicate", "--replicates", 20, 1, 1000));
    const std::vector<json> sessions = smallSessions(batch, openSealed(batch.folder), most);
    needProgram(batch);
    const auto made_from = [&](const json& session) {
      const Recording recording = recordingOf(batch.folder, session.at("file").get<std::string>());
      return sha256Hex(kReplicatedSchema + wanted + recording.nodes_csv + recording.samples_csv);
    };
    const auto make = [&](const json& session) {
      return replicatedEntry(diagnosed(batch.cli, recordingOf(batch.folder, session.at("file").get<std::string>()),
                                       {"--replicates", wanted}));
    };
    const std::size_t made =
        ResultFile(batch.folder / "replicated.json", kReplicatedSchema).fill(batch.jobs, sessions, made_from, make);
    tellMade(made, sessions.size(), "diagnosed with " + wanted + " replicates");
  });
}

}  // namespace blind
