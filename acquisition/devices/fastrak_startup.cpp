#include "acquisition/devices/fastrak_startup.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "calib/core/declare.h"

namespace fieldtrue::acquisition {
namespace {

constexpr std::array kRates = {115200, 57600, 38400, 19200, 9600, 4800, 2400};
constexpr int kStatusTries = 3;
constexpr int kRateReply_ms = 400;

struct ReadBack {
  char letter;
  const char* name;
};
/// What survives in the tracker's EEPROM and changes what it reports.
constexpr ReadBack kReadBacks[] = {
    {'I', "increment"}, {'V', "position_envelope"}, {'Q', "angular_envelope"}, {'H', "hemisphere"}};

Eigen::Vector3d hemisphereVector(const std::string& name) {
  Eigen::Vector3d towards = Eigen::Vector3d::Zero();
  if (name.size() == 2) towards[name[1] - 'x'] = name[0] == '-' ? -1.0 : 1.0;
  return towards;
}

std::string firstBytes(const std::string& bytes) {
  constexpr std::size_t kShown = 4;
  std::string text;
  for (std::size_t i = 0; i < std::min(kShown, bytes.size()); ++i) {
    std::array<char, 4> hex{};
    std::snprintf(hex.data(), hex.size(), "%02X", static_cast<unsigned char>(bytes[i]));
    text += (i ? " " : "") + std::string(hex.data());
  }
  return text;
}

}  // namespace

std::vector<Setting> fastrakSettings() {
  return {
      declare::choice(
          "stations", "Stations",
          {"auto", "1", "2", "3", "4", "12", "13", "14", "23", "24", "34", "123", "124", "134", "234", "1234"}, "auto",
          "Receivers to read; auto takes those that are plugged in."),
      declare::choice(
          "hemisphere", "Hemisphere", {"+x", "-x", "+y", "-y", "+z", "-z", "tracked"}, "+x",
          "Side of the transmitter on which the sensor is; tracked follows it as long as it is not interrupted."),
      declare::choice(
          "filter", "Filter", {"off", "low", "medium", "heavy"}, "off",
          "The tracker's own smoothing; off for a calibration, because smoothed readings are not independent."),
      declare::flag("raw_frame", "Raw frame", true,
                    "Reset alignment and boresight, so that poses are in the transmitter's own frame."),
      declare::flag("may_reset", "May re-initialise", true,
                    "Restart the tracker (about 12 s) when it does not answer."),
  };
}

void applyFastrakSettings(const Settings& settings, FastrakSetup& setup) {
  setup.stations = choiceSetting(settings, "stations");
  setup.hemisphere = choiceSetting(settings, "hemisphere");
  setup.filter = choiceSetting(settings, "filter");
  setup.raw_frame = boolSetting(settings, "raw_frame");
  setup.may_reset = boolSetting(settings, "may_reset");
}

FastrakStartup::FastrakStartup(Transport& line, FastrakSetup setup, QObject* parent)
    : QObject(parent), line_(line), setup_(std::move(setup)), exchange_(line, this) {
  identity_.baud = setup_.baud;
  connect(&exchange_, &LineExchange::bytesSeen, this, &FastrakStartup::bytesSeen);
}

QString titleOf(const FastrakSetup& setup, const FastrakStatus& status) {
  QString title = QString::fromStdString(setup.name);
  title.front() = title.front().toUpper();
  return setup.tells_version ? title + ' ' + QString::fromStdString(status.version) : title;
}

void FastrakStartup::run() { stopStream(); }

void FastrakStartup::stopStream() {
  const FastrakTimings& t = setup_.timings;
  exchange_.tell(encode(fastrak::continuous(false)), t.settle_ms, [this, t](const std::string&) {
    exchange_.drain(t.quiet_ms, t.drain_most_ms, [this, t](const std::string&) {
      exchange_.tell("\r", t.clear_ms, [this](const std::string&) { askStatus(kStatusTries); });
    });
  });
}

void FastrakStartup::askStatus(int tries) {
  const int most_ms = next_rate_ > 0 ? std::min(kRateReply_ms, setup_.timings.reply_ms) : setup_.timings.reply_ms;
  exchange_.ask(
      encode(fastrak::status()), [](const std::string& heard) { return findStatus(heard).has_value(); }, most_ms,
      [this, tries](const std::string& heard) {
        if (const auto status = findStatus(heard)) return statusCame(*status);
        // Something came: the record was damaged, or the rate is wrong. Nothing came: asking again rarely helps.
        const int left = heard.empty() ? std::min(tries - 1, 1) : tries - 1;
        left > 0 && next_rate_ == 0 ? askStatus(left) : noStatus();
      });
}

void FastrakStartup::noStatus() {
  if (rates_known_) return tryNextRate();
  giveUp();
}

void FastrakStartup::tryNextRate() {
  while (next_rate_ < kRates.size()) {
    const int rate = kRates[next_rate_++];
    if (rate == setup_.baud) continue;
    if (!line_.setBaud(rate)) break;
    identity_.baud = rate;
    emit progressed(QString("No %1 answered at %2 baud; trying %3.")
                        .arg(QString::fromStdString(setup_.name))
                        .arg(setup_.baud)
                        .arg(rate));
    exchange_.tell("\r", setup_.timings.clear_ms, [this](const std::string&) { askStatus(1); });
    return;
  }
  rates_known_ = false;
  next_rate_ = 0;
  identity_.baud = setup_.baud;
  line_.setBaud(setup_.baud);
  giveUp();
}

void FastrakStartup::giveUp() {
  const QString where = QString::fromStdString(setup_.where);
  const QString name = QString::fromStdString(setup_.name);
  if (exchange_.bytesHeard() > 0) {
    const int other = setup_.baud == 19200 ? 115200 : 19200;
    const QString shown = QString::fromStdString(firstBytes(exchange_.lastHeard()));
    emit failed(QString("Got bytes that are not %1 records on %2%3: the line's rate is probably wrong; try %4 (%5@%4), "
                        "and check the rate switches at the back of the tracker")
                    .arg(name, where, shown.isEmpty() ? QString() : " (" + shown + ")")
                    .arg(other)
                    .arg(QString::fromStdString(setup_.device_text)));
    return;
  }
  if (setup_.may_reset && !was_reset_) return reset();
  emit failed(QString("No answer from a %1 on %2: check that it is switched on, that the cable is a null-modem cable "
                      "in the right socket, and that its rate switches say %3")
                  .arg(name, where)
                  .arg(setup_.baud));
}

void FastrakStartup::reset() {
  was_reset_ = true;
  emit progressed(QString("No answer; restarting the tracker, which takes up to %1 s.")
                      .arg((setup_.timings.reset_ms + 999) / 1000));
  exchange_.tell(encode(fastrak::reinitialise()), setup_.timings.reset_ms,
                 [this](const std::string&) { stopStream(); });
}

void FastrakStartup::statusCame(const FastrakStatus& status) {
  identity_.status = status;
  identity_.stations.clear();
  for (int station = 1; station <= kFastrakStations; ++station) {
    const bool wanted =
        setup_.stations == "auto" || setup_.stations.find(static_cast<char>('0' + station)) != std::string::npos;
    if (wanted && status.plugged(station)) identity_.stations.push_back(station);
  }
  if (identity_.stations.empty()) {
    emit failed(QString("The %1 on %2 answers but has no receiver plugged in%3; plug one into station 1")
                    .arg(QString::fromStdString(setup_.name), QString::fromStdString(setup_.where),
                         setup_.stations == "auto"
                             ? QString()
                             : QString(" at station %1").arg(QString::fromStdString(setup_.stations))));
    return;
  }
  emit progressed(QString("%1 answered; setting it up.").arg(titleOf(setup_, status)));
  commands_ = commands();
  sendCommands(0);
}

std::vector<FastrakCommand> FastrakStartup::filterCommands() const {
  constexpr std::array kMacros = {"off", "low", "medium", "heavy"};
  if (setup_.filter == "off") return {fastrak::positionFilterOff(), fastrak::attitudeFilterOff()};
  const auto found = std::find(kMacros.begin(), kMacros.end(), setup_.filter);
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
    if (setup_.raw_frame) {
      list.push_back(fastrak::resetAlignment(station));
      list.push_back(fastrak::unBoresight(station));
    }
    list.push_back(fastrak::hemisphere(station, hemisphereVector(setup_.hemisphere)));
    list.push_back(fastrak::outputList(station, kFastrakDriverItems));
  }
  list.push_back(fastrak::format(FastrakFormat::kBinary));
  return list;
}

void FastrakStartup::noteRefusal(const std::string& heard) {
  const auto refusal = findRefusal(heard);
  if (refusal) identity_.refused.push_back(refusal->command + " (" + refusalMeaning(refusal->code) + ")");
}

void FastrakStartup::sendCommands(std::size_t next) {
  if (next >= commands_.size()) return readBackSettings(0);
  exchange_.tell(encode(commands_[next]), setup_.timings.command_ms, [this, next](const std::string& heard) {
    noteRefusal(heard);
    sendCommands(next + 1);
  });
}

void FastrakStartup::readBackSettings(std::size_t next) {
  if (next >= std::size(kReadBacks)) return verify(kStatusTries);
  const ReadBack& asked = kReadBacks[next];
  const int station = identity_.stations.front();
  exchange_.ask(
      encode(fastrak::readBack(asked.letter, station)),
      [](const std::string& heard) { return heard.find('\n') != std::string::npos; }, setup_.timings.reply_ms,
      [this, next, asked, station](const std::string& heard) {
        if (const auto text = findReadBack(heard, asked.letter, station)) identity_.readings[asked.name] = *text;
        // A tracker that does not know reading back is not asked again.
        heard.empty() ? verify(kStatusTries) : readBackSettings(next + 1);
      });
}

void FastrakStartup::verify(int tries) {
  exchange_.ask(
      encode(fastrak::status()), [](const std::string& heard) { return findStatus(heard).has_value(); },
      setup_.timings.reply_ms,
      [this, tries](const std::string& heard) {
        const auto status = findStatus(heard);
        if (!status && tries > 1) return verify(tries - 1);
        if (!status) {
          emit failed(QString("The %1 on %2 stopped answering while it was set up; switch it off and on again")
                          .arg(QString::fromStdString(setup_.name), QString::fromStdString(setup_.where)));
          return;
        }
        const char* wrong = status->unit != FastrakUnit::kCentimetre   ? "centimetres"
                            : status->format != FastrakFormat::kBinary ? "binary output"
                            : status->compensation                     ? "compensation off"
                                                                       : nullptr;
        if (wrong) {
          emit failed(QString("The %1 on %2 did not take the setting \"%3\"; switch it off and on again")
                          .arg(QString::fromStdString(setup_.name), QString::fromStdString(setup_.where), wrong));
          return;
        }
        identity_.status = *status;
        startOutput();
      });
}

void FastrakStartup::startOutput() {
  // Nothing may be read here any more: what follows are records.
  disconnect(&line_, nullptr, &exchange_, nullptr);
  const QByteArray command = QByteArray::fromStdString(encode(fastrak::continuous(true)));
  emit finished();
  line_.write(command);
  emit bytesSeen(true, command);
}

}  // namespace fieldtrue::acquisition
