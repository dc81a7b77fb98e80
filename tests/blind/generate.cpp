#include "tests/blind/generate.h"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <iostream>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <vector>

#include "tests/blind/generate_session.h"
#include "tests/blind/physics.h"
#include "tests/blind/plan_classes.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/sha256.h"
#include "tests/blind/side_by_side.h"

namespace blind {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

struct Options {
  fs::path out;
  fs::path cli;
  std::uint64_t seed = 0;
  std::size_t sessions = 0;
  std::size_t jobs = 1;
  std::size_t most_rows = 0;
  std::optional<double> strength;
  std::string shelf = "all";
  std::string role = "dev";
  bool samples = false;
  bool levels = false;
  std::size_t batch = 0;  ///< of unforeseen kinds on top; 0: none
};

std::uint64_t wholeNumber(const std::string& option, const std::string& text, std::uint64_t low, std::uint64_t high) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < low || value > high)
    throw std::invalid_argument("generate: " + option + " needs a whole number from " + std::to_string(low) + " to " +
                                std::to_string(high) + ", got '" + text + "'");
  return value;
}

double strengthOf(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= 0.1) || value > 5)
    throw std::invalid_argument("generate: --strength needs a gap to noise from 0.1 to 5, got '" + text + "'");
  return value;
}

std::string oneOf(const std::string& option, const std::string& text, std::initializer_list<const char*> known) {
  std::string list;
  for (const char* word : known) {
    if (text == word) return text;
    list += (list.empty() ? "" : ", ") + std::string(word);
  }
  throw std::invalid_argument("generate: " + option + " is one of " + list + ", got '" + text + "'");
}

Options parse(std::span<const std::string> arguments) {
  static constexpr std::string_view kWithValue[] = {"--out",      "--seed",     "--sessions", "--count",
                                                    "--threads",  "--jobs",     "--role",     "--shelf",
                                                    "--max-rows", "--strength", "--cli",      "--unforeseen"};
  static constexpr std::string_view kFlags[] = {"--samples", "--levels"};
  const auto given = optionsOf(arguments, "generate", kWithValue, kFlags);
  Options options;
  for (const auto& [name, text] : given) {
    if (name == "--out") options.out = text;
    if (name == "--cli") options.cli = text;
    if (name == "--seed") options.seed = wholeNumber(name, text, 0, std::numeric_limits<std::uint64_t>::max());
    if (name == "--sessions" || name == "--count") options.sessions = wholeNumber(name, text, 1, 99999);
    if (name == "--threads" || name == "--jobs") options.jobs = wholeNumber(name, text, 1, 256);
    if (name == "--max-rows") options.most_rows = wholeNumber(name, text, 48, 100000);
    if (name == "--unforeseen") options.batch = wholeNumber(name, text, 1, unforeseenBatches().size());
    if (name == "--strength") options.strength = strengthOf(text);
    if (name == "--role") options.role = oneOf(name, text, {"dev", "test"});
    if (name == "--shelf")
      options.shelf = oneOf(name, text, {"all", "none", "single", "pairs", "off", "unforeseen", "signals"});
  }
  options.samples = given.count("--samples") > 0;
  options.levels = given.count("--levels") > 0;
  if (options.levels && options.strength)
    throw std::invalid_argument("generate: --levels and --strength exclude each other");
  if (options.out.empty()) throw std::invalid_argument("generate: --out DIR is needed, the folder to write");
  if (given.count("--seed") == 0) throw std::invalid_argument("generate: --seed N is needed, a whole number from 0");
  if (options.sessions == 0) throw std::invalid_argument("generate: --sessions K is needed, how many to write");
  if (options.cli.empty()) options.cli = fs::read_symlink("/proc/self/exe").parent_path() / "fieldtrue-cli";
  return options;
}

/// Two sessions of each unforeseen kind at each of the four strengths.
void wishUnforeseen(const Options& options, std::vector<SessionWish>& wishes) {
  for (const std::string& kind : unforeseenIds(options.batch))
    for (const double level : kLevels)
      for (int twice = 0; twice < 2; ++twice)
        wishes.push_back({"unforeseen", level, options.samples, options.most_rows, kind});
}

/// Shelves in their shares; of one effect alone a fifth of the sessions at each of the four strengths.
std::vector<SessionWish> drawWishes(const Options& options) {
  struct Share {
    const char* shelf;
    double share;
  };
  constexpr Share kShares[] = {{"none", 0.25}, {"single", 0.45}, {"pairs", 0.12}, {"off", 0.15}, {"signals", 0.03}};
  std::vector<std::string> shelves;
  double upto = 0;
  for (const Share& share : kShares) {
    upto += share.share;
    const auto end = static_cast<std::size_t>(std::llround(upto * static_cast<double>(options.sessions)));
    while (shelves.size() < end) shelves.emplace_back(options.shelf == "all" ? share.shelf : options.shelf);
  }
  const std::vector<std::string> unforeseen = unforeseenIds(std::max<std::size_t>(options.batch, 1));
  std::map<std::string, std::size_t> seen;
  std::vector<SessionWish> wishes;
  for (const std::string& shelf : shelves) {
    SessionWish wish{shelf, std::nullopt, options.samples, options.most_rows, ""};
    const std::size_t before = seen[shelf]++, turn = before % 5;
    if (shelf == "unforeseen") wish.kind = unforeseen.at(before / 5 % unforeseen.size());
    if (shelf == "single" || shelf == "off" || shelf == "unforeseen")
      wish.level = options.levels && turn < 4 ? std::optional(kLevels[turn]) : options.strength;
    wishes.push_back(std::move(wish));
  }
  if (options.batch > 0 && options.shelf != "unforeseen") wishUnforeseen(options, wishes);
  // An order that tells nothing; sessionSeeds() counts these draws.
  Random random(options.seed);
  for (std::size_t n = wishes.size(); n > 1; --n)
    std::swap(wishes[n - 1], wishes[static_cast<std::size_t>(uniformInt(random, 0, static_cast<int>(n) - 1))]);
  return wishes;
}

std::string nameOf(std::size_t index) {
  char name[32];
  std::snprintf(name, sizeof name, "session_%04zu", index + 1);
  return name;
}

/// Strength of the weakest effect; 0 where there is none.
double weakestOf(const json& effects) {
  double weakest = 0.0;
  for (const json& effect : effects) {
    const double rho = effect["rho"].get<double>();
    if (weakest == 0.0 || rho < weakest) weakest = rho;
  }
  return weakest;
}

/// Writes the tables of one session.
/// @return its truth, with the classes that plan-check declares beside those of this program's own physics
json writeSession(const Options& options, const SessionWish& wish, const std::string& name, std::uint64_t seed,
                  bool asks_plan_check) {
  GeneratedSession session = makeSession(wish, seed).tables;
  const fs::path nodes = options.out / (name + ".nodes.csv");
  replaceFile(nodes, session.nodes_csv);
  if (!session.samples_csv.empty()) replaceFile(options.out / (name + ".samples.csv"), session.samples_csv);
  replaceFile(options.out / "unseen" / (name + ".csv"), session.unseen_csv);
  session.truth["unseen_sha256"] = sha256Hex(session.unseen_csv);
  session.truth["file"] = name;
  session.truth["own_classes"] = session.truth["classes"];
  if (!asks_plan_check) return session.truth;
  const std::optional<Classes> declared =
      planCheckClasses(options.cli, nodes, catalogueIds(), weakestOf(session.truth["effects"]));
  if (!declared) throw std::runtime_error(options.cli.string() + " plan-check declares no classes");
  session.truth["classes"] = *declared;
  return session.truth;
}

std::vector<json> writeSessions(const Options& options, bool asks_plan_check) {
  const std::vector<SessionWish> wishes = drawWishes(options);
  const std::vector<std::uint64_t> seeds = sessionSeeds(options.seed, wishes.size());
  std::vector<json> truths(wishes.size());
  sideBySide(options.jobs, wishes.size(), nameOf, [&](std::size_t n) {
    truths[n] = writeSession(options, wishes[n], nameOf(n), seeds[n], asks_plan_check);
  });
  return truths;
}

/// How long a session took to make would tell what it is made of.
void levelTimeStamps(const fs::path& folder) {
  const fs::file_time_type now = fs::last_write_time(folder / "truth.json");
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.path().filename().string().rfind("session_", 0) == 0) fs::last_write_time(entry.path(), now);
}

void writeFolder(const Options& options) {
  if (fs::exists(options.out / "truth.json"))
    throw std::runtime_error(options.out.string() + " holds a sealed set already; name an empty folder");
  std::error_code trouble;
  fs::create_directories(options.out / "unseen", trouble);
  if (trouble) throw std::runtime_error("cannot make the folder " + options.out.string() + ": " + trouble.message());
  const bool asks_plan_check = ::access(options.cli.c_str(), X_OK) == 0;
  const std::vector<json> truths = writeSessions(options, asks_plan_check);
  sealTruth(options.out, {{"schema", "fieldtrue.blind/1"},
                          {"seed", options.seed},
                          {"role", options.role},
                          {"samples_for_all", options.samples},
                          {"most_rows", options.most_rows},
                          {"classes_from", asks_plan_check ? "plan-check" : "generator"},
                          {"sessions", truths}});
  levelTimeStamps(options.out);
  std::cout << "sealed " << truths.size() << " sessions, classes as declared by "
            << (asks_plan_check ? "plan-check" : "this program (no fieldtrue-cli; name it with --cli)")
            << "\ntruth sha256 " << sha256Hex(textOf(options.out / "truth.json")) << '\n';
}

}  // namespace

int runGenerate(std::span<const std::string> arguments) {
  try {
    writeFolder(parse(arguments));
    return 0;
  } catch (const std::invalid_argument& error) {
    std::cerr << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "generate: " << error.what() << '\n';
    return 1;
  }
}

}  // namespace blind
