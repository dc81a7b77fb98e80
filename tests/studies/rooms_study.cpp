// Accuracy of every method in the rooms of resources/rooms, and how far the verdict can be trusted.
//   rooms_study [--seeds 20] [--threads 1] [--stride 1] [--only accuracy|apply] [--json FILE]
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/studies/accuracy_study.h"

int main(int argc, char** argv) {
  using namespace fieldtrue::testing;
  std::map<std::string, std::string> given{
      {"--seeds", "20"}, {"--threads", "1"}, {"--stride", "1"}, {"--only", ""}, {"--json", ""}};
  for (int i = 1; i < argc; i += 2) {
    if (!given.contains(argv[i]) || i + 1 == argc) {
      std::fprintf(stderr, "%s is not known or lacks its value; there are --seeds --threads --stride --only --json\n",
                   argv[i]);
      return 2;
    }
    given[argv[i]] = argv[i + 1];
  }
  const StudyOptions options{std::atoi(given["--seeds"].c_str()), std::atoi(given["--threads"].c_str()),
                             std::atoi(given["--stride"].c_str())};
  if (options.seeds < 1 || options.threads < 1 || options.stride < 1) {
    std::fprintf(stderr, "--seeds, --threads and --stride need whole numbers of 1 or more\n");
    return 2;
  }
  nlohmann::json json = nlohmann::json::object();
  if (given["--only"] != "apply") json["accuracy"] = accuracyStudy(options);
  if (given["--only"] != "accuracy") json["apply"] = applyStudy(options);
  if (!given["--json"].empty()) std::ofstream(given["--json"]) << json.dump(1) << '\n';
  return 0;
}
