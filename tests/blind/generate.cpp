#include "tests/blind/generate.h"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "tests/blind/generate_session.h"
#include "tests/blind/physics.h"
#include "tests/blind/sha256.h"

namespace blind {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

struct Options {
  fs::path out;
  std::uint64_t seed = 0;
  int sessions = 0;
  int threads = 1;
  std::string shelf = "all";
  std::string role = "dev";
  bool samples = false;
  bool levels = false;
  bool seed_given = false;
};

template <typename Number>
bool parseNumber(const std::string& text, Number& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

std::optional<std::string> parse(std::span<const std::string> arguments, Options& options) {
  for (std::size_t a = 0; a < arguments.size(); ++a) {
    const std::string& name = arguments[a];
    if (name == "--samples" || name == "--levels") {
      (name == "--samples" ? options.samples : options.levels) = true;
      continue;
    }
    if (a + 1 == arguments.size()) return name + " is not known or needs a value after it";
    const std::string& value = arguments[++a];
    bool good = true;
    if (name == "--out") {
      options.out = value;
    } else if (name == "--seed") {
      good = options.seed_given = parseNumber(value, options.seed);
    } else if (name == "--sessions") {
      good = parseNumber(value, options.sessions) && options.sessions > 0 && options.sessions < 100000;
    } else if (name == "--threads") {
      good = parseNumber(value, options.threads) && options.threads > 0 && options.threads <= 256;
    } else if (name == "--role") {
      options.role = value;
      good = value == "dev" || value == "test";
    } else if (name == "--shelf") {
      options.shelf = value;
      const std::string known[] = {"all", "none", "single", "pairs", "off", "signals"};
      good = std::find(std::begin(known), std::end(known), value) != std::end(known);
    } else {
      return "unknown option " + name;
    }
    if (!good) return "cannot use " + name + " " + value;
  }
  if (options.out.empty()) return "needs --out, the folder to write";
  if (!options.seed_given) return "needs --seed, a whole number from 0";
  if (options.sessions == 0) return "needs --sessions, how many to write";
  return std::nullopt;
}

/// Shelves in their shares, in an order that tells nothing.
std::vector<std::string> drawShelves(const Options& options, Random& random) {
  struct Share {
    const char* shelf;
    double share;
  };
  constexpr Share kShares[] = {{"none", 0.25}, {"single", 0.45}, {"pairs", 0.12}, {"off", 0.15}, {"signals", 0.03}};
  const auto wanted = static_cast<std::size_t>(options.sessions);
  std::vector<std::string> shelves;
  double upto = 0;
  for (const Share& share : kShares) {
    upto += share.share;
    const auto end = static_cast<std::size_t>(std::llround(upto * options.sessions));
    while (shelves.size() < std::min(end, wanted)) shelves.emplace_back(share.shelf);
  }
  if (options.shelf != "all") return std::vector<std::string>(wanted, options.shelf);
  for (std::size_t n = shelves.size(); n > 1; --n)
    std::swap(shelves[n - 1], shelves[static_cast<std::size_t>(uniformInt(random, 0, static_cast<int>(n) - 1))]);
  return shelves;
}

void write(const fs::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

std::string nameOf(std::size_t index) {
  char name[32];
  std::snprintf(name, sizeof name, "session_%04zu", index + 1);
  return name;
}

}  // namespace

int runGenerate(std::span<const std::string> arguments) {
  Options options;
  if (const auto problem = parse(arguments, options)) {
    std::cerr << "fieldtrue-blind generate: " << *problem << '\n';
    return 2;
  }
  fs::create_directories(options.out);
  Random random(options.seed);
  const std::vector<std::string> shelves = drawShelves(options, random);
  std::vector<std::uint64_t> seeds;
  for (std::size_t n = 0; n < shelves.size(); ++n) seeds.push_back(random());
  std::vector<json> truths(shelves.size());
  std::atomic<std::size_t> next{0};
  std::mutex guard;
  std::string problem;
  const auto work = [&] {
    for (std::size_t n = next++; n < shelves.size(); n = next++) try {
        GeneratedSession session = generateSession({shelves[n], options.levels, options.samples}, seeds[n]);
        session.truth["file"] = nameOf(n);
        truths[n] = std::move(session.truth);
        write(options.out / (nameOf(n) + ".nodes.csv"), session.nodes_csv);
        if (!session.samples_csv.empty()) write(options.out / (nameOf(n) + ".samples.csv"), session.samples_csv);
      } catch (const std::exception& error) {
        const std::lock_guard lock(guard);
        problem = nameOf(n) + ": " + error.what();
      }
  };
  std::vector<std::thread> threads;
  for (int t = 1; t < options.threads; ++t) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  if (!problem.empty()) {
    std::cerr << "fieldtrue-blind generate: " << problem << '\n';
    return 1;
  }
  const std::string truth =
      json{{"schema", "fieldtrue.blind/1"}, {"seed", options.seed}, {"role", options.role}, {"sessions", truths}}.dump(
          1) +
      "\n";
  const json seal = {{"schema", "fieldtrue.blind-seal/1"},
                     {"truth_sha256", sha256Hex(truth)},
                     {"sessions", shelves.size()},
                     {"role", options.role}};
  write(options.out / "truth.json", truth);
  write(options.out / "seal.json", seal.dump(1) + "\n");
  std::cout << "sealed " << shelves.size() << " sessions, truth sha256 " << sha256Hex(truth) << '\n';
  return 0;
}

}  // namespace blind
