#include "tests/blind/remake.h"

#include <algorithm>
#include <stdexcept>

#include "tests/blind/sealed_folder.h"
#include "tests/blind/sha256.h"

namespace blind {
namespace {

using nlohmann::json;

/// Sets of before these two were written down: sample tables for all are seen, any number of rows is assumed.
SessionWish wishOf(const std::filesystem::path& folder, const json& truth, const json& session) {
  SessionWish wish;
  wish.shelf = session.at("shelf").get<std::string>();
  if (wish.shelf == "unforeseen") wish.kind = session.at("effects").at(0).at("id").get<std::string>();
  if (const json& level = session.at("rho_level"); level.is_number()) wish.level = level.get<double>();
  const json& sessions = truth.at("sessions");
  wish.samples = truth.contains("samples_for_all")
                     ? truth.at("samples_for_all").get<bool>()
                     : std::all_of(sessions.begin(), sessions.end(), [&](const json& one) {
                         return std::filesystem::exists(folder / (one.at("file").get<std::string>() + ".samples.csv"));
                       });
  wish.most_rows = truth.value("most_rows", std::size_t{0});
  return wish;
}

}  // namespace

MadeSession remadeSession(const std::filesystem::path& folder, const json& truth, const std::string& file) {
  if (!truth.contains("seed"))
    throw std::runtime_error(folder.string() + " states no seed, so its sessions cannot be made again");
  const json& sessions = truth.at("sessions");
  const auto found =
      std::find_if(sessions.begin(), sessions.end(), [&](const json& one) { return one.at("file") == file; });
  if (found == sessions.end()) throw std::runtime_error(folder.string() + " holds no " + file);
  const auto seed = truth.at("seed").get<std::uint64_t>();
  const auto index = static_cast<std::size_t>(found - sessions.begin());
  MadeSession made = makeSession(wishOf(folder, truth, *found), sessionSeeds(seed, sessions.size())[index]);
  if (sha256Hex(made.tables.unseen_csv) != found->at("unseen_sha256").get<std::string>() ||
      made.tables.nodes_csv != textOf(folder / (file + ".nodes.csv")))
    throw std::runtime_error("made again from seed " + std::to_string(seed) +
                             " it is another session; the set needs the build that generated it");
  return made;
}

}  // namespace blind
