#include "acquisition/devices/openigtlink_device.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "acquisition/devices/line_address.h"
#include "calib/core/declare.h"

namespace fieldtrue::acquisition {
namespace {

constexpr const char* kUsualPort = "18944";

std::vector<std::string> splitNames(const std::string& text) {
  std::vector<std::string> names;
  if (text == "auto") return names;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t plus = std::min(text.find('+', start), text.size());
    names.push_back(text.substr(start, plus - start));
    start = plus + 1;
  }
  return names;
}

std::string joined(const std::vector<std::string>& parts, const char* between) {
  return std::accumulate(parts.begin(), parts.end(), std::string(), [&](std::string text, const std::string& part) {
    return std::move(text) + (text.empty() ? "" : between) + part;
  });
}

std::string request(const char* type, const std::string& body) { return encodeIgtl(type, "", 0, body); }

std::optional<ProbeAnswer> igtlAnswer(std::string_view heard) {
  IgtlSurvey survey;
  survey.add(heard, 0.0);
  if (survey.summary().empty()) return std::nullopt;
  ProbeAnswer answer;
  answer.model = "OpenIGTLink server";
  for (const IgtlSource& source : survey.choose({}).sources) answer.sensor_names.push_back(source.name);
  return answer;
}

/// `HOST:PORT,settings` as the other lines are written.
std::string lineAddressOf(const std::string& address) {
  constexpr std::string_view kTcp = "tcp:";
  std::string line = address.starts_with(kTcp) ? address.substr(kTcp.size()) : address;
  const std::size_t comma = std::min(line.find(','), line.size());
  const std::string settings = line.substr(comma);
  line.resize(comma);
  if (line.find(':') == std::string::npos) line += std::string(":") + kUsualPort;
  return std::string(kTcp) + line + settings;
}

StreamPlan streamOfSources(std::shared_ptr<std::vector<IgtlSource>> sources, bool stamped, bool takes_newcomers,
                           StreamSettings settings) {
  StreamPlan plan;
  plan.parser = std::make_unique<IgtlReadings>(std::move(sources), stamped, takes_newcomers);
  plan.settings = std::move(settings);
  plan.part = "Sensor";
  plan.meaning = igtlStatusMeaning;
  return plan;
}

}  // namespace

IgtlSetup::IgtlSetup() {
  id = "openigtlink";
  make = "OpenIGTLink server";
  name = "OpenIGTLink server";
  excitation.clear();
  transmitter_model = "unknown";
  timings.settle_ms = 20;
  timings.drain_most_ms = 0;
  timings.silence_ms = 3000;
}

TrackerProbe openigtlinkProbe() {
  TrackerProbe probe;
  probe.ask = request("GET_STATUS", {});
  probe.answer = probe.stream = igtlAnswer;
  probe.may_do = "Nothing: it is listened to, and at the usual port asked for its state.";
  return probe;
}

std::vector<Setting> openigtlinkSettings() {
  return {
      declare::choice("devices", "Devices", {}, "auto",
                      "Names in the order of the sensors, e.g. Probe+Stylus; auto takes all that send poses, by name."),
      declare::flag("ask", "Ask for poses", true, "Ask the server for tracking data where it sends none by itself."),
      declare::choice("transmitter", "Transmitter", {"unknown", "dipole", "planar_coils", "optical"}, "unknown",
                      "What kind of tracker stands behind the server; the search for causes needs to know."),
  };
}

Result<std::unique_ptr<TrackerDevice>> makeOpenigtlink(const std::string& address, const simulation::Scene&) {
  const auto apply = [](const Settings& settings, IgtlSetup& setup) -> Result<void> {
    setup.devices = splitNames(choiceSetting(settings, "devices"));
    if (std::find(setup.devices.begin(), setup.devices.end(), "") != setup.devices.end()) {
      return fail(ErrorCode::kBadInput, "openigtlink: devices must be auto or names joined by +, as in Probe+Stylus");
    }
    setup.asks = boolSetting(settings, "ask");
    setup.transmitter_model = choiceSetting(settings, "transmitter");
    return {};
  };
  return deviceAtAddress<IgtlStartup>(lineAddressOf(address), openigtlinkSettings(), IgtlSetup{}, apply);
}

IgtlStartup::IgtlStartup(Transport& line, const IgtlSetup& setup) : TrackerStartup(line, setup), igtl_(setup) {
  clock_.start();
  connect(&exchange_, &LineExchange::bytesSeen, this, [this](bool sent, const QByteArray& bytes) {
    if (sent) return;
    survey_.add({bytes.constData(), static_cast<std::size_t>(bytes.size())},
                1e-9 * static_cast<double>(clock_.nsecsElapsed()));
  });
}

std::string IgtlStartup::farewell() const { return igtl_.asks ? request("STP_TDATA", {}) : std::string(); }

void IgtlStartup::run() {
  emit progressed(QString("Connected to %1; listening.").arg(where()));
  listen({}, [this] {
    if (!igtl_.asks) return failSilent();
    emit progressed(QString("%1 sends no poses by itself; asking for them.").arg(where()));
    listen(request("STT_TDATA", encodeStartTrackingBody()),
           [this] { listen(request("STT_QTDATA", encodeStartTrackingBody()), [this] { failSilent(); }); });
  });
}

void IgtlStartup::listen(const std::string& ask, std::function<void()> when_silent) {
  exchange_.ask(
      ask, [this](const std::string&) { return survey_.hasPoses(); }, igtl_.listen_ms,
      [this, when_silent](const std::string&) { survey_.hasPoses() ? survey() : when_silent(); });
}

void IgtlStartup::survey() {
  emit progressed(QString("%1 sends poses; learning which.").arg(where()));
  exchange_.tell({}, igtl_.survey_ms, [this](const std::string&) { choose(); });
}

void IgtlStartup::failSilent() {
  const QString heard = QString::fromStdString(survey_.summary());
  emit failed(
      QString("The OpenIGTLink server at %1 sends no poses%2: start tracking there, or check that a tool is seen")
          .arg(where(), heard.isEmpty() ? QString(", and nothing else") : ", only " + heard));
}

void IgtlStartup::choose() {
  const IgtlSurvey::Choice choice = survey_.choose(igtl_.devices);
  const auto is_heard = [](const IgtlSource& source) { return !source.message_device.empty(); };
  if (std::none_of(choice.sources.begin(), choice.sources.end(), is_heard)) {
    const std::string why = igtl_.devices.empty() ? joined(choice.refused, "; ") : "it sends " + survey_.summary();
    emit failed(QString("The OpenIGTLink server at %1 sends no pose of %2: %3")
                    .arg(where(),
                         igtl_.devices.empty() ? QString("a rigid motion")
                                               : QString::fromStdString(joined(igtl_.devices, " or ")),
                         QString::fromStdString(why)));
    return;
  }
  for (const IgtlSource& source : choice.sources) {
    const auto known = std::find_if(igtl_.sources->begin(), igtl_.sources->end(),
                                    [&](const IgtlSource& s) { return s.name == source.name; });
    if (known == igtl_.sources->end()) {
      igtl_.sources->push_back(source);
    } else if (is_heard(source)) {
      *known = source;
    }
  }
  stamped_ = choice.stamped;
  identity_.refused = choice.refused;
  identity_.title = name();
  if (!choice.refused.empty()) {
    identity_.title += QString::fromStdString(" (left out " + joined(choice.refused, "; ") + ")");
  }
  identity_.model = "OpenIGTLink server at " + where().toStdString();
  identity_.rate_hz = std::max(0.1, std::round(choice.rate_hz * 10.0) / 10.0);
  identity_.facts["units"] = "millimetres";
  identity_.facts["clock"] = stamped_ ? "server" : "arrival";
  for (std::size_t i = 0; i < igtl_.sources->size(); ++i) {
    const IgtlSource& source = (*igtl_.sources)[i];
    identity_.stations.push_back(static_cast<int>(i) + 1);
    identity_.facts["sensor_" + std::to_string(i + 1)] = source.name + " (" + nameOf(source.type) + ")";
  }
  finish();
}

StreamPlan IgtlStartup::stream() const {
  StreamSettings settings = {{"stamped", stamped_ ? "yes" : "no"},
                             {"takes_newcomers", igtl_.devices.empty() ? "yes" : "no"}};
  for (std::size_t i = 0; i < igtl_.sources->size(); ++i) {
    const IgtlSource& source = (*igtl_.sources)[i];
    const std::string key = "sensor_" + std::to_string(i + 1);
    settings[key] = source.name;
    settings[key + "_type"] = nameOf(source.type);
    settings[key + "_device"] = source.message_device;
  }
  return streamOfSources(igtl_.sources, stamped_, igtl_.devices.empty(), std::move(settings));
}

Result<StreamPlan> openigtlinkStream(const StreamSettings& settings) {
  FT_TRY(const bool stamped, streamFlag(settings, "stamped"));
  FT_TRY(const bool takes_newcomers, streamFlag(settings, "takes_newcomers"));
  auto sources = std::make_shared<std::vector<IgtlSource>>();
  for (std::size_t number = 1;; ++number) {
    const std::string key = "sensor_" + std::to_string(number);
    if (!settings.contains(key)) break;
    IgtlSource source;
    source.name = settings.at(key);
    FT_TRY(const std::string type, streamText(settings, key + "_type"));
    const auto known = igtlPoseType(type);
    if (!known)
      return fail(ErrorCode::kBadInput, "its setting " + key + "_type is '" + type + "', which holds no poses");
    source.type = *known;
    FT_TRY(source.message_device, streamText(settings, key + "_device"));
    sources->push_back(std::move(source));
  }
  return streamOfSources(std::move(sources), stamped, takes_newcomers, settings);
}

}  // namespace fieldtrue::acquisition
