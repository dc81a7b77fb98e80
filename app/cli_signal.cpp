#include <QCoreApplication>
#include <QObject>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include "acquisition/devices/registry.h"
#include "acquisition/session/signal_snapshot.h"
#include "app/cli.h"
#include "app/cli_signals.h"
#include "app/cli_values.h"
#include "calib/core/number_text.h"

/// signal: what every sensor of a tracker sends, and what is to be said of it before a day's recording.
namespace fieldtrue::cli {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

struct SignalOptions {
  std::string device;
  std::string scene;
  double seconds = 10.0;
};

/// Listens to a device on the event loop, so many of its own seconds.
class Listener {
 public:
  Listener(acquisition::TrackerDevice& device, double seconds) : device_(device), seconds_(seconds) {
    QObject::connect(&device, &acquisition::TrackerDevice::samplesReceived, &context_,
                     [this](const std::vector<Sample>& samples) { onSamples(samples); });
    // Queued: a device may answer while it is being started, before the event loop runs.
    QObject::connect(
        &device, &acquisition::TrackerDevice::stateChanged, &context_,
        [this](acquisition::DeviceState state, const QString& text) { onState(state, text); }, Qt::QueuedConnection);
  }

  /// What was heard, or why nothing was.
  Read<acquisition::SignalSnapshot> listen() {
    const EndRequest end_request([] { QCoreApplication::quit(); });
    device_.start();
    QCoreApplication::exec();
    context_.disconnect();
    acquisition::SignalSnapshot snapshot{window_.sensors(), device_.describe()};
    if (snapshot.sensors.empty()) return notPossible(failure_.empty() ? "no reading has come" : failure_);
    if (!is_over_ && has_failed_) return notPossible(shortText());
    return snapshot;
  }

  /// What was not heard of what was asked for, and why; empty where nothing is wanting.
  std::string shortText() const {
    if (is_over_) return {};
    const std::string why = failure_.empty() ? "stopped on request" : failure_;
    return "heard " + fixedText(heard_s_, 1) + " of " + fixedText(seconds_, 0) + " s: " + why;
  }

 private:
  void onSamples(const std::vector<Sample>& samples) {
    for (const Sample& sample : samples) {
      if (!first_s_) first_s_ = sample.time_s;
      heard_s_ = sample.time_s - *first_s_;
      is_over_ = is_over_ || heard_s_ >= seconds_;
      if (is_over_) return QCoreApplication::quit();
      window_.add(sample);
    }
  }
  void onState(acquisition::DeviceState state, const QString& text) {
    if (state != acquisition::DeviceState::kFailed && state != acquisition::DeviceState::kClosed) return;
    has_failed_ = state == acquisition::DeviceState::kFailed;
    failure_ = text.toStdString();
    QCoreApplication::quit();
  }

  acquisition::TrackerDevice& device_;
  QObject context_;
  double seconds_;
  acquisition::SignalWindow window_;
  std::optional<double> first_s_;
  double heard_s_ = 0.0;
  bool is_over_ = false;
  bool has_failed_ = false;
  std::string failure_;
};

nlohmann::json vectorJson(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

nlohmann::json spectrumJson(const std::optional<recording::SampleSpectrum>& spectrum) {
  if (!spectrum) return nullptr;
  nlohmann::json lines = nlohmann::json::array();
  for (const recording::SpectralLine& line : spectrum->lines)
    lines.push_back({{"frequency_hz", line.frequency_hz}, {"amplitude_sd", line.amplitude_sd}});
  return {{"frequencies_hz", spectrum->frequencies_hz},
          {"power", spectrum->power},
          {"background", spectrum->background},
          {"lines", lines}};
}

nlohmann::json numbersJson(const acquisition::JudgedSignal& signal) {
  const acquisition::SignalReport& report = signal.report;
  nlohmann::json json = {{"sensor", report.sensor},
                         {"readings", report.readings},
                         {"rate_hz", report.rate_hz},
                         {"marks", report.marks},
                         {"rested_s", report.rested_s},
                         {"position_m", nullptr},
                         {"orientation_wxyz", nullptr},
                         {"sd_m", nullptr},
                         {"expected_sd_m", nullptr},
                         {"drift_m_per_s", nullptr},
                         {"drift_sd_m_per_s", nullptr},
                         {"correlation", nullptr},
                         {"n_effective", nullptr},
                         {"least_sd_m", nullptr},
                         {"spectrum", spectrumJson(report.spectrum)}};
  if (report.stand) {
    const Eigen::Quaterniond q = canonical(report.stand->orientation);
    json["position_m"] = vectorJson(report.stand->position_m);
    json["orientation_wxyz"] = {q.w(), q.x(), q.y(), q.z()};
    json["sd_m"] = vectorJson(report.noise->sds_m);
    json["least_sd_m"] = report.least_sd_m;
    json["sd_rot_rad"] = report.sd_rot_rad;
    json["correlation"] = report.correlation;
    json["n_effective"] = report.worth;
  }
  if (signal.expected_sd_m) json["expected_sd_m"] = *signal.expected_sd_m;
  if (report.drift) {
    json["drift_m_per_s"] = vectorJson(report.drift->m_per_s);
    json["drift_sd_m_per_s"] = report.drift->sd_m_per_s;
  }
  return json;
}

std::string numbersText(const acquisition::SignalReport& report) {
  std::string text = "Sensor " + std::to_string(report.sensor) + "  " + fixedText(report.rate_hz, 1) + " Hz";
  for (const auto& [mark, count] : report.marks) text += ", " + std::to_string(count) + " readings marked " + mark;
  text += "\n";
  if (!report.stand) return text + "  it moves\n";
  const Eigen::Vector3d& p_m = report.stand->position_m;
  const Eigen::Vector3d turn_deg = eulerFromRotation_rad(report.stand->orientation) / kDegree;
  const Eigen::Vector3d sds_mm = 1000.0 * report.noise->sds_m;
  text += "  at " + fixedText(p_m.x(), 3) + ", " + fixedText(p_m.y(), 3) + ", " + fixedText(p_m.z(), 3) +
          " m, azimuth " + fixedText(turn_deg.x(), 1) + ", elevation " + fixedText(turn_deg.y(), 1) + ", roll " +
          fixedText(turn_deg.z(), 1) + " degrees\n";
  text += "  SD " + significantText(sds_mm.norm()) + " mm (" + significantText(sds_mm[0]) + ", " +
          significantText(sds_mm[1]) + ", " + significantText(sds_mm[2]) + " along its axes, the largest " +
          fixedText(report.noise->from_line_of_sight_rad / kDegree, 0) + " degrees from the line of sight), " +
          significantText(report.sd_rot_rad / kDegree) + " degrees\n";
  return text + "  " + std::to_string(report.of_stand) + " readings are worth " + fixedText(report.worth, 0) + "\n";
}

Outcome runSignal(const SignalOptions& options, const CommonOptions&) {
  const auto scene = readSceneArgument(options.scene);
  if (!scene) return tl::unexpected(scene.error());
  const auto device = acquisition::makeDevice(options.device, *scene);
  if (!device) return wrongUsage(device.error());
  Listener listener(**device, options.seconds);
  const auto snapshot = listener.listen();
  if (!snapshot) return tl::unexpected(snapshot.error());
  Answer answer;
  if (const std::string wanting = listener.shortText(); !wanting.empty()) answer.text = "Only " + wanting + "\n";
  answer.json = {{"schema", "fieldtrue.signal/1"}, {"sensors", nlohmann::json::array()}};
  for (const acquisition::JudgedSignal& signal : judged(*snapshot)) {
    nlohmann::json json = numbersJson(signal);
    answer.text += numbersText(signal.report);
    for (const acquisition::SignalQuestion& question : acquisition::signalQuestions()) {
      const acquisition::Answer said = question.answer(signal, {});
      constexpr std::array kVerdicts = {"not_known", "good", "look"};
      json["answers"][question.id] = {{"verdict", kVerdicts[static_cast<std::size_t>(said.verdict)]},
                                      {"text", said.text}};
      answer.text += "  " + std::string(question.text) + " " + said.text + "\n";
    }
    answer.json["sensors"].push_back(std::move(json));
  }
  return answer;
}

}  // namespace

void addSignalCommand(CommandLine& line) {
  auto [command, options] =
      line.add("signal", "Tell what a tracker's sensors send: noise, spectrum, drift, and what is wrong", runSignal);
  addDeviceOptions(*command, options->device, options->scene);
  command->add_option("--seconds", options->seconds, "Listen so long, by the tracker's clock (default 10)")
      ->type_name("S")
      ->check(numberWithin(1.0, 1e5));
}

}  // namespace fieldtrue::cli
