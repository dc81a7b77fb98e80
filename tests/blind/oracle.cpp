#include "tests/blind/oracle.h"

#include <algorithm>
#include <stdexcept>

#include "tests/blind/bare_alignment.h"
#include "tests/blind/batch.h"
#include "tests/blind/refit.h"
#include "tests/blind/remake.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/sha256.h"
#include "tests/blind/unseen_places.h"

namespace blind {
namespace {

using nlohmann::json;

constexpr const char* kOracleSchema = "fieldtrue.blind-oracle/1";

std::vector<SolvedPose> foretoldBy(const Refit& fit, const SessionTable& unseen) {
  std::vector<SolvedPose> poses;
  for (const auto& fields : unseen.rows) {
    const auto number = [&](const char* name) { return numberIn(fields[unseen.neededColumn(name)]); };
    const SolvedPose place = truePose(unseen, fields);
    Row row;
    row.place_m = place.position_m;
    row.attitude = place.orientation;
    row.i = static_cast<int>(number("i"));
    row.j = static_cast<int>(number("j"));
    row.k = static_cast<int>(number("k"));
    row.start_s = row.end_s = number("t_s");
    poses.push_back(reported(fit.setup, fit.world, row));
  }
  return poses;
}

/// Sessions `from` to `to` that have an effect of the mean pose.
std::vector<json> withEffects(const json& truth, std::size_t from, std::size_t to) {
  const json& sessions = truth.at("sessions");
  std::vector<json> kept;
  for (std::size_t n = from; n <= std::min(to, sessions.size()); ++n) {
    const std::string shelf = sessions[n - 1].at("shelf").get<std::string>();
    if (shelf == "single" || shelf == "pairs" || shelf == "off" || shelf == "unforeseen")
      kept.push_back(sessions[n - 1]);
  }
  if (kept.empty())
    throw std::runtime_error("sessions " + std::to_string(from) + " to " +
                             std::to_string(std::min(to, sessions.size())) +
                             ": none of them has an effect of the mean pose");
  return kept;
}

}  // namespace

json oracleOf(const MadeSession& made, const SessionTable& nodes, const SessionTable& unseen) {
  std::vector<SolvedPose> readings;
  for (const auto& row : nodes.rows) readings.push_back(trackedPose(nodes, row));
  const Refit known = refitted(made.setup, made.effects, asDrawn(made.effects), readings, false);
  const Refit fitted = refitted(made.setup, made.effects, asDrawn(made.effects), readings, true);
  json entry = comparedWithSealed(nodes, unseen, foretoldBy(fitted, unseen));
  entry["parameters_known"] = comparedWithSealed(nodes, unseen, foretoldBy(known, unseen));
  entry["cost"] = fitted.cost;
  entry["parameters_known"]["cost"] = known.cost;
  return entry;
}

int runOracle(std::span<const std::string> words) {
  static constexpr std::string_view kWithValue[] = {"--in", "--jobs", "--from", "--to"};
  return statusOf([&] {
    const auto options = optionsOf(words, "oracle", kWithValue, {});
    const Batch batch = batchOf(options, "oracle");
    const std::size_t from = wholeOption(options, "oracle", "--from", 1, 1, 99999);
    const std::size_t to = wholeOption(options, "oracle", "--to", 99999, from, 99999);
    const json truth = openSealed(batch.folder);
    const std::vector<json> sessions = withEffects(truth, from, to);
    const auto made_from = [&](const json& session) {
      const std::string file = session.at("file").get<std::string>();
      return sha256Hex(kOracleSchema + session.dump() + textOf(batch.folder / (file + ".nodes.csv")) +
                       textOf(batch.folder / "unseen" / (file + ".csv")));
    };
    const auto make = [&](const json& session) {
      const std::string file = session.at("file").get<std::string>();
      return oracleOf(remadeSession(batch.folder, truth, file), readTable(batch.folder / (file + ".nodes.csv")),
                      sealedPlaces(batch.folder, session));
    };
    const std::size_t fitted =
        ResultFile(batch.folder / "oracle.json", kOracleSchema).fill(batch.jobs, sessions, made_from, make);
    tellMade(fitted, sessions.size(), "fitted with their true effects");
  });
}

}  // namespace blind
