#include "acquisition/devices/liberty_device.h"

#include <algorithm>

#include "acquisition/devices/polhemus_settings.h"
#include "acquisition/protocols/little_endian.h"

namespace fieldtrue::acquisition {
namespace {

constexpr char kHemisphereLetter = 'H';

Result<std::unique_ptr<TrackerDevice>> makeOfRow(const std::string& address, const LibertyMake& row) {
  const auto apply = [&row](const Settings& settings, LibertySetup& setup) {
    return applyPolhemusSettings(settings, row.most_stations, setup);
  };
  return deviceAtAddress<LibertyStartup>(address, polhemusSettings(row.most_stations), LibertySetup(row), apply);
}

const LibertyMake* makeWithTag(const std::string& tag) {
  for (const LibertyMake& make : libertyMakes()) {
    if (make.tag == tag) return &make;
  }
  return nullptr;
}

/// Bits of the stations plugged in as their numbers, and who it is. Both must have come.
std::optional<ProbeAnswer> libertyAnswer(std::string_view heard, const char* id) {
  const LibertyMake& make = libertyMake(id);
  const auto who = findLibertyFrame(heard, kLibertyWho);
  const auto stations = findLibertyFrame(heard, kLibertyStations);
  const auto plugged = stations ? libertyPlugged(*stations) : std::nullopt;
  if (!who || who->tag != make.tag || !plugged) return std::nullopt;
  return ProbeAnswer{make.make, libertyIdentity(*who), wantedStations({}, *plugged), {}};
}

std::optional<ProbeAnswer> libertyStream(std::string_view heard, const char* id) {
  const auto record = findLibertyFrame(heard, 'C');
  const bool is_this = record && record->tag == libertyMake(id).tag;
  return is_this ? std::optional<ProbeAnswer>(std::in_place) : std::nullopt;
}

/// How one of them is found; which it is, its tag tells.
TrackerProbe probeOfMake() {
  TrackerProbe probe;
  probe.rates = polhemusRates();
  probe.stop = "\r" + liberty::point();
  probe.ask = liberty::binary(true) + liberty::who() + liberty::stations();
  probe.reply_ms = 600;
  probe.may_do = "A stream that runs is ended, and its output is binary until it is told otherwise.";
  return probe;
}

Result<StreamPlan> streamOfMake(const StreamSettings& settings, const LibertyMake& row) {
  LibertyParser::Settings stream;
  stream.tag = row.tag;
  FT_TRY(stream.stations, streamStations(settings, row.most_stations));
  stream.items = {kLibertyDriverItems.begin(), kLibertyDriverItems.end()};
  FT_TRY(auto parser, LibertyParser::make(std::move(stream)));
  StreamPlan plan;
  plan.parser = std::make_unique<LibertyParser>(std::move(parser));
  plan.settings = settings;
  plan.begin = liberty::continuous();
  plan.meaning = libertyStatusMeaning;
  return plan;
}

}  // namespace

Result<StreamPlan> libertyStream(const StreamSettings& settings) {
  return streamOfMake(settings, libertyMake("liberty"));
}
Result<StreamPlan> patriotStream(const StreamSettings& settings) {
  return streamOfMake(settings, libertyMake("patriot"));
}

TrackerProbe libertyProbe() {
  TrackerProbe probe = probeOfMake();
  probe.answer = [](std::string_view heard) { return libertyAnswer(heard, "liberty"); };
  probe.stream = [](std::string_view heard) { return libertyStream(heard, "liberty"); };
  return probe;
}

TrackerProbe patriotProbe() {
  TrackerProbe probe = probeOfMake();
  probe.answer = [](std::string_view heard) { return libertyAnswer(heard, "patriot"); };
  probe.stream = [](std::string_view heard) { return libertyStream(heard, "patriot"); };
  return probe;
}

std::vector<Setting> libertySettings() { return polhemusSettings(libertyMake("liberty").most_stations); }
std::vector<Setting> patriotSettings() { return polhemusSettings(libertyMake("patriot").most_stations); }

Result<std::unique_ptr<TrackerDevice>> makeLiberty(const std::string& address, const simulation::Scene&) {
  return makeOfRow(address, libertyMake("liberty"));
}
Result<std::unique_ptr<TrackerDevice>> makePatriot(const std::string& address, const simulation::Scene&) {
  return makeOfRow(address, libertyMake("patriot"));
}

LibertyStartup::LibertyStartup(Transport& line, const LibertySetup& setup)
    : TrackerStartup(line, setup), liberty_(setup) {}

std::string LibertyStartup::farewell() const { return liberty::point(); }

void LibertyStartup::run() {
  Greeting greeting;
  greeting.stop = farewell();
  greeting.clear = "\r";
  greeting.ask = liberty::binary(true) + liberty::who();
  greeting.answered = [](const std::string& heard) { return findLibertyFrame(heard, kLibertyWho).has_value(); };
  greeting.reset = liberty::reinitialise();
  greeting.rates = polhemusRates();
  greet(std::move(greeting), [this](const std::string& heard) { whoCame(*findLibertyFrame(heard, kLibertyWho)); });
}

void LibertyStartup::whoCame(const LibertyFrame& who) {
  const LibertyMake& asked = *liberty_.make_row;
  if (who.tag != asked.tag) {
    const LibertyMake* found = makeWithTag(who.tag);
    return failIsAnother(QString("a ") + found->name, found->id);
  }
  const std::string identity = libertyIdentity(who);
  identity_.title = name();
  identity_.model = liberty_.make + (identity.empty() ? "" : ", " + identity);
  emit progressed(QString("%1 answered; setting it up.").arg(identity_.title));
  const auto complete = [](const std::string& heard) {
    const auto frame = findLibertyFrame(heard, kLibertyStations);
    return frame && libertyPlugged(*frame);
  };
  askFirmly(liberty::stations(), complete, [this](const std::string& heard) {
    stationsCame(*libertyPlugged(*findLibertyFrame(heard, kLibertyStations)));
  });
}

void LibertyStartup::stationsCame(unsigned plugged) {
  identity_.stations = wantedStations(liberty_.stations, plugged);
  if (identity_.stations.empty()) return failNothingPluggedIn(liberty_.stations);
  std::vector<LineStep> steps;
  for (const std::string& command : commands(plugged)) {
    steps.push_back({command, liberty_.timings.command_ms, {}, [this](const std::string& heard) {
                       if (const auto refusal = findLibertyRefusal(heard)) {
                         identity_.refused.push_back(std::string(1, refusal->command) + " (" +
                                                     libertyIdentity(*refusal) + ")");
                       }
                       return true;
                     }});
  }
  const auto note = [this](const std::string& heard) {
    const auto frame = findLibertyFrame(heard, kHemisphereLetter);
    if (frame && frame->payload.size() == 12) {
      const auto& text = frame->payload;
      QStringList numbers;
      for (const std::size_t at : {0u, 4u, 8u}) numbers << QString::number(littleEndianFloat(text.data() + at), 'f', 2);
      identity_.facts["hemisphere_read_back"] = numbers.join(' ').toStdString();
    }
    return true;
  };
  steps.push_back({"H" + std::to_string(identity_.stations.front()) + "\r", liberty_.timings.reply_ms,
                   [](const std::string& heard) { return findLibertyFrame(heard, kHemisphereLetter).has_value(); },
                   note});
  perform(std::move(steps), [this] { verify(); });
}

std::vector<std::string> LibertyStartup::commands(unsigned plugged) const {
  std::vector<std::string> list;
  const auto& on = identity_.stations;
  for (const int station : wantedStations({}, plugged)) {
    list.push_back(liberty::stationActive(station, std::find(on.begin(), on.end(), station) != on.end()));
  }
  list.push_back(liberty::centimetres(true));
  for (const char letter : {'X', 'Y'}) list.push_back(liberty::filter(letter, polhemusFilter(liberty_.filter)));
  if (liberty_.raw_frame) {
    list.push_back(liberty::resetAlignment());
    list.push_back(liberty::unBoresight());
  }
  for (const int station : on) {
    list.push_back(liberty::hemisphere(station, hemisphereVector(liberty_.hemisphere)));
  }
  list.push_back(liberty::outputList(kLibertyDriverItems));
  list.push_back(liberty::resetTime());
  return list;
}

void LibertyStartup::verify() {
  const auto complete = [](const std::string& heard) { return findLibertyFrame(heard, 'P').has_value(); };
  askFirmly(liberty::point(), complete, [this](const std::string& heard) {
    const auto record = decodeLibertyRecord(*findLibertyFrame(heard, 'P'), kLibertyDriverItems, 0.01);
    record ? settled() : failNotTaken("output list");
  });
}

void LibertyStartup::settled() {
  identity_.rate_hz = liberty_.make_row->rate_hz;
  auto& facts = identity_.facts;
  facts["units"] = "centimetres";
  facts["format"] = "binary";
  facts["clock"] = "tracker";
  facts["filter"] = liberty_.filter;
  facts["hemisphere"] = liberty_.hemisphere;
  facts["raw_frame"] = liberty_.raw_frame ? "yes" : "no";
  finish();
}

StreamPlan LibertyStartup::stream() const {
  return madeStream(streamOfMake({{"stations", stationsText(identity_.stations)}}, *liberty_.make_row));
}

}  // namespace fieldtrue::acquisition
