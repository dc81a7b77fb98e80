#include <QCoreApplication>
#include <QObject>
#include <QTimer>
#include <iostream>
#include <string>
#include <vector>

#include "acquisition/search/tracker_search.h"
#include "app/cli.h"
#include "app/cli_signals.h"

/// find: which tracker is on which line.
namespace fieldtrue::cli {
namespace {

struct FindOptions {
  std::vector<std::string> lines;
};

nlohmann::json adapterJson(const std::optional<acquisition::UsbAdapter>& adapter) {
  if (!adapter) return nullptr;
  return {{"vendor", adapter->vendor},
          {"product", adapter->product},
          {"serial", adapter->serial},
          {"description", adapter->description}};
}

nlohmann::json trackerJson(const std::optional<acquisition::FoundTracker>& tracker) {
  if (!tracker) return nullptr;
  return {{"kind", tracker->kind},
          {"label", tracker->label},
          {"device", tracker->device},
          {"model", tracker->answer.model},
          {"firmware", tracker->answer.firmware},
          {"sensors", tracker->answer.sensors},
          {"sensor_names", tracker->answer.sensor_names},
          {"was_streaming", tracker->was_streaming}};
}

nlohmann::json findingJson(const acquisition::LineFinding& finding) {
  return {{"line", finding.line},
          {"adapter", adapterJson(finding.adapter)},
          {"tracker", trackerJson(finding.tracker)},
          {"text", finding.text},
          {"note", finding.note}};
}

std::string findingText(const acquisition::LineFinding& finding) {
  std::string text = (finding.tracker ? finding.tracker->device : finding.line) + "  " + finding.text + "\n";
  if (!finding.note.empty()) text += "      " + finding.note + "\n";
  return text;
}

Outcome runFind(const FindOptions& options, const CommonOptions& common) {
  acquisition::TrackerSearch search(options.lines);
  // As they come: the slowest line may take a minute.
  if (!common.json) {
    QObject::connect(&search, &acquisition::TrackerSearch::lineDone, &search,
                     [](const acquisition::LineFinding& finding) { std::cout << findingText(finding) << std::flush; });
  }
  QObject::connect(
      &search, &acquisition::TrackerSearch::finished, &search, [] { QCoreApplication::quit(); }, Qt::QueuedConnection);
  const EndRequest end_request([&search] { search.stop(); });
  QTimer::singleShot(0, &search, &acquisition::TrackerSearch::start);
  QCoreApplication::exec();
  Answer answer;
  answer.json = {{"schema", "fieldtrue.find/1"}, {"lines", nlohmann::json::array()}};
  std::size_t found = 0;
  for (const acquisition::LineFinding& finding : search.findings()) {
    answer.json["lines"].push_back(findingJson(finding));
    found += finding.tracker ? 1 : 0;
  }
  const std::size_t lines = answer.json["lines"].size();
  answer.text =
      lines == 0 ? "This machine has no serial line, and no server listens at a usual port; name a line with --line\n"
                 : std::to_string(found) + " of " + std::to_string(lines) + " lines have a known tracker\n";
  return answer;
}

}  // namespace

void addFindCommand(CommandLine& line) {
  auto [command, options] = line.add("find", "Find out which tracker is on which line; 60 s at most", runFind);
  command
      ->add_option(
          "--line", options->lines,
          "A line to look at, as often as wanted: /dev/ttyUSB0, tcp:HOST:PORT; default every serial line of this "
          "machine and the usual ports")
      ->type_name("LINE");
}

}  // namespace fieldtrue::cli
