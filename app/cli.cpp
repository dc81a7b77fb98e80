#include "app/cli.h"

#include <unistd.h>

#include <QCoreApplication>
#include <algorithm>
#include <array>
#include <clocale>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "app/cli_barrier.h"
#include "calib/core/file_io.h"
#include "calib/core/memory_limit.h"
#include "calib/core/thread_pool.h"

namespace fieldtrue::cli {
namespace {

constexpr const char* kProgram = "fieldtrue-cli";

/// One line on a terminal that counts up to 100 % and disappears when the work is over.
class ProgressLine {
 public:
  explicit ProgressLine(std::string label) : label_(std::move(label)) {}
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  ~ProgressLine() {
    if (shown_percent_ >= 0) std::fputs("\r\033[K", stderr);
  }

  void show(double fraction) {
    const int percent = static_cast<int>(100.0 * std::clamp(fraction, 0.0, 1.0));
    const std::lock_guard lock(mutex_);
    if (percent <= shown_percent_) return;
    shown_percent_ = percent;
    std::fprintf(stderr, "\r%s %3d %%", label_.c_str(), percent);
    std::fflush(stderr);
  }

 private:
  std::string label_;
  std::mutex mutex_;
  int shown_percent_ = -1;
};

std::string onOneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

/// What a slot of the event loop threw first; Qt cannot carry an exception through its loop.
std::optional<std::string>& thrownInEvent() {
  static std::optional<std::string> thrown;
  return thrown;
}

/// Ends the event loop when a slot throws, so that the command ends with its sentence.
class Application : public QCoreApplication {
 public:
  using QCoreApplication::QCoreApplication;

  bool notify(QObject* receiver, QEvent* event) override {
    const Result<bool> handled = commandBarrier([&] { return QCoreApplication::notify(receiver, event); });
    if (handled) return *handled;
    if (!thrownInEvent()) thrownInEvent() = handled.error().message;
    quit();
    return false;
  }
};

int complain(const std::string& who, const Failure& failure) {
  std::cerr << who << ": " << onOneLine(failure.message) << '\n';
  return failure.status;
}

/// Prints what a command has to say. @return the exit status
int finish(const std::string& who, const Outcome& outcome, bool as_json) {
  if (const auto& thrown = thrownInEvent()) return complain(who, {kNotPossible, *thrown});
  if (!outcome) return complain(who, outcome.error());
  for (const std::string& remark : outcome->remarks) std::cerr << "note: " << remark << '\n';
  if (as_json) {
    // A name in another encoding than UTF-8 is told with replacement marks; the work itself is done.
    std::cout << outcome->json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
  } else {
    std::cout << outcome->text;
  }
  std::cout.flush();
  if (!std::cout) return complain(who, {kNotPossible, "the answer could not be written to standard output"});
  return kDone;
}

/// What is wrong with an option that is to name a file and names none; empty when nothing is.
std::string emptyFileName(const CLI::App& command) {
  static constexpr std::array<std::string_view, 5> kNamesFile = {"FILE", "CSV", "PATH", "LINK", "PLAN"};
  for (const CLI::Option* option : command.get_options()) {
    const std::string type = option->get_type_name();
    if (std::find(kNamesFile.begin(), kNamesFile.end(), type) == kNamesFile.end() || option->count() == 0) continue;
    const std::vector<std::string>& given = option->results();
    if (std::find(given.begin(), given.end(), "") != given.end())
      return option->get_name() + (type == "PLAN" ? " needs a plan" : " needs a file name");
  }
  return {};
}

/// The options of a command that name what it writes.
struct Outputs {
  std::string_view command;
  std::vector<std::string_view> options;
};
const std::vector<Outputs>& outputs() {
  static const std::vector<Outputs> all = {{"simulate", {"--nodes", "--samples"}},
                                           {"tables", {"--nodes", "--samples"}},
                                           {"import", {"--nodes", "--samples", "--calibration"}},
                                           {"acquire", {"--session", "--trace"}},
                                           {"fit", {"--out"}},
                                           {"compare", {"--html"}},
                                           {"apply", {"--out"}},
                                           {"export", {"--out"}},
                                           {"report", {"--html"}},
                                           {"resample", {"--nodes-out"}},
                                           {"diagnose", {"--out", "--html", "--updated-scene"}}};
  return all;
}

bool isSameFile(const std::string& a, const std::string& b) {
  std::error_code ignored;
  if (std::filesystem::exists(a, ignored) && !std::filesystem::is_regular_file(a, ignored)) return false;
  if (std::filesystem::equivalent(a, b, ignored)) return true;
  return std::filesystem::weakly_canonical(a, ignored) == std::filesystem::weakly_canonical(b, ignored);
}

/// What a command would write over: a file that it reads, or that it writes under another option. Empty when nothing.
std::string writtenOver(const CLI::App& command) {
  const auto found = std::find_if(outputs().begin(), outputs().end(),
                                  [&](const Outputs& one) { return one.command == command.get_name(); });
  if (found == outputs().end()) return {};
  for (const CLI::Option* other : command.get_options()) {
    for (const std::string_view name : found->options) {
      const CLI::Option* output = command.get_option_no_throw(std::string(name));
      if (!output || output == other || output->count() == 0 || other->count() == 0) continue;
      if (other->get_items_expected_max() == 0) continue;  // A flag.
      if (isSameFile(output->results().front(), other->results().front()))
        return other->get_name() + " and " + output->get_name() + " name the same file, " + output->results().front() +
               ", which would be written over; choose another name";
    }
  }
  return {};
}

}  // namespace

RunControl runControl(const CommonOptions& common, const std::string& label) {
  RunControl control;
  control.parallel_for = threadedFor(common.threads);
  if (isatty(STDERR_FILENO) != 0) {
    control.progress = [line = std::make_shared<ProgressLine>(label)](double fraction) { line->show(fraction); };
  }
  return control;
}

CommandLine::CommandLine() : app_("Calibrates electromagnetic trackers.", kProgram) {
  app_.require_subcommand(1);
  app_.set_version_flag("--version", std::string("Fieldtrue ") + FIELDTRUE_VERSION);
  app_.footer(
      "Exit status: 0 done, 1 the data or device does not allow it, 2 wrong usage.\n"
      "Help of one command: fieldtrue-cli COMMAND --help");
}

CLI::App* CommandLine::addCommand(const std::string& name, const std::string& help) {
  CLI::App* command = app_.add_subcommand(name, help);
  command->add_flag("--json", common_.json, "Print machine-readable output on stdout");
  command->add_option("--threads", common_.threads, "Threads to use; default all; never changes a result")
      ->type_name("N")
      ->check(CLI::Range(1, 4096));
  return command;
}

std::string CommandLine::unknownCommand(int argc, char** argv) const {
  if (argc < 2 || argv[1][0] == '-') return {};
  std::string known;
  for (const CLI::App* command : app_.get_subcommands({})) {
    if (command->get_name() == argv[1]) return {};
    known += (known.empty() ? "" : ", ") + command->get_name();
  }
  return "there is no command '" + std::string(argv[1]) + "'; known: " + known;
}

std::string CommandLine::unknownOption() const {
  const std::vector<std::string> unread = app_.remaining(true);
  const auto found = std::find_if(unread.begin(), unread.end(),
                                  [](const std::string& one) { return one.size() > 1 && one.front() == '-'; });
  return found == unread.end() ? std::string() : *found;
}

int CommandLine::run(int argc, char** argv) {
  if (const std::string unknown = unknownCommand(argc, argv); !unknown.empty()) {
    return complain(kProgram, {kWrongUsage, unknown});
  }
  try {
    app_.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      app_.exit(error);
      return kDone;
    }
    const std::string unknown = unknownOption();
    const std::string wrong = unknown.empty() ? error.what() : "there is no option " + unknown;
    return complain(kProgram, {kWrongUsage, wrong + " (help: fieldtrue-cli --help)"});
  }
  const CLI::App& command = *app_.get_subcommands().front();
  const std::string who = std::string(kProgram) + " " + command.get_name();
  if (const std::string empty = emptyFileName(command); !empty.empty()) return complain(who, {kWrongUsage, empty});
  if (const std::string clash = writtenOver(command); !clash.empty()) return complain(who, {kWrongUsage, clash});
  const Result<int> status = commandBarrier([&] { return finish(who, run_(), common_.json); });
  return status ? *status : complain(who, {kNotPossible, status.error().message});
}

}  // namespace fieldtrue::cli

int main(int argc, char** argv) {
  fieldtrue::outliveFileSizeLimit();
  fieldtrue::keepFreedMemory();
  const fieldtrue::cli::Application application(argc, argv);
  std::setlocale(LC_NUMERIC, "C");  // QCoreApplication takes over the user's, and numbers in files have a point.
  fieldtrue::cli::CommandLine line;
  fieldtrue::cli::addDataCommands(line);
  fieldtrue::cli::addExportCommand(line);
  fieldtrue::cli::addApplyCommand(line);
  fieldtrue::cli::addAcquireCommand(line);
  fieldtrue::cli::addEmulateCommand(line);
  fieldtrue::cli::addFindCommand(line);
  fieldtrue::cli::addSignalCommand(line);
  fieldtrue::cli::addFitCommands(line);
  fieldtrue::cli::addDifferenceCommand(line);
  fieldtrue::cli::addResampleCommand(line);
  fieldtrue::cli::addGapCommands(line);
  fieldtrue::cli::addListCommands(line);
  fieldtrue::cli::addGuideCommand(line);
  return fieldtrue::cli::endProgram(line.run(argc, argv));
}
