#include "tests/blind/foretell.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <stdexcept>
#include <vector>

#include "tests/blind/bare_alignment.h"
#include "tests/blind/batch.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/session_table.h"
#include "tests/blind/sha256.h"
#include "tests/blind/subprocess.h"
#include "tests/blind/temporary_folder.h"
#include "tests/blind/unseen_places.h"

namespace blind {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr const char* kForetoldSchema = "fieldtrue.blind-foretold/1";

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

/// @error std::runtime_error where the scene is not the one that was answered
fs::path sceneAsAnswered(const Batch& batch, const json& session, const std::string& scene_sha256) {
  const fs::path scene = batch.folder / (session.at("file").get<std::string>() + ".scene.json");
  if (sha256Hex(textOf(scene)) != scene_sha256)
    throw std::runtime_error(scene.string() + " was changed after it was answered");
  return scene;
}

json foretold(const Batch& batch, const json& session, const fs::path& scene) {
  const std::string file = session.at("file").get<std::string>();
  json entry = {{"file", file}};
  const SessionTable unseen = sealedPlaces(batch.folder, session);
  const TemporaryFolder desk;
  replaceFile(desk.path() / "unseen.plan.json", planOf(unseen, byTime(unseen)).dump());
  const Finished run = runProgram({batch.cli.string(), "simulate", "--exact", "--threads", "1", "--scene",
                                   scene.string(), "--plan", (desk.path() / "unseen.plan.json").string(), "--nodes",
                                   (desk.path() / "foretold.nodes.csv").string()});
  if (run.exit_status != 0) {
    entry["trouble"] = "simulate ended with status " + std::to_string(run.exit_status);
    return entry;
  }
  entry.update(comparedWithSealed(readTable(batch.folder / (file + ".nodes.csv")), unseen,
                                  byPlace(unseen, readTable(desk.path() / "foretold.nodes.csv"))));
  return entry;
}

/// Hash of each session's scene that was answered here; what was kept from elsewhere has been foretold there.
std::map<std::string, std::string> scenesIn(const fs::path& folder) {
  std::map<std::string, std::string> scene_of;
  const json answers = documentOf(folder / "answers.json");
  for (const json& record : answers.at("sessions"))
    if (record.contains("scene_sha256")) scene_of[record.at("file")] = record.at("scene_sha256");
  return scene_of;
}

}  // namespace

int runForetell(std::span<const std::string> words) {
  static constexpr std::string_view kWithValue[] = {"--in", "--cli", "--jobs"};
  return statusOf([&] {
    const Batch batch = batchOf(optionsOf(words, "foretell", kWithValue, {}), "foretell");
    needProgram(batch);
    const std::map<std::string, std::string> scene_of = scenesIn(batch.folder);
    std::vector<json> sessions;
    const json truth = openSealed(batch.folder);
    for (const json& session : truth.at("sessions"))
      if (scene_of.count(session.at("file")) > 0) sessions.push_back(session);
    if (sessions.empty()) throw std::runtime_error(batch.folder.string() + " holds no answers; run answer first");
    const auto scene_for = [&](const json& session) {
      return sceneAsAnswered(batch, session, scene_of.at(session.at("file")));
    };
    const auto hash_of = [&](const json& session) {
      return sha256Hex(sha256Hex(textOf(scene_for(session))) + session.at("unseen_sha256").get<std::string>());
    };
    const auto make = [&](const json& session) { return foretold(batch, session, scene_for(session)); };
    const std::size_t made =
        ResultFile(batch.folder / "foretold.json", kForetoldSchema).fill(batch.jobs, sessions, hash_of, make);
    const json entries = documentOf(batch.folder / "foretold.json").at("sessions");
    const auto failed =
        std::count_if(entries.begin(), entries.end(), [](const json& entry) { return entry.contains("trouble"); });
    std::cout << made << " scenes put to the test, " << failed << " of all " << entries.size()
              << " could not be simulated\n";
  });
}

}  // namespace blind
