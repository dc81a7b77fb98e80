#include "acquisition/emulators/fastrak_emulator.h"

#include "acquisition/emulators/pty_endpoint.h"

namespace fieldtrue::acquisition {
namespace {

/// Five places in front of the transmitter, in the rig's frame.
std::vector<Pose> walk(const simulation::Scene& scene) {
  std::vector<Pose> places;
  for (const auto& p :
       {Eigen::Vector3d(0.35, 0.0, 0.0), Eigen::Vector3d(0.35, 0.2, 0.0), Eigen::Vector3d(0.5, 0.2, 0.15),
        Eigen::Vector3d(0.5, -0.2, 0.15), Eigen::Vector3d(0.35, -0.2, -0.1)}) {
    places.push_back(scene.reference_from_tracker * Pose{p, Eigen::Quaterniond::Identity()});
  }
  return places;
}

Result<std::unique_ptr<PoseSource>> makeSource(const Emulation& emulation) {
  if (emulation.replay) {
    if (emulation.replay->rows.empty()) {
      return fail(ErrorCode::kBadInput, "The recording to replay has no rows; at least one sample is needed");
    }
    for (const auto& row : emulation.replay->rows) {
      if (row.sample.sensor >= 0 && row.sample.sensor < kFastrakStations) continue;
      return fail(ErrorCode::kBadInput,
                  "The recording holds sensor " + std::to_string(row.sample.sensor) + "; a Fastrak has sensors 0 to 3");
    }
    return std::make_unique<ReplaySource>(*emulation.replay);
  }
  constexpr double kStand_s = 3.0;
  FT_TRY(auto simulator, simulation::TrackerSimulator::make(emulation.scene, emulation.seed));
  auto jig = std::make_unique<SimulatedJig>(std::move(simulator), OperatorHabits{}, emulation.seed);
  jig->wander(walk(emulation.scene), kStand_s);
  return jig;
}

}  // namespace

Result<std::unique_ptr<EmulatorRunner>> makeFastrakEmulator(const Emulation& emulation) {
  if (emulation.pty_link.empty() == !emulation.tcp_port.has_value()) {
    return fail(ErrorCode::kBadInput, "An emulator needs one line: --pty LINK or --listen PORT");
  }
  FT_TRY(auto source, makeSource(emulation));
  FastrakEmulatorOptions options;
  options.faults = emulation.faults;
  options.seed = emulation.seed;
  std::unique_ptr<EmulatorEndpoint> endpoint;
  if (emulation.tcp_port) {
    endpoint = std::make_unique<TcpEndpoint>(static_cast<quint16>(*emulation.tcp_port));
  } else {
    endpoint = std::make_unique<PtyEndpoint>(QString::fromStdString(emulation.pty_link));
  }
  return std::make_unique<EmulatorRunner>(std::make_unique<FastrakEmulatorCore>(std::move(source), options),
                                          std::move(endpoint), emulation.faults, emulation.speed);
}

std::unique_ptr<EmulatorRunner> makeFastrakEmulator(std::unique_ptr<PoseSource> source,
                                                    std::unique_ptr<LoopbackTransport> device_end,
                                                    const FastrakEmulatorOptions& options, double speed) {
  return std::make_unique<EmulatorRunner>(std::make_unique<FastrakEmulatorCore>(std::move(source), options),
                                          std::make_unique<LoopbackEndpoint>(std::move(device_end)), options.faults,
                                          speed);
}

}  // namespace fieldtrue::acquisition
