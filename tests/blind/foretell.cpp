#include "tests/blind/foretell.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <stdexcept>
#include <vector>

#include "tests/blind/bare_alignment.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/session_table.h"
#include "tests/blind/sha256.h"
#include "tests/blind/side_by_side.h"
#include "tests/blind/subprocess.h"
#include "tests/blind/temporary_folder.h"
#include "tests/blind/unseen_places.h"

namespace blind {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

struct Trial {
  fs::path folder;
  fs::path cli;
  std::size_t jobs = 1;
};

Trial trialOf(std::span<const std::string> words) {
  static constexpr std::string_view kWithValue[] = {"--in", "--cli", "--jobs"};
  const auto options = optionsOf(words, "foretell", kWithValue, {});
  if (options.count("--in") == 0) throw std::invalid_argument("foretell: --in DIR is needed");
  Trial trial{options.at("--in"), fs::read_symlink("/proc/self/exe").parent_path() / "fieldtrue-cli", 1};
  if (options.count("--cli") > 0) trial.cli = fs::absolute(options.at("--cli"));
  if (options.count("--jobs") > 0) {
    const double jobs = numberIn(options.at("--jobs"));
    if (!(jobs >= 1.0 && jobs <= 1000.0)) throw std::invalid_argument("foretell: --jobs needs a number from 1 to 1000");
    trial.jobs = static_cast<std::size_t>(jobs);
  }
  return trial;
}

/// The sealed places as a plan, without the poses that were sealed with them. Earlier times come first: a plan is
/// walked.
json planOf(const SessionTable& unseen, std::span<const std::size_t> order) {
  json nodes = json::array();
  for (const std::size_t place : order) {
    const auto& row = unseen.rows[place];
    const auto number = [&](const char* name) { return numberIn(row[unseen.neededColumn(name)]); };
    json node = {{"node", place},
                 {"x_m", number("x_true_m")},
                 {"y_m", number("y_true_m")},
                 {"z_m", number("z_true_m")},
                 {"qw", number("qw_true")},
                 {"qx", number("qx_true")},
                 {"qy", number("qy_true")},
                 {"qz", number("qz_true")},
                 {"t_s", number("t_s")}};
    for (const char* step : {"i", "j", "k"}) node[step] = static_cast<int>(number(step));
    nodes.push_back(std::move(node));
  }
  return {{"schema", "fieldtrue.plan/1"}, {"nodes", std::move(nodes)}};
}

std::vector<std::size_t> byTime(const SessionTable& unseen) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < unseen.rows.size(); ++i) order.push_back(i);
  const std::size_t time = unseen.neededColumn("t_s");
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return numberIn(unseen.rows[a][time]) < numberIn(unseen.rows[b][time]);
  });
  return order;
}

/// The poses of a simulation in the order of the sealed places.
std::vector<SolvedPose> byPlace(const SessionTable& unseen, const SessionTable& foretold) {
  if (foretold.rows.size() != unseen.rows.size())
    throw std::runtime_error("the simulation has " + std::to_string(foretold.rows.size()) + " places, not " +
                             std::to_string(unseen.rows.size()));
  std::vector<SolvedPose> poses(unseen.rows.size());
  for (const auto& row : foretold.rows)
    poses.at(std::stoul(row[foretold.neededColumn("node")])) = trackedPose(foretold, row);
  return poses;
}

json foretold(const Trial& trial, const json& session, const std::string& scene_sha256) {
  const std::string file = session.at("file").get<std::string>();
  json entry = {{"file", file}};
  const fs::path scene = trial.folder / (file + ".scene.json");
  if (sha256Hex(textOf(scene)) != scene_sha256)
    throw std::runtime_error(scene.string() + " was changed after it was answered");
  const SessionTable unseen = sealedPlaces(trial.folder, session);
  const TemporaryFolder desk;
  replaceFile(desk.path() / "unseen.plan.json", planOf(unseen, byTime(unseen)).dump());
  const Finished run = runProgram({trial.cli.string(), "simulate", "--exact", "--threads", "1", "--scene",
                                   scene.string(), "--plan", (desk.path() / "unseen.plan.json").string(), "--nodes",
                                   (desk.path() / "foretold.nodes.csv").string()});
  if (run.exit_status != 0) {
    entry["trouble"] = "simulate ended with status " + std::to_string(run.exit_status);
    return entry;
  }
  entry.update(comparedWithSealed(readTable(trial.folder / (file + ".nodes.csv")), unseen,
                                  byPlace(unseen, readTable(desk.path() / "foretold.nodes.csv"))));
  return entry;
}

/// Every session that has an answer, with the hash of its scene.
std::vector<std::pair<json, std::string>> answeredSessions(const Trial& trial) {
  const json truth = openSealed(trial.folder);
  const json answers = documentOf(trial.folder / "answers.json");
  std::map<std::string, std::string> scene_of;
  for (const json& record : answers.at("sessions"))
    if (record.contains("scene_sha256")) scene_of[record.at("file")] = record.at("scene_sha256");
  std::vector<std::pair<json, std::string>> sessions;
  for (const json& session : truth.at("sessions")) {
    const auto scene = scene_of.find(session.at("file").get<std::string>());
    if (scene != scene_of.end()) sessions.emplace_back(session, scene->second);
  }
  if (sessions.empty()) throw std::runtime_error(trial.folder.string() + " holds no answers; run answer first");
  return sessions;
}

json foretellAll(const Trial& trial) {
  const auto sessions = answeredSessions(trial);
  std::vector<json> entries(sessions.size());
  const auto name_of = [&](std::size_t i) { return sessions[i].first.at("file").get<std::string>(); };
  sideBySide(trial.jobs, sessions.size(), name_of,
             [&](std::size_t i) { entries[i] = foretold(trial, sessions[i].first, sessions[i].second); });
  return {{"schema", "fieldtrue.blind-foretold/1"}, {"sessions", entries}};
}

}  // namespace

int runForetell(std::span<const std::string> words) {
  return statusOf([&] {
    const Trial trial = trialOf(words);
    const json all = foretellAll(trial);
    replaceFile(trial.folder / "foretold.json", all.dump(1));
    const auto& entries = all.at("sessions");
    const auto failed =
        std::count_if(entries.begin(), entries.end(), [](const json& entry) { return entry.contains("trouble"); });
    std::cout << entries.size() << " scenes put to the test, " << failed << " of them could not be simulated\n";
  });
}

}  // namespace blind
