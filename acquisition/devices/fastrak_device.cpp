#include "acquisition/devices/fastrak_device.h"

#include <algorithm>

#include "acquisition/devices/polhemus_settings.h"
#include "acquisition/protocols/isotrak.h"

namespace fieldtrue::acquisition {
namespace {

struct ReadBack {
  char letter;
  const char* fact;
};
/// What survives in the tracker's EEPROM and changes what it reports.
constexpr ReadBack kReadBacks[] = {
    {'I', "increment"}, {'V', "position_envelope"}, {'Q', "angular_envelope"}, {'H', "hemisphere"}};

bool isLine(const std::string& heard) { return heard.find('\n') != std::string::npos; }

std::optional<ProbeAnswer> fastrakAnswer(std::string_view heard) {
  const auto status = findStatus(heard);
  if (!status) return std::nullopt;
  ProbeAnswer answer{"Polhemus Fastrak", status->version, wantedStations({}, status->sensors), {}};
  if (!status->identity.empty()) answer.model += " (" + status->identity + ")";
  return answer;
}

/// Records of a Fastrak as readings.
class FastrakReadings : public StreamParser {
 public:
  explicit FastrakReadings(FastrakParser parser) : parser_(std::move(parser)) {}
  void add(std::string_view bytes, std::vector<Reading>& out) override {
    records_.clear();
    parser_.add(bytes, records_);
    for (const FastrakRecord& record : records_) out.push_back({toSample(record, 0.0), std::nullopt});
  }

 private:
  FastrakParser parser_;
  std::vector<FastrakRecord> records_;
};

}  // namespace

TrackerProbe fastrakProbe() {
  TrackerProbe probe;
  probe.rates = polhemusRates();
  probe.stop = encode(fastrak::continuous(false)) + "\r";
  probe.ask = encode(fastrak::status());
  probe.answer = fastrakAnswer;
  probe.stream = [](std::string_view heard) -> std::optional<ProbeAnswer> {
    return looksLikeFastrakStream(heard) ? std::optional<ProbeAnswer>(std::in_place) : std::nullopt;
  };
  probe.may_do = "A stream that runs is ended; a command half typed by another program is ended too.";
  return probe;
}

std::vector<Setting> fastrakSettings() { return polhemusSettings(kFastrakStations); }

Result<std::unique_ptr<TrackerDevice>> makeFastrak(const std::string& address, const simulation::Scene&) {
  const auto apply = [](const Settings& settings, FastrakSetup& setup) {
    return applyPolhemusSettings(settings, kFastrakStations, setup);
  };
  return deviceAtAddress<FastrakStartup>(address, fastrakSettings(), FastrakSetup{}, apply);
}

FastrakStartup::FastrakStartup(Transport& line, const FastrakSetup& setup)
    : TrackerStartup(line, setup), fastrak_(setup) {}

std::string FastrakStartup::farewell() const { return encode(fastrak::continuous(false)); }

void FastrakStartup::run() {
  Greeting greeting;
  greeting.stop = farewell();
  greeting.clear = "\r";
  greeting.ask = encode(fastrak::status());
  greeting.answered = [](const std::string& heard) { return findStatus(heard) || findIsotrakStatus(heard); };
  greeting.reset = encode(fastrak::reinitialise());
  greeting.rates = polhemusRates();
  greet(std::move(greeting), [this](const std::string& heard) {
    const auto status = findStatus(heard);
    status ? statusCame(*status) : failIsAnother("an Isotrak II", "isotrak");
  });
}

void FastrakStartup::statusCame(const FastrakStatus& status) {
  identity_.stations = wantedStations(fastrak_.stations, status.sensors);
  if (identity_.stations.empty()) return failNothingPluggedIn(fastrak_.stations);
  identity_.title = name();
  identity_.title.front() = identity_.title.front().toUpper();
  if (fastrak_.tells_version) identity_.title += ' ' + QString::fromStdString(status.version);
  emit progressed(QString("%1 answered; setting it up.").arg(identity_.title));
  std::vector<LineStep> steps;
  for (const FastrakCommand& command : commands()) {
    steps.push_back({encode(command), fastrak_.timings.command_ms, {}, [this](const std::string& heard) {
                       return noteRefusal(heard);
                     }});
  }
  for (const auto& [letter, fact] : kReadBacks) steps.push_back(readBack(letter, fact));
  perform(std::move(steps), [this] { verify(); });
}

std::vector<FastrakCommand> FastrakStartup::filterCommands() const {
  constexpr std::array kMacros = {"off", "low", "medium", "heavy"};
  if (fastrak_.filter == "off") return {fastrak::positionFilterOff(), fastrak::attitudeFilterOff()};
  const auto found = std::find(kMacros.begin(), kMacros.end(), fastrak_.filter);
  const int level = 2 + static_cast<int>(found - kMacros.begin());
  return {fastrak::positionFilterMacro(level), fastrak::attitudeFilterMacro(level)};
}

std::vector<FastrakCommand> FastrakStartup::commands() const {
  std::vector<FastrakCommand> list;
  const auto& on = identity_.stations;
  for (int station = 1; station <= kFastrakStations; ++station) {
    list.push_back(fastrak::stationActive(station, std::find(on.begin(), on.end(), station) != on.end()));
  }
  list.push_back(fastrak::units(FastrakUnit::kCentimetre));
  list.push_back(fastrak::compensation(false));
  for (auto& command : filterCommands()) list.push_back(std::move(command));
  for (const int station : on) {
    list.push_back(fastrak::increment(station, 0.0));
    if (fastrak_.raw_frame) {
      list.push_back(fastrak::resetAlignment(station));
      list.push_back(fastrak::unBoresight(station));
    }
    list.push_back(fastrak::hemisphere(station, hemisphereVector(fastrak_.hemisphere)));
    list.push_back(fastrak::outputList(station, kFastrakDriverItems));
  }
  list.push_back(fastrak::format(FastrakFormat::kBinary));
  return list;
}

bool FastrakStartup::noteRefusal(const std::string& heard) {
  const auto refusal = findRefusal(heard);
  if (refusal) identity_.refused.push_back(refusal->command + " (" + refusalMeaning(refusal->code) + ")");
  return true;
}

LineStep FastrakStartup::readBack(char letter, const char* fact) {
  const int station = identity_.stations.front();
  const auto heard = [this, letter, fact, station](const std::string& said) {
    const auto text = findReadBack(said, letter, station);
    if (text) identity_.facts[std::string(fact) + "_read_back"] = *text;
    // A tracker that does not know reading back is not asked again.
    if (said.empty()) verify();
    return !said.empty();
  };
  return {encode(fastrak::readBack(letter, station)), fastrak_.timings.reply_ms, isLine, heard};
}

void FastrakStartup::verify() {
  askFirmly(
      encode(fastrak::status()), [](const std::string& heard) { return findStatus(heard).has_value(); },
      [this](const std::string& heard) {
        const auto status = findStatus(heard);
        const char* wrong = status->unit != FastrakUnit::kCentimetre   ? "centimetres"
                            : status->format != FastrakFormat::kBinary ? "binary output"
                            : status->compensation                     ? "compensation off"
                                                                       : nullptr;
        wrong ? failNotTaken(wrong) : settled(*status);
      });
}

void FastrakStartup::settled(const FastrakStatus& status) {
  identity_.model = fastrak_.make + " " + status.version + (status.identity.empty() ? "" : ", " + status.identity);
  identity_.rate_hz = fastrak_.rate_hz / static_cast<double>(identity_.stations.size());
  auto& facts = identity_.facts;
  facts["units"] = status.unit == FastrakUnit::kCentimetre ? "centimetres" : "inches";
  facts["format"] = status.format == FastrakFormat::kBinary ? "binary" : "ascii";
  facts["filter"] = fastrak_.filter;
  facts["compensation"] = status.compensation ? "on" : "off";
  facts["hemisphere"] = fastrak_.hemisphere;
  facts["raw_frame"] = fastrak_.raw_frame ? "yes" : "no";
  if (!status.self_test_error.empty()) facts["self_test"] = status.self_test_error;
  finish();
}

StreamPlan FastrakStartup::stream() const {
  return madeStream(fastrakStream({{"stations", stationsText(identity_.stations)}}));
}

Result<StreamPlan> fastrakStream(const StreamSettings& settings) {
  FT_TRY(const auto stations, streamStations(settings, kFastrakStations));
  FastrakStreamSettings stream;
  for (const int station : stations) {
    stream.items[static_cast<std::size_t>(station - 1)] = {kFastrakDriverItems.begin(), kFastrakDriverItems.end()};
  }
  FT_TRY(auto parser, FastrakParser::make(stream));
  StreamPlan plan;
  plan.parser = std::make_unique<FastrakReadings>(std::move(parser));
  plan.settings = settings;
  plan.begin = encode(fastrak::continuous(true));
  plan.meaning = fastrakStatusMeaning;
  return plan;
}

}  // namespace fieldtrue::acquisition
