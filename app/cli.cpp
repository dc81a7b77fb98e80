#include "app/cli.h"

#include <unistd.h>

#include <QCoreApplication>
#include <algorithm>
#include <clocale>
#include <cstdio>
#include <iostream>
#include <memory>
#include <mutex>

#include "widgets/report/thread_pool.h"

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

int complain(const std::string& who, const Failure& failure) {
  std::cerr << who << ": " << onOneLine(failure.message) << '\n';
  return failure.status;
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
    return complain(kProgram, {kWrongUsage, std::string(error.what()) + " (help: fieldtrue-cli --help)"});
  }
  const std::string who = std::string(kProgram) + " " + app_.get_subcommands().front()->get_name();
  const Outcome outcome = run_();
  if (!outcome) return complain(who, outcome.error());
  for (const std::string& remark : outcome->remarks) std::cerr << "note: " << remark << '\n';
  if (common_.json) {
    std::cout << outcome->json.dump(2) << '\n';
  } else {
    std::cout << outcome->text;
  }
  std::cout.flush();
  if (!std::cout) return complain(who, {kNotPossible, "the answer could not be written to standard output"});
  return kDone;
}

}  // namespace fieldtrue::cli

int main(int argc, char** argv) {
  const QCoreApplication application(argc, argv);
  std::setlocale(LC_NUMERIC, "C");  // QCoreApplication takes over the user's, and numbers in files have a point.
  fieldtrue::cli::CommandLine line;
  fieldtrue::cli::addDataCommands(line);
  fieldtrue::cli::addApplyCommand(line);
  fieldtrue::cli::addAcquireCommand(line);
  fieldtrue::cli::addEmulateCommand(line);
  fieldtrue::cli::addFitCommands(line);
  fieldtrue::cli::addResampleCommand(line);
  fieldtrue::cli::addGapCommands(line);
  fieldtrue::cli::addListCommands(line);
  return line.run(argc, argv);
}
