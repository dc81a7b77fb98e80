#include "acquisition/devices/ndi_device.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>

#include "acquisition/protocols/plain_number.h"
#include "calib/core/declare.h"
#include "calib/core/file_io.h"
#include "calib/core/trimmed.h"

namespace fieldtrue::acquisition {
namespace {

constexpr int kMostTools = 24;
constexpr int kUnknownCommand = 0x01;
constexpr int kWrongMode = 0x0C;
/// Between two questions about the same frame.
constexpr int kAskGap_ms = 4;

constexpr NdiSystem kSystems[] = {
    {"aurora", "aurora", kNdiAuroraRate_hz, "planar_coils", "ac"},
    {"polaris", "polaris", kNdiPolarisRate_hz, "optical", ""},
    {"vega", "vega", kNdiPolarisRate_hz, "optical", ""},
    {"other", "", kNdiPolarisRate_hz, "unknown", ""},
};

bool hasReply(const std::string& heard) { return findNdiReply(heard).has_value(); }

bool isOkay(const std::string& heard) {
  const auto reply = findNdiReply(heard);
  return reply && reply->isOkay();
}

bool isRestarted(const std::string& heard) {
  const auto reply = findNdiReply(heard);
  return reply && reply->text == "RESET";
}

std::string lowered(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// The rest of the line that begins so; empty where there is none.
std::string lineAfter(const std::string& text, std::string_view head) {
  const std::size_t at = text.find(head);
  if (at == std::string::npos) return {};
  const std::size_t begin = at + head.size();
  return std::string(trimmed(text.substr(begin, text.find('\n', begin) - begin)));
}

constexpr const char* kNdiQuestion = "VER";

/// Any reply with a right CRC is one of NDI's: a refusal too. The question has one as well, and a line may echo it.
std::optional<ProbeAnswer> ndiAnswer(std::string_view heard) {
  const auto reply = findNdiReply(heard);
  if (!reply || reply->text.starts_with(kNdiQuestion)) return std::nullopt;
  ProbeAnswer answer;
  const std::string first = reply->text.substr(0, reply->text.find('\n'));
  answer.model = reply->error ? "NDI tracker" : "NDI " + std::string(trimmed(first));
  answer.firmware = lineAfter(reply->text, "Freeze Tag:");
  return answer;
}

Result<std::vector<NdiSetup::Rom>> readRoms(const std::string& paths) {
  std::vector<NdiSetup::Rom> roms;
  for (std::size_t start = 0; start < paths.size();) {
    const std::size_t end = std::min(paths.find('+', start), paths.size());
    NdiSetup::Rom rom{paths.substr(start, end - start), {}};
    std::ifstream in(rom.path, std::ios::binary);
    if (!in) return fail(ErrorCode::kIo, "Cannot read the tool definition " + rom.path);
    rom.content.assign(std::istreambuf_iterator<char>(in), {});
    if (rom.content.empty() || rom.content.size() > kNdiMostRomBytes) {
      return fail(ErrorCode::kBadInput, rom.path + " has " + std::to_string(rom.content.size()) +
                                            " bytes; a tool definition (.rom) has 1 to " +
                                            std::to_string(kNdiMostRomBytes));
    }
    roms.push_back(std::move(rom));
    start = end + 1;
  }
  return roms;
}

}  // namespace

const NdiSystem& ndiSystem(const std::string& setting, const std::string& told) {
  const std::string said = lowered(told);
  return *std::find_if(std::begin(kSystems), std::end(kSystems) - 1, [&](const NdiSystem& system) {
    return setting == system.id || (setting == "auto" && said.find(system.word) != std::string::npos);
  });
}

TrackerProbe ndiProbe() {
  TrackerProbe probe;
  probe.rates = {kNdiPowerUpBaud, 115200, 921600, 57600, 38400, 19200, 230400, 1228739};
  probe.stop = "\r";
  probe.ask = ndiCommand(kNdiQuestion, "0");
  probe.answer = ndiAnswer;
  probe.may_do = "A command half typed by another program is ended.";
  return probe;
}

std::vector<Setting> ndiSettings() {
  std::vector<std::string> systems = {"auto"};
  for (const NdiSystem& system : kSystems) systems.emplace_back(system.id);
  return {
      stationsSetting(kMostTools),
      declare::choice("rom", "Tool definitions", {}, "none",
                      "Definition files of tools without a cable, joined by +; each becomes a tool behind the wired "
                      "ones."),
      declare::choice("system", "System", systems, "auto", "What it is; auto asks it."),
      declare::number("frame_hz", "Frame rate", {0.0, 1000.0, "Hz"}, 0.0,
                      "Rate of its frame counter, which is its clock; 0 = 40 for an Aurora, 60 for the others."),
      declare::choice("reply", "Reply", {"auto", "bx", "tx"}, "auto",
                      "How poses come: in binary, in text, or in text where the firmware refuses binary."),
      declare::number("max_error_mm", "Largest error value", {0.0, 100.0, "mm"}, NdiSetup{}.gate.most_error_mm,
                      "Readings whose error value (an Aurora's indicator) is above do not count; 0 = all count."),
      declare::choice("volume", "Volume", {"inside", "any"}, "inside",
                      "Whether readings out of the measuring volume, or partly, count."),
      declare::flag("may_reset", "May reset", true, "Begin with a break, which resets it; restart it when silent."),
  };
}

Result<std::unique_ptr<TrackerDevice>> makeNdi(const std::string& address, const simulation::Scene&) {
  const auto apply = [](const Settings& settings, NdiSetup& setup) -> Result<void> {
    FT_TRY(setup.stations, readStations(settings, setup.id, kMostTools));
    const std::string& roms = choiceSetting(settings, "rom");
    if (roms != "none") {
      FT_TRY(setup.roms, readRoms(roms));
    }
    setup.system = choiceSetting(settings, "system");
    setup.frame_hz = numberSetting(settings, "frame_hz");
    setup.reply = choiceSetting(settings, "reply");
    setup.gate.most_error_mm = numberSetting(settings, "max_error_mm");
    setup.gate.inside_volume = choiceSetting(settings, "volume") == "inside";
    setup.may_reset = boolSetting(settings, "may_reset");
    if (ndiRateDigit(setup.baud)) return {};
    std::string known;
    for (const int rate : ndiRates()) known += (known.empty() ? "" : ", ") + std::to_string(rate);
    return fail(ErrorCode::kBadInput,
                "ndi: " + std::to_string(setup.baud) + " baud is no rate it has; known are " + known);
  };
  return deviceAtAddress<NdiStartup>(address, ndiSettings(), NdiSetup{}, apply);
}

namespace {

/// On the line it answers at the rate it has after power-up, whatever speed is wanted.
LineSetup atPowerUpRate(LineSetup setup) {
  setup.baud = kNdiPowerUpBaud;
  return setup;
}

}  // namespace

NdiStartup::NdiStartup(Transport& line, const NdiSetup& setup)
    : TrackerStartup(line, atPowerUpRate(setup)), ndi_(setup) {}

std::string NdiStartup::farewell() const { return ndiCommand("TSTOP"); }

void NdiStartup::run() {
  has_rate_ = line_.setBaud(kNdiPowerUpBaud);
  if (!has_rate_ || !ndi_.may_reset) return callOut();
  emit progressed("Resetting the system by a break.");
  sendBreak([this] { callOut(); });
}

void NdiStartup::sendBreak(Then then) {
  line_.setBreak(true);
  exchange_.tell({}, ndi_.break_ms, [this, then = std::move(then)](const std::string&) {
    line_.setBreak(false);
    exchange_.ask({}, isRestarted, ndi_.after_break_ms, [then](const std::string&) { then(); });
  });
}

void NdiStartup::callOut() {
  Greeting greeting;
  greeting.stop = farewell();
  greeting.clear = "\r";
  greeting.ask = ndiCommand("INIT");
  greeting.answered = isOkay;
  greeting.reset = ndiCommand("RESET", "0");
  greeting.rates = ndiRates();
  greeting.rate_switches = "nothing else speaks with it; it answers at";
  greeting.unreadable = "switch it off and on again, and check that the device on this line is one of NDI's";
  greet(std::move(greeting), [this](const std::string&) { chooseSpeed(); });
}

void NdiStartup::say(std::string_view command, const std::string& arguments, Replied then) {
  askFirmly(ndiCommand(command, arguments), hasReply,
            [then = std::move(then)](const std::string& heard) { then(*findNdiReply(heard)); });
}

void NdiStartup::chooseSpeed() {
  if (!has_rate_) identity_.baud = ndi_.baud;
  if (identity_.baud == ndi_.baud) return identify();
  const std::string settings = std::string(1, *ndiRateDigit(ndi_.baud)) + "0000";
  say("COMM", settings, [this](const NdiReply& reply) {
    if (!reply.isOkay()) return identify();
    // It answers at the old speed and then changes.
    exchange_.tell({}, ndi_.speed_ms, [this](const std::string&) { checkSpeed(); });
  });
}

void NdiStartup::checkSpeed() {
  line_.setBaud(ndi_.baud);
  exchange_.ask(ndiCommand("INIT"), isOkay, ndi_.timings.reply_ms, [this](const std::string& heard) {
    if (isOkay(heard)) {
      identity_.baud = ndi_.baud;
      return identify();
    }
    emit progressed(QString("Nothing was understood at %1 baud; going on at %2.").arg(ndi_.baud).arg(kNdiPowerUpBaud));
    identity_.baud = kNdiPowerUpBaud;
    line_.setBaud(kNdiPowerUpBaud);
    sendBreak([this] { askFirmly(ndiCommand("INIT"), isOkay, [this](const std::string&) { identify(); }); });
  });
}

void NdiStartup::failWithReply(const QString& what, const NdiReply& reply) {
  const QString why = reply.error ? QString("%1 (ERROR%2)")
                                        .arg(QString::fromStdString(ndiErrorMeaning(*reply.error)),
                                             QString::fromStdString(ndiHex(static_cast<unsigned>(*reply.error), 2)))
                                  : "it answered \"" + QString::fromStdString(reply.text).simplified() + '"';
  emit failed(QString("The %1 on %2 %3: %4").arg(name(), where(), what, why));
}

void NdiStartup::identify() {
  say("VER", "0", [this](const NdiReply& version) {
    if (!version.error) told_ = version.text;
    say("GETINFO", "Features.Firmware.Version", [this](const NdiReply& feature) {
      const std::size_t equals = feature.text.find('=');
      if (!feature.error && equals != std::string::npos)
        firmware_ = feature.text.substr(equals + 1, feature.text.find(';') - equals - 1);
      systemKnown();
    });
  });
}

void NdiStartup::systemKnown() {
  const NdiSystem& system = ndiSystem(ndi_.system, told_);
  const std::string first = told_.substr(0, told_.find('\n'));
  identity_.title = QString::fromStdString(system.word[0] ? std::string("NDI ") + system.word : "NDI tracker");
  if (system.word[0]) identity_.title[4] = identity_.title[4].toUpper();
  if (!firmware_.empty()) identity_.title += ' ' + QString::fromStdString(firmware_);
  identity_.model = identity_.title.toStdString() + (first.empty() ? "" : ", " + first);
  identity_.transmitter_model = system.transmitter_model;
  identity_.excitation = system.excitation;
  identity_.rate_hz = ndi_.frame_hz > 0.0 ? ndi_.frame_hz : system.frame_hz;
  if (const std::string serial = lineAfter(told_, "S/N:"); !serial.empty()) identity_.facts["serial"] = serial;
  emit progressed(QString("%1 answered; setting it up.").arg(identity_.title));
  freeHandles();
}

void NdiStartup::freeHandles() {
  say("PHSR", "01",
      [this](const NdiReply& reply) { freeNext(decodeNdiHandles(reply.text).value_or(std::vector<NdiHandle>{})); });
}

void NdiStartup::freeNext(std::vector<NdiHandle> handles) {
  if (handles.empty()) return writeDefinition(0);
  const int handle = handles.front().handle;
  handles.erase(handles.begin());
  say("PHF", hex(handle), [this, handles](const NdiReply&) { freeNext(handles); });
}

void NdiStartup::writeDefinition(std::size_t which) {
  if (which >= ndi_.roms.size()) return initialiseHandles();
  say("PHRQ", "*********1****", [this, which](const NdiReply& reply) {
    const auto handle = ndiNumber(reply.text);
    if (reply.error || !handle || reply.text.size() != 2) {
      return failWithReply("has no handle for " + QString::fromStdString(ndi_.roms[which].path), reply);
    }
    writeChunk(which, ndiWriteRom(static_cast<int>(*handle), ndi_.roms[which].content), 0);
  });
}

void NdiStartup::writeChunk(std::size_t which, const std::vector<std::string>& commands, std::size_t next) {
  if (next >= commands.size()) return writeDefinition(which + 1);
  askFirmly(commands[next], hasReply, [this, which, commands, next](const std::string& heard) {
    const NdiReply reply = *findNdiReply(heard);
    if (!reply.isOkay())
      return failWithReply("does not take the definition " + QString::fromStdString(ndi_.roms[which].path), reply);
    writeChunk(which, commands, next + 1);
  });
}

void NdiStartup::initialiseHandles() {
  say("PHSR", "02", [this](const NdiReply& reply) {
    auto handles = decodeNdiHandles(reply.text).value_or(std::vector<NdiHandle>{});
    // One tool can bring further handles once it is initialised: asked again until there are no new ones.
    std::erase_if(handles, [this](const NdiHandle& handle) { return tried_.contains(handle.handle); });
    handles.empty() ? enableHandles() : initialiseNext(std::move(handles));
  });
}

void NdiStartup::initialiseNext(std::vector<NdiHandle> handles) {
  if (handles.empty()) return initialiseHandles();
  const int handle = handles.front().handle;
  handles.erase(handles.begin());
  tried_.insert(handle);
  say("PINIT", hex(handle), [this, handle, handles](const NdiReply& reply) {
    if (reply.error) identity_.refused.push_back("PINIT:" + hex(handle) + " (" + ndiErrorMeaning(*reply.error) + ")");
    initialiseNext(handles);
  });
}

void NdiStartup::enableHandles() {
  say("PHSR", "03",
      [this](const NdiReply& reply) { enableNext(decodeNdiHandles(reply.text).value_or(std::vector<NdiHandle>{})); });
}

void NdiStartup::enableNext(std::vector<NdiHandle> handles) {
  if (handles.empty()) return enabledHandles();
  const int handle = handles.front().handle;
  handles.erase(handles.begin());
  say("PHINF", hex(handle) + "0001", [this, handle, handles](const NdiReply& told) {
    if (const auto tool = decodeNdiToolInformation(told.text))
      identity_.facts["tool_" + hex(handle)] =
          tool->serial + (tool->manufacturer.empty() ? "" : " " + tool->manufacturer);
    say("PENA", hex(handle) + "D", [this, handle, handles](const NdiReply& reply) {
      if (reply.error) identity_.refused.push_back("PENA:" + hex(handle) + " (" + ndiErrorMeaning(*reply.error) + ")");
      enableNext(handles);
    });
  });
}

void NdiStartup::enabledHandles() {
  say("PHSR", "04", [this](const NdiReply& reply) {
    for (const NdiHandle& handle : decodeNdiHandles(reply.text).value_or(std::vector<NdiHandle>{})) {
      handles_.push_back(handle.handle);
    }
    std::sort(handles_.begin(), handles_.end());
    const unsigned plugged =
        static_cast<unsigned>((std::uint64_t{1} << std::min<std::size_t>(handles_.size(), 32)) - 1u);
    identity_.stations = wantedStations(ndi_.stations, plugged);
    if (!identity_.stations.empty()) return startTracking();
    const QString refused = identity_.refused.empty() ? QString() : "; " + QString::fromStdString(identity_.refused[0]);
    emit failed(
        QString("The %1 on %2 has %3%4: plug a tool in, or give the definition of one without a cable by "
                "rom=FILE")
            .arg(name(), where(),
                 handles_.empty() ? QString("no tool") : QString("%1 tools, none of them wanted").arg(handles_.size()),
                 refused));
  });
}

void NdiStartup::startTracking() {
  say("TSTART", "80", [this](const NdiReply& reply) {
    // Tracking already: the reply to the first try was lost.
    if (reply.isOkay() || reply.error == kWrongMode) return tryBinary();
    say("TSTART", "", [this](const NdiReply& plain) {
      if (plain.isOkay() || plain.error == kWrongMode) return tryBinary();
      failWithReply("does not track", plain);
    });
  });
}

void NdiStartup::tryBinary() {
  binary_ = ndi_.reply != "tx";
  if (!binary_) return settled();
  const auto complete = [](const std::string& heard) {
    const std::size_t start = heard.find("\xC4\xA5");
    if (start == std::string::npos || heard.size() < start + kNdiBxHeader) return hasReply(heard);
    const auto length = ndiBxLength(std::string_view(heard).substr(start));
    return length && heard.size() >= start + *length;
  };
  askFirmly(ndiCommand("BX", "0001"), complete, [this](const std::string& heard) {
    const auto reply = findNdiReply(heard);
    const bool refused = heard.find("\xC4\xA5") == std::string::npos && reply && reply->error;
    if (!refused) return settled();
    if (ndi_.reply == "bx" || *reply->error != kUnknownCommand) return failWithReply("does not send poses", *reply);
    binary_ = false;
    settled();
  });
}

void NdiStartup::settled() {
  auto& facts = identity_.facts;
  facts["units"] = "millimetres";
  facts["reply"] = binary_ ? "bx" : "tx";
  facts["max_error_mm"] = fixedText(ndi_.gate.most_error_mm, 2);
  facts["volume"] = ndi_.gate.inside_volume ? "inside" : "any";
  if (!firmware_.empty()) facts["firmware"] = firmware_;
  for (const auto& [handle, sensor] : sensors())
    if (const auto told = facts.find("tool_" + hex(handle)); told != facts.end())
      facts["sensor_" + std::to_string(sensor + 1)] = told->second;
  for (std::size_t i = 0; i < ndi_.roms.size(); ++i) facts["rom_" + std::to_string(i + 1)] = ndi_.roms[i].path;
  finish();
}

std::map<int, int> NdiStartup::sensors() const {
  std::map<int, int> sensors;
  for (const int station : identity_.stations) sensors[handles_[static_cast<std::size_t>(station - 1)]] = station - 1;
  return sensors;
}

StreamPlan NdiStartup::stream() const {
  return madeStream(ndiStream({{"reply", binary_ ? "bx" : "tx"},
                               {"sensors", sensorsText(sensors())},
                               {"frame_hz", formatNumber(identity_.rate_hz)},
                               {"max_error_mm", formatNumber(ndi_.gate.most_error_mm)},
                               {"volume", ndi_.gate.inside_volume ? "inside" : "any"}}));
}

Result<StreamPlan> ndiStream(const StreamSettings& settings) {
  NdiStreamSettings stream;
  FT_TRY(const std::string reply, streamText(settings, "reply"));
  stream.binary = reply != "tx";
  FT_TRY(stream.sensors, streamSensors(settings));
  FT_TRY(stream.frame_hz, streamNumber(settings, "frame_hz"));
  if (stream.frame_hz <= 0.0) return fail(ErrorCode::kBadInput, "its setting frame_hz must be above 0");
  FT_TRY(stream.gate.most_error_mm, streamNumber(settings, "max_error_mm"));
  FT_TRY(const std::string volume, streamText(settings, "volume"));
  stream.gate.inside_volume = volume != "any";
  StreamPlan plan;
  plan.ask_again = ndiCommand(stream.binary ? "BX" : "TX", "0001");
  plan.parser = std::make_unique<NdiParser>(std::move(stream));
  plan.settings = settings;
  plan.ask_gap_ms = kAskGap_ms;
  plan.part = "Tool";
  plan.meaning = ndiSampleMeaning;
  return plan;
}

}  // namespace fieldtrue::acquisition
