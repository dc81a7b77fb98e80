#include "tests/blind/diagnosis_run.h"

#include "tests/blind/sealed_folder.h"
#include "tests/blind/subprocess.h"
#include "tests/blind/temporary_folder.h"

namespace blind {

namespace fs = std::filesystem;

/// Replicates alone may take ten minutes.
constexpr double kDiagnosisLimit_s = 1200.0;

Recording recordingOf(const fs::path& folder, const std::string& file) {
  const fs::path samples = folder / (file + ".samples.csv");
  return {textOf(folder / (file + ".nodes.csv")), fs::exists(samples) ? textOf(samples) : ""};
}

nlohmann::json diagnosed(const fs::path& cli, const Recording& recording, const std::vector<std::string>& more) {
  const TemporaryFolder desk;
  const fs::path nodes = desk.path() / "nodes.csv", samples = desk.path() / "samples.csv";
  const fs::path report = desk.path() / "report.gap.json";
  replaceFile(nodes, recording.nodes_csv);
  std::vector<std::string> words = {cli.string(), "diagnose",      "--nodes",   nodes.string(),
                                    "--out",      report.string(), "--threads", "1"};
  if (!recording.samples_csv.empty()) {
    replaceFile(samples, recording.samples_csv);
    words.insert(words.end(), {"--samples", samples.string()});
  }
  words.insert(words.end(), more.begin(), more.end());
  const bool is_done = runProgram(words, kDiagnosisLimit_s).exit_status == 0 && fs::exists(report);
  return is_done ? documentOf(report) : nlohmann::json(nullptr);
}

}  // namespace blind
