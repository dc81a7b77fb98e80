// What half and double of every figure by which the diagnosis decides do, on sessions of the blind generator whose
// truth is open:
//   tuning_study [--jobs N] [--sessions N] [--only NAME]... FOLDER...
// Each FOLDER is written by `fieldtrue-blind generate` or `controls`. What was diagnosed stays in its tuning.json, so
// that a run that was stopped goes on. Prints a Markdown table.
#include <iostream>
#include <limits>

#include "tests/studies/tuning.h"

namespace {

struct Words {
  std::vector<std::filesystem::path> folders;
  std::vector<std::string> only;
  std::size_t jobs = 1;
  std::size_t most = std::numeric_limits<std::size_t>::max();  ///< Sessions of each folder.
};

Words wordsOf(int argc, char** argv) {
  Words words;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (!word.starts_with("--"))
      words.folders.emplace_back(word);
    else if (word == "--jobs" && i + 1 < argc)
      words.jobs = std::stoul(argv[++i]);
    else if (word == "--sessions" && i + 1 < argc)
      words.most = std::stoul(argv[++i]);
    else if (word == "--only" && i + 1 < argc)
      words.only.emplace_back(argv[++i]);
    else
      throw std::invalid_argument(word + " is not known or lacks its value");
  }
  if (words.folders.empty() || words.jobs < 1)
    throw std::invalid_argument("tuning_study [--jobs N] [--sessions N] [--only NAME]... FOLDER...");
  return words;
}

}  // namespace

int main(int argc, char** argv) {
  return blind::statusOf([&] {
    const Words words = wordsOf(argc, argv);
    const auto ones = fieldtrue::testing::chosen(words.only);
    fieldtrue::testing::runTrials(words.folders, ones, words.most, words.jobs);
    std::cout << fieldtrue::testing::tuningTable(words.folders, ones);
  });
}
