#include "acquisition/devices/flock_device.h"

#include <algorithm>
#include <cctype>

#include "acquisition/protocols/plain_number.h"
#include "calib/core/declare.h"
#include "calib/core/file_io.h"
#include "calib/core/trimmed.h"

namespace fieldtrue::acquisition {
namespace {

namespace parameter = flock_parameter;

constexpr std::size_t kModelBytes = 10;
constexpr int kRunningTries = 10;
/// Where neither count nor crystal are told.
constexpr double kUsualRate_hz = 103.3;

/// Names of rows, led by others.
template <class Rows>
std::vector<std::string> idsOf(const Rows& rows, std::vector<std::string> ids = {}) {
  for (const auto& row : rows) ids.emplace_back(row.id);
  return ids;
}

std::vector<std::string> modesWithPosition() {
  std::vector<std::string> ids;
  for (const FlockMode& mode : flockModes()) {
    if (mode.position) ids.emplace_back(mode.id);
  }
  return ids;
}

const std::vector<int> kFlockRates = {115200, 57600, 38400, 19200, 9600, 4800, 2400};

bool isModel(std::string_view heard) {
  return heard.size() == kModelBytes &&
         std::all_of(heard.begin(), heard.end(), [](unsigned char c) { return std::isprint(c) != 0; });
}

/// Models of the family have one of these words in their names; ten bytes of anything are no answer.
std::optional<ProbeAnswer> flockAnswer(std::string_view heard) {
  constexpr std::string_view kWords[] = {"FOB", "ERC", "BIRD", "BOF", "PAD", "STAR"};
  const bool known = isModel(heard) &&
                     std::any_of(std::begin(kWords), std::end(kWords),
                                 [heard](std::string_view word) { return heard.find(word) != std::string_view::npos; });
  if (!known) return std::nullopt;
  ProbeAnswer answer;
  answer.model = "Ascension Flock of Birds " + std::string(trimmed(heard));
  return answer;
}

/// A stream of records: one byte in so many has its highest bit set, and so many is the length of a record.
std::optional<ProbeAnswer> flockStream(std::string_view heard) {
  constexpr int kRecords = 4;
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < heard.size(); ++i) {
    if ((static_cast<unsigned char>(heard[i]) & 0x80u) != 0) starts.push_back(i);
  }
  if (starts.size() <= kRecords) return std::nullopt;
  const std::size_t length = starts[1] - starts[0];
  const bool is_record = std::any_of(flockModes().begin(), flockModes().end(), [length](const FlockMode& mode) {
    return length == 2 * mode.words || length == 2 * mode.words + 1;
  });
  for (std::size_t i = 1; i < starts.size(); ++i) {
    if (starts[i] - starts[i - 1] != length) return std::nullopt;
  }
  return is_record ? std::optional<ProbeAnswer>(std::in_place) : std::nullopt;
}

}  // namespace

TrackerProbe flockProbe() {
  TrackerProbe probe;
  probe.rates = kFlockRates;
  probe.stop = flock::point();
  probe.ask = flock::examine(parameter::kModel);
  probe.drops_rts = true;
  probe.settle_ms = 600;
  probe.answer = flockAnswer;
  probe.stream = flockStream;
  probe.may_do = "A stream that runs is ended; where the line's RTS is wired, opening the line restarts it.";
  return probe;
}

std::vector<Setting> flockSettings() {
  return {
      stationsSetting(kFlockMostBirds),
      declare::choice("hemisphere", "Hemisphere", {"+x", "-x", "+y", "-y", "+z", "-z"}, "+x",
                      "Side of the transmitter on which the sensor is: front, aft, right, left, lower, upper."),
      declare::choice("filter", "Filter", {"off", "on", "as_set"}, "off",
                      "The birds' notch and DC filters; off for a calibration, because smoothed readings are not "
                      "independent."),
      declare::flag("raw_frame", "Raw frame", true,
                    "Clear angle align and reference frame, so that poses are in the transmitter's own frame."),
      declare::choice("range", "Range", {"auto", "36", "72", "144"}, "auto",
                      "Full scale of positions in inches; auto asks the birds, 144 is the extended range transmitter."),
      declare::choice("record", "Record", modesWithPosition(), "position_quaternion", "What the birds send."),
      declare::choice("repeats", "Repeats", {"drop", "keep"}, "drop",
                      "Readings that say to the bit what the one before said: a bird asked too often repeats itself."),
      declare::choice("quaternion", "Quaternion", {"as_sent", "inverted"}, "as_sent",
                      "Whether this firmware's quaternions turn the other way; check on the Signal page."),
      declare::choice("matrix", "Matrix", {"rows", "columns"}, "rows",
                      "Whether this firmware's matrices come by rows or by columns; check on the Signal page."),
      declare::choice("mirrored", "Mirrored axis", {"none", "x", "y", "z"}, "none",
                      "An axis that is turned over where the installation's frame is left-handed."),
      declare::choice("addressing", "Addressing", idsOf(flockAddressings(), {"auto"}), "auto",
                      "How birds behind the first are addressed; auto asks the first."),
      declare::flag("may_reset", "May reset", true, "Hold the birds in reset by RTS for a moment at the start."),
  };
}

Result<std::unique_ptr<TrackerDevice>> makeFlock(const std::string& address, const simulation::Scene&) {
  const auto apply = [](const Settings& settings, FlockSetup& setup) -> Result<void> {
    FT_TRY(setup.stations, readStations(settings, setup.id, kFlockMostBirds));
    setup.hemisphere = choiceSetting(settings, "hemisphere");
    setup.filter = choiceSetting(settings, "filter");
    setup.raw_frame = boolSetting(settings, "raw_frame");
    setup.range = choiceSetting(settings, "range");
    setup.record = choiceSetting(settings, "record");
    setup.drop_repeats = choiceSetting(settings, "repeats") == "drop";
    setup.conventions.inverted_quaternion = choiceSetting(settings, "quaternion") == "inverted";
    setup.conventions.matrix_by_columns = choiceSetting(settings, "matrix") == "columns";
    const std::string& mirrored = choiceSetting(settings, "mirrored");
    setup.conventions.mirrored = mirrored == "none" ? '\0' : mirrored[0];
    setup.addressing = choiceSetting(settings, "addressing");
    setup.may_reset = boolSetting(settings, "may_reset");
    return {};
  };
  return deviceAtAddress<FlockStartup>(address, flockSettings(), FlockSetup{}, apply);
}

FlockStartup::FlockStartup(Transport& line, const FlockSetup& setup) : TrackerStartup(line, setup), flock_(setup) {}

void FlockStartup::run() {
  // Opening a line raises RTS, which holds the bird in reset: it must go down whether or not that is wanted.
  const bool has_modem_lines = line_.setBaud(flock_.baud);
  if (!has_modem_lines) return callOut();
  line_.setRequestToSend(true);
  emit progressed("Resetting the flock.");
  exchange_.tell({}, flock_.may_reset ? flock_.pulse_ms : 0, [this](const std::string&) {
    line_.setRequestToSend(false);
    exchange_.tell({}, flock_.boot_ms, [this](const std::string&) { callOut(); });
  });
}

void FlockStartup::callOut() {
  Greeting greeting;
  greeting.stop = flock::point();
  greeting.ask = flock::examine(parameter::kModel);
  greeting.answered = isModel;
  greeting.rates = kFlockRates;
  greet(std::move(greeting), [this](const std::string& heard) { modelCame(heard); });
}

LineStep FlockStartup::tell(int address, const std::string& command) const {
  return {flock::toBird(address, command, addressing_), flock_.timings.command_ms, {}, {}};
}

LineStep FlockStartup::examine(int number, std::size_t bytes, std::function<void(const std::string&)> take) const {
  return {flock::examine(number), flock_.timings.reply_ms,
          [bytes](const std::string& heard) { return heard.size() >= bytes; },
          [bytes, take = std::move(take)](const std::string& heard) {
            // Older units do not know every parameter and say nothing.
            if (heard.size() >= bytes) take(heard);
            return true;
          }};
}

void FlockStartup::modelCame(const std::string& model) {
  model_ = trimmed(model);
  emit progressed(QString("%1 answered; setting it up.").arg(QString::fromStdString(model_)));
  std::vector<LineStep> steps;
  // Reading the last error clears it: what is told later is of this start.
  steps.push_back(examine(parameter::kError, 1, [this](const std::string& heard) {
    const std::string meaning = flockErrorMeaning(static_cast<unsigned char>(heard[0]));
    if (!meaning.empty()) identity_.facts["error_before"] = meaning;
  }));
  steps.push_back(examine(parameter::kRevision, 2, [this](const std::string& heard) {
    revision_ = std::to_string(static_cast<unsigned char>(heard[0])) + "." +
                std::to_string(static_cast<unsigned char>(heard[1]));
  }));
  steps.push_back(examine(parameter::kAddressing, 1, [this](const std::string& heard) {
    for (const FlockAddressingKind& kind : flockAddressings()) {
      if (kind.code == heard[0]) addressing_ = kind.addressing;
    }
  }));
  steps.push_back(
      examine(parameter::kAddress, 1, [this](const std::string& heard) { standalone_ = heard[0] == '\0'; }));
  perform(std::move(steps), [this] {
    for (const FlockAddressingKind& kind : flockAddressings()) {
      if (kind.id == flock_.addressing) addressing_ = kind.addressing;
    }
    const auto bytes = static_cast<std::size_t>(flockAddressing(addressing_).status_bytes);
    perform({examine(parameter::kFlockStatus, bytes,
                     [this, bytes](const std::string& heard) { units_ = decodeFlockUnits(heard.substr(0, bytes)); })},
            [this] { unitsKnown(); });
  });
}

void FlockStartup::unitsKnown() {
  std::vector<int> all;
  for (std::size_t i = 0; i < units_.size(); ++i) {
    if (units_[i].accessible && units_[i].receiver) all.push_back(static_cast<int>(i) + 1);
  }
  const bool alone = standalone_ || units_.empty();
  if (alone) all = {0};
  const unsigned plugged = static_cast<unsigned>((std::uint64_t{1} << std::min<std::size_t>(all.size(), 32)) - 1u);
  identity_.stations = wantedStations(flock_.stations, plugged);
  if (identity_.stations.empty()) return failNothingPluggedIn(flock_.stations);
  receivers_ = all;
  group_ = all.size() > 1 || all.front() > 1;
  isConfigured() ? setUpBirds() : configure();
}

bool FlockStartup::isConfigured() const {
  return std::all_of(receivers_.begin(), receivers_.end(), [this](int address) {
    return address == 0 || units_[static_cast<std::size_t>(address - 1)].running;
  });
}

void FlockStartup::configure() {
  int highest = 0;
  for (std::size_t i = 0; i < units_.size(); ++i) {
    if (units_[i].accessible) highest = static_cast<int>(i) + 1;
  }
  emit progressed(QString("Configuring a flock of %1 units.").arg(highest));
  perform({{{}, flock_.configure_ms, {}, {}}, {flock::autoConfigure(highest), flock_.configure_ms, {}, {}}},
          [this] { awaitRunning(kRunningTries); });
}

void FlockStartup::awaitRunning(int tries) {
  const std::size_t bytes = units_.size();
  exchange_.ask(
      flock::examine(parameter::kFlockStatus), [bytes](const std::string& heard) { return heard.size() >= bytes; },
      flock_.timings.reply_ms,
      [this, bytes, tries](const std::string& heard) {
        if (heard.size() >= bytes) units_ = decodeFlockUnits(heard.substr(0, bytes));
        if (isConfigured()) return setUpBirds();
        if (tries > 1) {
          return exchange_.tell({}, flock_.configure_ms,
                                [this, tries](const std::string&) { awaitRunning(tries - 1); });
        }
        emit failed(QString("The %1 on %2 was configured, but not all of its birds run: check the power, the address "
                            "switches and the bus cables of each unit")
                        .arg(name(), where()));
      });
}

std::vector<int> FlockStartup::birdCommandAddresses() const {
  // Where there is one bird only, it is the one on the line and needs no prefix.
  if (receivers_.size() == 1 && receivers_.front() <= 1) return {0};
  return receivers_;
}

void FlockStartup::setUpBirds() {
  std::vector<LineStep> steps;
  steps.push_back(tell(0, flock::run()));
  for (const int bird : birdCommandAddresses()) {
    steps.push_back(tell(bird, flock::mode(*findFlockMode(flock_.record))));
    steps.push_back(tell(bird, flock::hemisphere(flock_.hemisphere)));
    if (flock_.filter != "as_set") {
      const bool on = flock_.filter == "on";
      steps.push_back(tell(bird, flock::filters(on, on, on)));
    }
    if (flock_.range == "36" || flock_.range == "72") steps.push_back(tell(bird, flock::scale(flock_.range == "72")));
    if (!flock_.raw_frame) continue;
    steps.push_back(tell(bird, flock::clearAngleAlign()));
    steps.push_back(tell(bird, flock::clearReferenceFrame()));
  }
  steps.push_back(tell(0, flock::reportEveryCycle()));
  steps.push_back(tell(0, flock::groupMode(group_)));
  const auto number = [](int& into) { return [&into](const std::string& heard) { into = flockNumber(heard); }; };
  steps.push_back(examine(parameter::kScale, 2, number(scale_)));
  steps.push_back(examine(parameter::kCrystal, 2, number(crystal_mhz_)));
  steps.push_back(examine(parameter::kRateCount, 2, number(rate_count_)));
  steps.push_back(examine(parameter::kError, 1,
                          [this](const std::string& heard) { error_ = static_cast<unsigned char>(heard[0]); }));
  perform(std::move(steps), [this] { verify(); });
}

void FlockStartup::verify() {
  constexpr int kCommandError = 6;
  if (error_ == kCommandError) identity_.refused.push_back(flockErrorMeaning(error_));
  if (error_ != 0 && error_ != kCommandError) {
    emit failed(QString("The %1 on %2 tells of an error: %3 (error %4)")
                    .arg(name(), where(), QString::fromStdString(flockErrorMeaning(error_)))
                    .arg(error_));
    return;
  }
  const std::string ask =
      flock::toBird(birdCommandAddresses().front(), flock::examine(parameter::kStatus), addressing_);
  askFirmly(
      ask, [](const std::string& heard) { return heard.size() >= 2; },
      [this](const std::string& heard) {
        status_ = decodeFlockStatus(heard);
        status_.mode == findFlockMode(flock_.record)->code
            ? settled()
            : failNotTaken(QString::fromStdString("record " + flock_.record));
      });
}

double FlockStartup::range_m() const {
  if (flock_.range != "auto") {
    return flock_.range == "36" ? kFlockRange36_m : flock_.range == "72" ? kFlockRange72_m : kFlockRange144_m;
  }
  const bool extended = std::any_of(units_.begin(), units_.end(), [](const FlockUnit& unit) {
    return unit.accessible && unit.extended_range_controller;
  });
  return extended ? kFlockRange144_m : scale_ != 0 ? kFlockRange72_m : kFlockRange36_m;
}

void FlockStartup::settled() {
  constexpr double kInchesPerMetre = 1.0 / 0.0254;
  identity_.title = "Flock of Birds " + QString::fromStdString(revision_);
  identity_.model = flock_.make + " " + model_ + (revision_.empty() ? "" : " " + revision_);
  identity_.rate_hz = rate_count_ > 0 && crystal_mhz_ > 0 ? flockRate_hz(rate_count_, crystal_mhz_) : kUsualRate_hz;
  identity_.quantum_m = range_m() * kFlockStep;
  auto& facts = identity_.facts;
  facts["units"] = "inches";
  facts["record"] = flock_.record;
  facts["range_in"] = fixedText(range_m() * kInchesPerMetre, 0);
  facts["filter"] = flock_.filter;
  facts["hemisphere"] = flock_.hemisphere;
  facts["raw_frame"] = flock_.raw_frame ? "yes" : "no";
  facts["repeats"] = flock_.drop_repeats ? "dropped" : "kept";
  facts["addressing"] = standalone_ ? "standalone" : flockAddressing(addressing_).id;
  facts["quaternion"] = flock_.conventions.inverted_quaternion ? "inverted" : "as_sent";
  facts["matrix"] = flock_.conventions.matrix_by_columns ? "columns" : "rows";
  facts["mirrored"] = flock_.conventions.mirrored ? std::string(1, flock_.conventions.mirrored) : "none";
  const std::string remark = flockStatusMeaning(status_);
  if (!remark.empty()) facts["status"] = remark;
  finish();
}

StreamPlan FlockStartup::stream() const {
  std::map<int, int> sensors;
  for (std::size_t i = 0; i < receivers_.size(); ++i) {
    const int station = static_cast<int>(i) + 1;
    const bool wanted =
        std::find(identity_.stations.begin(), identity_.stations.end(), station) != identity_.stations.end();
    sensors[std::max(1, receivers_[i])] = wanted ? station - 1 : -1;
  }
  const auto yes = [](bool is) { return is ? std::string("yes") : std::string("no"); };
  const FlockConventions& conventions = flock_.conventions;
  return madeStream(flockStream({{"sensors", sensorsText(sensors)},
                                 {"record", flock_.record},
                                 {"group", yes(group_)},
                                 {"range_m", formatNumber(range_m())},
                                 {"drop_repeats", yes(flock_.drop_repeats)},
                                 {"matrix_by_columns", yes(conventions.matrix_by_columns)},
                                 {"inverted_quaternion", yes(conventions.inverted_quaternion)},
                                 {"mirrored", std::string(conventions.mirrored ? 1 : 0, conventions.mirrored)}}));
}

Result<StreamPlan> flockStream(const StreamSettings& settings) {
  FlockStreamSettings stream;
  FT_TRY(const std::string record, streamText(settings, "record"));
  stream.layout.mode = findFlockMode(record);
  if (!stream.layout.mode)
    return fail(ErrorCode::kBadInput, "its setting record is '" + record + "', which no bird has");
  FT_TRY(stream.layout.group, streamFlag(settings, "group"));
  FT_TRY(stream.layout.range_m, streamNumber(settings, "range_m"));
  FlockConventions& conventions = stream.layout.conventions;
  FT_TRY(conventions.matrix_by_columns, streamFlag(settings, "matrix_by_columns"));
  FT_TRY(conventions.inverted_quaternion, streamFlag(settings, "inverted_quaternion"));
  FT_TRY(const std::string mirrored, streamText(settings, "mirrored"));
  if (!mirrored.empty() && mirrored != "x" && mirrored != "y" && mirrored != "z") {
    return fail(ErrorCode::kBadInput, "its setting mirrored is '" + mirrored + "'; it must be x, y, z or nothing");
  }
  conventions.mirrored = mirrored.empty() ? '\0' : mirrored[0];
  FT_TRY(stream.drop_repeats, streamFlag(settings, "drop_repeats"));
  FT_TRY(stream.sensors, streamSensors(settings));
  StreamPlan plan;
  plan.parser = std::make_unique<FlockParser>(std::move(stream));
  plan.settings = settings;
  plan.begin = flock::stream();
  plan.part = "Bird";
  plan.meaning = flockSampleMeaning;
  return plan;
}

}  // namespace fieldtrue::acquisition
