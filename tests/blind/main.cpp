#include <exception>
#include <iostream>
#include <span>
#include <string>
#include <vector>

#include "tests/blind/answer.h"
#include "tests/blind/controls.h"
#include "tests/blind/generate.h"
#include "tests/blind/score.h"

namespace {

constexpr const char* kUsage =
    "usage: fieldtrue-blind generate --out DIR --seed N --sessions K [--shelf all|none|single|pairs|off|signals]\n"
    "                                [--samples] [--role dev|test] [--levels] [--threads T]\n"
    "       fieldtrue-blind answer|score|controls ...\n";

struct Command {
  const char* name;
  int (*run)(std::span<const std::string>);
};

constexpr Command kCommands[] = {{"generate", blind::runGenerate},
                                 {"answer", blind::runAnswer},
                                 {"score", blind::runScore},
                                 {"controls", blind::runControls}};

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.empty()) {
    std::cerr << kUsage;
    return 2;
  }
  for (const Command& command : kCommands) {
    if (arguments.front() != command.name) continue;
    try {
      return command.run(std::span(arguments).subspan(1));
    } catch (const std::exception& problem) {
      std::cerr << "fieldtrue-blind " << command.name << ": " << problem.what() << '\n';
      return 1;
    }
  }
  const bool asked = arguments.front() == "--help" || arguments.front() == "-h";
  (asked ? std::cout : std::cerr) << kUsage;
  return asked ? 0 : 2;
}
