#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/run_control.h"

namespace fieldtrue::cli {

/// Exit statuses of fieldtrue-cli.
inline constexpr int kDone = 0;         ///< It did what was asked.
inline constexpr int kNotPossible = 1;  ///< The data or the device does not allow it.
inline constexpr int kWrongUsage = 2;   ///< The command line itself is wrong.

/// Why a command ended without doing what was asked.
struct Failure {
  int status = kNotPossible;
  std::string message;  ///< One line: what was seen, what is needed.
};

/// What a command has to say when it is done: for people, or for programs with `--json`.
struct Answer {
  std::string text;
  nlohmann::json json = nlohmann::json::object();
  std::vector<std::string> remarks;  ///< On the input; printed on stderr, so that stdout stays clean.
};

using Outcome = tl::expected<Answer, Failure>;

/// Ends a command because the data or device does not allow it.
inline tl::unexpected<Failure> notPossible(const Error& error) {
  return tl::unexpected<Failure>(Failure{kNotPossible, error.message});
}
inline tl::unexpected<Failure> notPossible(std::string message) {
  return tl::unexpected<Failure>(Failure{kNotPossible, std::move(message)});
}

/// Ends a command because of what was written on the command line.
inline tl::unexpected<Failure> wrongUsage(const Error& error) {
  return tl::unexpected<Failure>(Failure{kWrongUsage, error.message});
}
inline tl::unexpected<Failure> wrongUsage(std::string message) {
  return tl::unexpected<Failure>(Failure{kWrongUsage, std::move(message)});
}

/// What every command accepts.
struct CommonOptions {
  bool json = false;
  int threads = 0;  ///< 0 = all.
};

/// How long work runs: on as many threads as asked for, with a progress line on stderr when it is a terminal.
RunControl runControl(const CommonOptions& common, const std::string& label);

/// The program's command line: the commands, and the one that was asked for.
class CommandLine {
 public:
  CommandLine();

  /// Adds a command; its options are bound to the returned value and handed to `body` when the command is the one asked
  /// for.
  template <class Options>
  std::pair<CLI::App*, std::shared_ptr<Options>> add(const std::string& name, const std::string& help,
                                                     Outcome (*body)(const Options&, const CommonOptions&)) {
    auto options = std::make_shared<Options>();
    CLI::App* command = addCommand(name, help);
    command->callback([this, options, body] { run_ = [this, options, body] { return body(*options, common_); }; });
    return {command, options};
  }

  /// Reads the arguments, runs the command and prints what it has to say.
  /// @return the exit status
  int run(int argc, char** argv);

 private:
  CLI::App* addCommand(const std::string& name, const std::string& help);
  /// What is wrong with the command's name; empty when it is known or left out.
  std::string unknownCommand(int argc, char** argv) const;
  /// The first argument that looks like an option and is none of the command's; empty when there is none.
  std::string unknownOption() const;

  CLI::App app_;
  CommonOptions common_;
  std::function<Outcome()> run_;
};

void addDataCommands(CommandLine& line);       ///< simulate, tables, import
void addExportCommand(CommandLine& line);      ///< export
void addApplyCommand(CommandLine& line);       ///< apply
void addFitCommands(CommandLine& line);        ///< fit, compare, report
void addDifferenceCommand(CommandLine& line);  ///< difference
void addAcquireCommand(CommandLine& line);     ///< acquire
void addEmulateCommand(CommandLine& line);     ///< emulate
void addFindCommand(CommandLine& line);        ///< find
void addSignalCommand(CommandLine& line);      ///< signal
void addResampleCommand(CommandLine& line);    ///< resample
void addGapCommands(CommandLine& line);        ///< diagnose, plan-check, blind
void addListCommands(CommandLine& line);       ///< methods, effects, devices, formats
void addGuideCommand(CommandLine& line);       ///< guide

}  // namespace fieldtrue::cli
