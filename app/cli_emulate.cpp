#include <QCoreApplication>
#include <QObject>
#include <QTimer>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "acquisition/devices/registry.h"
#include "acquisition/emulators/emulator_faults.h"
#include "acquisition/emulators/pose_source.h"
#include "app/cli.h"
#include "app/cli_signals.h"
#include "app/cli_values.h"
#include "calib/tables/table_io.h"

/// emulate: plays the device side of a tracker's protocol on a pty or a TCP port.
namespace fieldtrue::cli {
namespace {

struct EmulateOptions {
  std::string tracker;
  std::string pty_link;
  std::optional<int> port;
  std::string scene;
  std::string replay;
  std::string faults;
  std::uint64_t seed = 1;
  int sensors = 1;
  std::optional<double> duration_s;
};

Read<acquisition::Emulation> readEmulation(const EmulateOptions& options, std::vector<std::string>& notes) {
  if (options.pty_link.empty() == !options.port) {
    return wrongUsage("an emulator needs one line: --pty LINK or --listen PORT");
  }
  if (!options.scene.empty() && !options.replay.empty()) {
    return wrongUsage("--scene and --replay exclude each other: a recording is sent as it is");
  }
  acquisition::Emulation emulation;
  emulation.pty_link = options.pty_link;
  emulation.tcp_port = options.port;
  emulation.seed = options.seed;
  emulation.sensors = options.sensors;
  const auto faults = acquisition::parseFaults(options.faults, options.tracker);
  if (!faults) return wrongUsage(faults.error());
  emulation.faults = *faults;
  const auto scene = readSceneArgument(options.scene);
  if (!scene) return tl::unexpected(scene.error());
  emulation.scene = *scene;
  if (options.replay.empty()) return emulation;
  auto recording = readSampleTable(std::filesystem::path(options.replay));
  if (!recording) return notPossible(recording.error());
  notes = recording->notes;
  emulation.replay = std::move(recording->table);
  return emulation;
}

Outcome runEmulate(const EmulateOptions& options, const CommonOptions& common) {
  const auto kind = acquisition::findEmulated(options.tracker);
  if (!kind) return wrongUsage(kind.error());
  Answer answer;
  const auto emulation = readEmulation(options, answer.remarks);
  if (!emulation) return tl::unexpected(emulation.error());
  auto emulator = (*kind)->emulate(*emulation);
  if (!emulator) return notPossible(emulator.error());
  acquisition::EmulatorRunner& runner = **emulator;
  std::ostream& lines = common.json ? std::cerr : std::cout;
  QObject::connect(&runner, &acquisition::EmulatorRunner::notice, &runner,
                   [&lines](const QString& text) { lines << text.toStdString() << std::endl; });
  QObject::connect(&runner, &acquisition::EmulatorRunner::unplugged, &runner,
                   [&lines] { lines << "The line is unplugged" << std::endl; });
  const EndRequest end_request([] { QCoreApplication::quit(); });
  const auto started = runner.start();
  if (!started) return notPossible(started.error());
  const std::string address = runner.endpoint().address().toStdString();
  lines << (*kind)->label << " emulator at " << address << ", device " << (*kind)->id << ":" << address
        << "   Ctrl-C ends it" << std::endl;
  if (options.duration_s) {
    QTimer::singleShot(static_cast<int>(std::ceil(1000.0 * *options.duration_s)), &runner,
                       [] { QCoreApplication::quit(); });
  }
  QCoreApplication::exec();
  answer.json = {{"tracker", (*kind)->id}, {"address", address}, {"records_sent", runner.recordsSent()}};
  answer.text = std::to_string(runner.recordsSent()) + " records sent\n";
  return answer;
}

std::string emulatedKinds() {
  std::string ids;
  for (const acquisition::DeviceKind& kind : acquisition::deviceKinds())
    if (kind.emulate) ids += (ids.empty() ? "" : ", ") + kind.id;
  return ids;
}

std::string faultsHelp() {
  std::string text = "Comma-separated faults to exercise a driver with:";
  for (const acquisition::EmulatorFault& fault : acquisition::emulatorFaults()) {
    text += "\n  " + fault.id + (fault.needs_count ? "=N" : "") + "  " + fault.help +
            (fault.only_of.empty() ? "" : " (" + fault.only_of + ")");
  }
  return text;
}

}  // namespace

void addEmulateCommand(CommandLine& line) {
  auto [command, options] = line.add("emulate", "Play the device side of a tracker on a pty or TCP port", runEmulate);
  command->add_option("tracker", options->tracker, "Which tracker: " + emulatedKinds())->type_name("KIND")->required();
  command->add_option("--pty", options->pty_link, "Symbolic link to make for the pseudo-terminal")->type_name("LINK");
  command->add_option("--listen", options->port, "TCP port to listen on; 0 = any free one")
      ->type_name("PORT")
      ->check(CLI::Range(0, 65535));
  command->add_option("--scene", options->scene, "Scene the tracker stands in (*.scene.json); default a clean room")
      ->type_name("FILE");
  command->add_option("--replay", options->replay, "Sample table to play instead, at the times it was recorded")
      ->type_name("CSV");
  command->add_option("--faults", options->faults, faultsHelp())->type_name("LIST");
  command->add_option("--sensors", options->sensors, "Sensors on the jig, 4 cm apart along its y (default 1)")
      ->type_name("N")
      ->check(CLI::Range(1, static_cast<int>(acquisition::kMostSensors)));
  addSeedOption(*command, options->seed, "Seed of noise and faults (default 1)");
  command->add_option("--duration", options->duration_s, "End by itself after so many seconds")
      ->type_name("S")
      ->check(numberWithin(0.0, 1e6));
}

}  // namespace fieldtrue::cli
