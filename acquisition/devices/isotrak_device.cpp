#include "acquisition/devices/isotrak_device.h"

#include <algorithm>
#include <set>

#include "acquisition/devices/polhemus_settings.h"
#include "calib/core/declare.h"

namespace fieldtrue::acquisition {
namespace {

constexpr double kTextStep_m = 1e-4;  ///< Two decimals of centimetres.

std::string askIsotrakStations() { return encode(fastrak::readBack('l', 1)); }

/// Its status and its stations: the first alone could come from a question that was another tracker's.
std::optional<ProbeAnswer> isotrakAnswer(std::string_view heard) {
  const auto status = findIsotrakStatus(heard);
  const auto stations = findIsotrakStations(heard);
  if (!status || !stations) return std::nullopt;
  return ProbeAnswer{"Polhemus Isotrak II", status->version, wantedStations({}, *stations), {}};
}

std::vector<Setting> withRecord(std::vector<Setting> settings) {
  Setting record = declare::choice(
      "record", "Record", {}, isotrakRecordKinds().front().id,
      "What it sends: position and quaternion, position and angles, or the first in ASCII with a coarser step.");
  for (const IsotrakRecordKind& kind : isotrakRecordKinds()) record.choices.emplace_back(kind.id);
  settings.push_back(std::move(record));
  return settings;
}

const IsotrakRecordKind* findIsotrakRecord(const std::string& id) {
  const auto& kinds = isotrakRecordKinds();
  const auto found = std::find_if(kinds.begin(), kinds.end(), [&id](const auto& kind) { return kind.id == id; });
  return found == kinds.end() ? nullptr : &*found;
}

Result<IsotrakParser> isotrakParser(const IsotrakRecordKind& record, const std::vector<int>& stations, bool single) {
  IsotrakParser::Settings settings;
  settings.format = record.format;
  settings.stations = stations;
  settings.items = record.items;
  settings.single = single;
  return IsotrakParser::make(std::move(settings));
}

}  // namespace

const std::vector<IsotrakRecordKind>& isotrakRecordKinds() {
  static const std::vector<IsotrakRecordKind> kKinds = {
      {"quaternion", FastrakFormat::kBinary, {2, 11}, kIsotrakStep_m},
      {"angles", FastrakFormat::kBinary, {2, 4}, kIsotrakStep_m},
      {"text", FastrakFormat::kAscii, {2, 11, 1}, kTextStep_m},
  };
  return kKinds;
}

TrackerProbe isotrakProbe() {
  TrackerProbe probe;
  probe.rates = polhemusRates();
  probe.stop = encode(fastrak::continuous(false)) + "\r";
  probe.ask = encode(fastrak::status()) + askIsotrakStations();
  probe.answer = isotrakAnswer;
  probe.stream = [](std::string_view heard) -> std::optional<ProbeAnswer> {
    return looksLikeIsotrakStream(heard) ? std::optional<ProbeAnswer>(std::in_place) : std::nullopt;
  };
  probe.may_do = "A stream that runs is ended; a command half typed by another program is ended too.";
  return probe;
}

std::vector<Setting> isotrakSettings() { return withRecord(polhemusSettings(kIsotrakStations)); }

Result<std::unique_ptr<TrackerDevice>> makeIsotrak(const std::string& address, const simulation::Scene&) {
  const auto apply = [](const Settings& settings, IsotrakSetup& setup) -> Result<void> {
    setup.record = findIsotrakRecord(choiceSetting(settings, "record"));
    return applyPolhemusSettings(settings, kIsotrakStations, setup);
  };
  return deviceAtAddress<IsotrakStartup>(address, isotrakSettings(), IsotrakSetup{}, apply);
}

IsotrakStartup::IsotrakStartup(Transport& line, const IsotrakSetup& setup)
    : TrackerStartup(line, setup), isotrak_(setup) {}

std::string IsotrakStartup::farewell() const { return encode(fastrak::continuous(false)); }

void IsotrakStartup::run() {
  Greeting greeting;
  greeting.stop = farewell();
  greeting.clear = "\r";
  greeting.ask = encode(fastrak::status());
  greeting.answered = [](const std::string& heard) { return findIsotrakStatus(heard) || findStatus(heard); };
  greeting.reset = encode(fastrak::reinitialise());
  greeting.rates = polhemusRates();
  greet(std::move(greeting), [this](const std::string& heard) { answered(heard); });
}

void IsotrakStartup::answered(const std::string& heard) {
  const auto status = findIsotrakStatus(heard);
  if (!status) return failIsAnother("a Fastrak", "fastrak");
  status_ = *status;
  identity_.title = status_.version.empty() ? name() : name() + ' ' + QString::fromStdString(status_.version);
  emit progressed(QString("%1 answered; setting it up.").arg(identity_.title));
  std::vector<LineStep> steps;
  for (const int station : isotrak_.stations) steps.push_back(step(fastrak::stationActive(station, true)));
  // Twice: the first reply may be damaged on the line.
  for (int i = 0; i < 2; ++i) steps.push_back(askStations());
  perform(std::move(steps), [this] { stationsKnown(); });
}

LineStep IsotrakStartup::step(const FastrakCommand& command) {
  return {encode(command), isotrak_.timings.command_ms, {}, [this](const std::string& heard) {
            const auto refusal = findRefusal(heard);
            if (refusal) identity_.refused.push_back(refusal->command + " (" + refusalMeaning(refusal->code) + ")");
            return true;
          }};
}

LineStep IsotrakStartup::askStations() {
  const auto complete = [](const std::string& heard) { return findIsotrakStations(heard).has_value(); };
  return {askIsotrakStations(), isotrak_.timings.reply_ms, complete, [this](const std::string& heard) {
            if (const auto told = findIsotrakStations(heard)) switched_on_ = told;
            return true;
          }};
}

void IsotrakStartup::stationsKnown() {
  // One that does not tell: those asked for, or the first.
  const unsigned all = (1u << kIsotrakStations) - 1u;
  identity_.stations = wantedStations(isotrak_.stations, switched_on_.value_or(isotrak_.stations.empty() ? 1u : all));
  if (identity_.stations.empty()) return failNothingPluggedIn(isotrak_.stations);
  std::vector<LineStep> steps;
  for (const FastrakCommand& command : commands()) steps.push_back(step(command));
  steps.push_back(readBack('I', "increment"));
  steps.push_back(readBack('H', "hemisphere"));
  perform(std::move(steps), [this] { verify(); });
}

std::vector<FastrakCommand> IsotrakStartup::commands() const {
  const auto filter = polhemusFilter(isotrak_.filter);
  const fastrak::Filter numbers{filter[0], filter[1], filter[2], filter[3]};
  const auto& on = identity_.stations;
  std::vector<FastrakCommand> list;
  for (int station = 1; station <= kIsotrakStations; ++station) {
    list.push_back(fastrak::stationActive(station, std::find(on.begin(), on.end(), station) != on.end()));
  }
  list.push_back(fastrak::units(FastrakUnit::kCentimetre));
  list.push_back(fastrak::positionFilter(numbers));
  list.push_back(fastrak::attitudeFilter(numbers));
  for (const int station : on) {
    list.push_back(fastrak::increment(station, 0.0));
    if (isotrak_.raw_frame) {
      list.push_back(fastrak::resetAlignment(station));
      list.push_back(fastrak::unBoresight(station));
    }
    list.push_back(fastrak::hemisphere(station, hemisphereVector(isotrak_.hemisphere)));
  }
  list.push_back(isotrak::outputList(isotrak_.record->items));
  list.push_back(fastrak::format(isotrak_.record->format));
  return list;
}

LineStep IsotrakStartup::readBack(char letter, const char* fact) {
  const int station = identity_.stations.front();
  const auto complete = [letter, station](const std::string& heard) {
    return findReadBack(heard, letter, station).has_value();
  };
  return {encode(fastrak::readBack(letter, station)), isotrak_.timings.reply_ms, complete,
          [this, letter, station, fact](const std::string& heard) {
            const auto text = findReadBack(heard, letter, station);
            if (text) identity_.facts[std::string(fact) + "_read_back"] = *text;
            return true;
          }};
}

void IsotrakStartup::verify() {
  const auto complete = [this](const std::string& heard) {
    std::vector<Reading> readings;
    auto parser = isotrakParser(*isotrak_.record, identity_.stations, true);
    FT_CHECK(parser.has_value());
    parser->add(heard, readings);
    std::set<int> sent;
    for (const Reading& reading : readings) sent.insert(reading.sample.sensor);
    return sent.size() == identity_.stations.size();
  };
  askFirmly(encode(fastrak::point()), complete, [this](const std::string&) { settled(); });
}

void IsotrakStartup::settled() {
  identity_.model = isotrak_.make + (status_.version.empty() ? "" : " " + status_.version);
  identity_.rate_hz = kIsotrakRate_hz / static_cast<double>(identity_.stations.size());
  identity_.quantum_m = isotrak_.record->step_m;
  auto& facts = identity_.facts;
  facts["units"] = "centimetres";
  facts["format"] = isotrak_.record->format == FastrakFormat::kBinary ? "binary" : "ascii";
  facts["record"] = isotrak_.record->id;
  facts["filter"] = isotrak_.filter;
  facts["hemisphere"] = isotrak_.hemisphere;
  facts["raw_frame"] = isotrak_.raw_frame ? "yes" : "no";
  facts["status"] = status_.text;
  finish();
}

StreamPlan IsotrakStartup::stream() const {
  return madeStream(isotrakStream({{"stations", stationsText(identity_.stations)}, {"record", isotrak_.record->id}}));
}

Result<StreamPlan> isotrakStream(const StreamSettings& settings) {
  FT_TRY(const auto stations, streamStations(settings, kIsotrakStations));
  FT_TRY(const std::string record, streamText(settings, "record"));
  const IsotrakRecordKind* kind = findIsotrakRecord(record);
  if (!kind) return fail(ErrorCode::kBadInput, "its setting record is '" + record + "', which no Isotrak II has");
  FT_TRY(auto parser, isotrakParser(*kind, stations, false));
  StreamPlan plan;
  plan.parser = std::make_unique<IsotrakParser>(std::move(parser));
  plan.settings = settings;
  plan.begin = encode(fastrak::continuous(true));
  plan.meaning = isotrakStatusMeaning;
  return plan;
}

}  // namespace fieldtrue::acquisition
