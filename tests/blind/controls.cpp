#include "tests/blind/controls.h"

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <stdexcept>
#include <vector>

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

/// @return false when the session has not what this control changes
using Change = bool (*)(Tables& tables, std::uint64_t seed);

struct Control {
  const char* name;
  const char* shelf;
  Change change;
};

bool shuffle(Tables& tables, std::uint64_t seed) {
  shufflePlaces(tables.nodes, seed);
  return true;
}

/// The whole floor, seating and scatter of readings; samples would tell the scatter again and are left out.
bool scaleFloor(Tables& tables, double factor) {
  scaleScatter(tables.nodes, factor);
  tables.samples.reset();
  return scaleJigTolerance(tables.nodes, factor);
}

bool raiseFloor(Tables& tables, std::uint64_t) { return scaleFloor(tables, 1.2); }

bool lowerFloor(Tables& tables, std::uint64_t) { return scaleFloor(tables, 0.8); }

bool mirror(Tables& tables, std::uint64_t) {
  mirrorTracked(tables.nodes);
  if (tables.samples) mirrorTracked(*tables.samples);
  return true;
}

bool reverse(Tables& tables, std::uint64_t) {
  const double end_s =
      std::max(latestTime(tables.nodes), tables.samples ? latestTime(*tables.samples) : latestTime(tables.nodes));
  if (!reverseTime(tables.nodes, end_s)) return false;
  return !tables.samples || reverseTime(*tables.samples, end_s);
}

constexpr Control kControls[] = {{"shuffled", "single", shuffle},
                                 {"floor_+20%", "none", raiseFloor},
                                 {"floor_-20%", "none", lowerFloor},
                                 {"mirrored", "single", mirror},
                                 {"time_reversed", "none", reverse}};

Tables tablesOf(const fs::path& folder, const std::string& file) {
  Tables tables;
  tables.nodes = readTable(folder / (file + ".nodes.csv"));
  if (const fs::path samples = folder / (file + ".samples.csv"); fs::exists(samples))
    tables.samples = readTable(samples);
  return tables;
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
    if (!control.change(tables, at + 1)) continue;
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

void writeFolder(const std::map<std::string, std::string>& options) {
  if (options.count("--in") == 0 || options.count("--out") == 0)
    throw std::invalid_argument("controls: --in DIR and --out DIR2 are needed");
  const fs::path in = options.at("--in");
  const fs::path out = options.at("--out");
  const double count = options.count("--count") > 0 ? numberIn(options.at("--count")) : 20.0;
  if (!(count >= 1.0) || count > 1e6) throw std::invalid_argument("controls: --count needs a number from 1");
  const json truth = openSealed(in);
  if (fs::exists(out / "truth.json"))
    throw std::runtime_error(out.string() + " holds a sealed set already; name an empty folder");
  fs::create_directories(out);
  json written = json::array();
  for (const Control& control : kControls)
    writeControls(in, out, control, static_cast<std::size_t>(count), truth.at("sessions"), written);
  if (written.empty())
    throw std::runtime_error(in.string() + " holds no session with one effect or with none to make controls of");
  sealTruth(out, {{"schema", "fieldtrue.blind/1"},
                  {"seed", truth.value("seed", json())},
                  {"role", truth.value("role", json("dev"))},
                  {"sessions", written}});
}

}  // namespace

int runControls(std::span<const std::string> words) {
  static constexpr std::string_view kWithValue[] = {"--in", "--out", "--count"};
  return statusOf([&] { writeFolder(optionsOf(words, "controls", kWithValue, {})); });
}

}  // namespace blind
