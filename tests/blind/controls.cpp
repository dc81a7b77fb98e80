#include "tests/blind/controls.h"

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <stdexcept>
#include <vector>

#include "tests/blind/control_changes.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/session_table.h"

namespace blind {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// A session's tables while it is being changed.
struct Tables {
  SessionTable nodes;
  std::optional<SessionTable> samples;
};

/// A session of the set that controls are made from.
struct Source {
  const fs::path& folder;
  const json& sessions;
  std::size_t at = 0;

  std::uint64_t seed() const { return at + 1; }
};

/// @return false when the session has not what this control changes
using Change = bool (*)(Tables& tables, const Source& source);

struct Control {
  const char* name;
  const char* shelf;
  Wanted wanted;
  bool is_effect_free_family;
  Change change;
};

Tables tablesOf(const fs::path& folder, const std::string& file) {
  Tables tables;
  tables.nodes = readTable(folder / (file + ".nodes.csv"));
  if (const fs::path samples = folder / (file + ".samples.csv"); fs::exists(samples))
    tables.samples = readTable(samples);
  return tables;
}

bool shuffle(Tables& tables, const Source& source) {
  shufflePlaces(tables.nodes, source.seed());
  return true;
}

/// The whole floor, seating and scatter of readings; samples would tell the scatter again and are left out.
bool scaleFloor(Tables& tables, double factor) {
  scaleScatter(tables.nodes, factor);
  tables.samples.reset();
  return scaleJigTolerance(tables.nodes, factor);
}

bool raiseFloor(Tables& tables, const Source&) { return scaleFloor(tables, 1.2); }

bool lowerFloor(Tables& tables, const Source&) { return scaleFloor(tables, 0.8); }

bool mirror(Tables& tables, const Source&) {
  mirrorTracked(tables.nodes);
  if (tables.samples) mirrorTracked(*tables.samples);
  return true;
}

bool reverse(Tables& tables, const Source&) {
  const double end_s =
      std::max(latestTime(tables.nodes), tables.samples ? latestTime(*tables.samples) : latestTime(tables.nodes));
  if (!reverseTime(tables.nodes, end_s)) return false;
  return !tables.samples || reverseTime(*tables.samples, end_s);
}

bool reverseDrift(Tables& tables, const Source& source) {
  const std::string id = source.sessions[source.at].at("effects").at(0).at("id").get<std::string>();
  return (id == "gain_drift" || id == "metal_moved") && reverse(tables, source);
}

bool dropTolerance(Tables& tables, const Source&) { return dropJigTolerance(tables.nodes); }

bool halveTolerance(Tables& tables, const Source&) { return scaleJigTolerance(tables.nodes, 0.5); }

/// Samples would tell the readings as they were.
bool redden(Tables& tables, const Source& source) {
  tables.samples.reset();
  return reddenNoise(tables.nodes, source.seed());
}

bool permute(Tables& tables, const Source& source) {
  tables.samples.reset();
  return permuteResiduals(tables.nodes, source.seed());
}

/// The next session with one effect and as many rows at least; where there is none, the next.
bool exchangeTruth(Tables& tables, const Source& source) {
  std::optional<SessionTable> other;
  for (std::size_t step = 1; step < source.sessions.size(); ++step) {
    const json& session = source.sessions[(source.at + step) % source.sessions.size()];
    if (session.value("shelf", "") != "single") continue;
    SessionTable nodes = readTable(source.folder / (session.at("file").get<std::string>() + ".nodes.csv"));
    const bool is_long_enough = nodes.rows.size() >= tables.nodes.rows.size();
    if (!other || is_long_enough) other = std::move(nodes);
    if (is_long_enough) break;
  }
  if (!other) return false;
  tables.samples.reset();
  takePlaces(tables.nodes, *other);
  return true;
}

constexpr Control kControls[] = {{"shuffled", "single", Wanted::kNoCause, false, shuffle},
                                 {"floor_+20%", "none", Wanted::kNoGap, false, raiseFloor},
                                 {"floor_-20%", "none", Wanted::kNoCause, false, lowerFloor},
                                 {"mirrored", "single", Wanted::kNoCause, false, mirror},
                                 {"time_reversed", "none", Wanted::kNoGap, false, reverse},
                                 {"red_noise", "none", Wanted::kNoGap, true, redden},
                                 {"tolerance_absent", "none", Wanted::kNoGap, true, dropTolerance},
                                 // That places are less exact than stated is a finding, and right.
                                 {"tolerance_half", "none", Wanted::kNoCause, true, halveTolerance},
                                 {"other_truth", "single", Wanted::kNoCause, false, exchangeTruth},
                                 {"residuals_permuted", "single", Wanted::kNoCause, false, permute},
                                 {"drift_reversed", "single", Wanted::kNoOtherCause, false, reverseDrift}};

const Control* controlNamed(std::string_view name) {
  const auto* found = std::find_if(std::begin(kControls), std::end(kControls),
                                   [&](const Control& control) { return control.name == name; });
  return found == std::end(kControls) ? nullptr : found;
}

std::string controlFile(std::size_t number) {
  char text[32];
  std::snprintf(text, sizeof text, "control_%04zu", number);
  return text;
}

void writeControls(const fs::path& in, const fs::path& out, const Control& control, std::size_t wanted,
                   const json& sessions, json& written) {
  std::size_t made = 0;
  for (std::size_t at = 0; at < sessions.size() && made < wanted; ++at) {
    if (sessions[at].value("shelf", "") != control.shelf) continue;
    const std::string source = sessions[at].at("file").get<std::string>();
    Tables tables = tablesOf(in, source);
    if (!control.change(tables, {in, sessions, at})) continue;
    const std::string file = controlFile(written.size() + 1);
    writeTable(out / (file + ".nodes.csv"), tables.nodes);
    if (tables.samples) writeTable(out / (file + ".samples.csv"), *tables.samples);
    json session = sessions[at];
    session["file"] = file;
    session["source"] = source;
    session["control"] = control.name;
    session["oracle"] = nullptr;
    written.push_back(std::move(session));
    ++made;
  }
  std::cout << control.name << ": " << made << " sessions\n";
}

std::size_t countIn(const std::map<std::string, std::string>& options, const char* name, std::size_t otherwise) {
  const auto given = options.find(name);
  if (given == options.end()) return otherwise;
  const double count = numberIn(given->second);
  if (!(count >= 1.0) || count > 1e6)
    throw std::invalid_argument(std::string("controls: ") + name + " needs a number from 1");
  return static_cast<std::size_t>(count);
}

void writeFolder(const std::map<std::string, std::string>& options) {
  if (options.count("--in") == 0 || options.count("--out") == 0)
    throw std::invalid_argument("controls: --in DIR and --out DIR2 are needed");
  const fs::path in = options.at("--in");
  const fs::path out = options.at("--out");
  const std::size_t count = countIn(options, "--count", 20);
  const std::size_t effect_free = countIn(options, "--effect-free", count);
  const json truth = openSealed(in);
  if (fs::exists(out / "truth.json"))
    throw std::runtime_error(out.string() + " holds a sealed set already; name an empty folder");
  fs::create_directories(out);
  json written = json::array();
  for (const Control& control : kControls)
    writeControls(in, out, control, control.is_effect_free_family ? effect_free : count, truth.at("sessions"), written);
  if (written.empty())
    throw std::runtime_error(in.string() + " holds no session with one effect or with none to make controls of");
  sealTruth(out, {{"schema", "fieldtrue.blind/1"},
                  {"seed", truth.value("seed", json())},
                  {"role", truth.value("role", json("dev"))},
                  {"sessions", written}});
}

}  // namespace

std::optional<Wanted> wantedOf(std::string_view control) {
  const Control* found = controlNamed(control);
  return found == nullptr ? std::nullopt : std::optional(found->wanted);
}

bool isEffectFreeFamily(std::string_view control) {
  const Control* found = controlNamed(control);
  return found != nullptr && found->is_effect_free_family;
}

int runControls(std::span<const std::string> words) {
  static constexpr std::string_view kWithValue[] = {"--in", "--out", "--count", "--effect-free"};
  return statusOf([&] { writeFolder(optionsOf(words, "controls", kWithValue, {})); });
}

}  // namespace blind
