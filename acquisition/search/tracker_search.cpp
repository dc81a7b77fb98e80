#include "acquisition/search/tracker_search.h"

#include <algorithm>

#include "acquisition/search/known_adapters.h"
#include "acquisition/transports/line_holders.h"
#include "acquisition/transports/serial_ports.h"

namespace fieldtrue::acquisition {
namespace {

constexpr int kListen_ms = 300;
constexpr int kQuiet_ms = 60;
constexpr int kMostDrain_ms = 400;
constexpr int kLongest_ms = 60000;
constexpr std::string_view kNetwork = "tcp:";

bool isOnNetwork(const std::string& line) { return line.starts_with(kNetwork); }

std::string withoutNetwork(const std::string& line) { return isOnNetwork(line) ? line.substr(kNetwork.size()) : line; }

/// Whether the line's port is where trackers of the kind usually are.
bool isUsualFor(const DeviceKind& kind, const std::string& line) {
  const std::string port = line.substr(std::min(line.rfind(':'), line.size()));
  return std::any_of(kind.usual_addresses.begin(), kind.usual_addresses.end(),
                     [&](const std::string& usual) { return usual.ends_with(port) && !port.empty(); });
}

bool isOn(const std::vector<KnownUsb>& known, const std::optional<UsbAdapter>& adapter) {
  return adapter && std::any_of(known.begin(), known.end(), [&](const KnownUsb& usb) {
           return usb.vendor == adapter->vendor && usb.first_product <= adapter->product &&
                  adapter->product <= usb.last_product;
         });
}

/// Kinds that can be on the line: those whose adapter it is, or whose port, first.
std::vector<const DeviceKind*> kindsOn(const LineFinding& finding) {
  std::vector<const DeviceKind*> kinds;
  for (const DeviceKind& kind : deviceKinds()) {
    const bool only_on_network = !kind.usual_addresses.empty();
    if (kind.probe && (!only_on_network || isOnNetwork(finding.line))) kinds.push_back(&kind);
  }
  std::stable_partition(kinds.begin(), kinds.end(), [&](const DeviceKind* kind) {
    return isOn(kind->usb, finding.adapter) || (isOnNetwork(finding.line) && isUsualFor(*kind, finding.line));
  });
  return kinds;
}

std::vector<int> ratesOf(const std::vector<const DeviceKind*>& kinds) {
  std::vector<int> rates;
  for (const DeviceKind* kind : kinds) {
    for (const int rate : kind->probe->rates) {
      if (std::find(rates.begin(), rates.end(), rate) == rates.end()) rates.push_back(rate);
    }
  }
  return rates;
}

bool hasRate(const TrackerProbe& probe, int rate) {
  return rate == 0 || std::find(probe.rates.begin(), probe.rates.end(), rate) != probe.rates.end();
}

std::string sensorsText(const ProbeAnswer& answer) {
  std::string text;
  for (const int sensor : answer.sensors) text += (text.empty() ? "" : ", ") + std::to_string(sensor);
  for (const std::string& name : answer.sensor_names) text += (text.empty() ? "" : ", ") + name;
  if (text.empty()) return {};
  return (answer.sensors.size() + answer.sensor_names.size() == 1 ? ", sensor " : ", sensors ") + text;
}

}  // namespace

LineSearch::LineSearch(std::string line, MakeLine make_line, QObject* parent)
    : QObject(parent), make_line_(std::move(make_line)) {
  finding_.line = std::move(line);
}

LineSearch::~LineSearch() {
  if (transport_) transport_->disconnect(this);
}

void LineSearch::start() {
  finding_.adapter = isOnNetwork(finding_.line) ? std::nullopt : usbAdapterOf(finding_.line);
  finding_.note = KnownAdapters::ofUser().noteOn(finding_.line, finding_.adapter);
  kinds_ = kindsOn(finding_);
  rates_ = ratesOf(kinds_);
  if (rates_.empty() || isOnNetwork(finding_.line)) rates_ = {0};
  auto made = make_line_(finding_.line + (rates_[0] > 0 ? "@" + std::to_string(rates_[0]) : std::string()));
  if (!made) return finish(made.error().message);
  transport_ = std::move(*made);
  connect(transport_.get(), &Transport::lineLost, this, [this](const QString& why) { finish(why.toStdString()); });
  connect(transport_.get(), &Transport::lineOpened, this, &LineSearch::opened);
  const auto line_opened = transport_->openLine();
  if (!line_opened) return finish(line_opened.error().message);
  if (transport_->isOpen()) opened();
}

void LineSearch::opened() {
  if (!isOnNetwork(finding_.line)) {
    for (const std::string& program : holdersOf(finding_.line)) {
      finding_.note += (finding_.note.empty() ? "" : " ") + program + " has this line open too.";
    }
  }
  exchange_ = std::make_unique<LineExchange>(*transport_);
  listen();
}

void LineSearch::listen() {
  kind_ = 0;
  asked_.clear();
  exchange_->tell({}, kListen_ms, [this](const std::string& heard) { listened(heard); });
}

void LineSearch::listened(const std::string& heard) {
  for (const DeviceKind* kind : kinds_) {
    auto stream = kind->probe->stream ? kind->probe->stream(heard) : std::nullopt;
    if (!stream) continue;
    streaming_ = kind;
    stream_answer_ = std::move(*stream);
    // What it is can be guessed; who it is, only it can say.
    if (kind->probe->ask.empty()) return found(*kind, stream_answer_);
    asked_.insert(kind->probe->stop + kind->probe->ask);
    return ask(*kind);
  }
  askNext();
}

void LineSearch::askNext() {
  while (kind_ < kinds_.size()) {
    const DeviceKind& kind = *kinds_[kind_++];
    const TrackerProbe& probe = *kind.probe;
    // What belongs to a port is asked there only: the bytes of one protocol are commands in another.
    const bool is_there = kind.usual_addresses.empty() || isUsualFor(kind, finding_.line);
    if (probe.ask.empty() || !is_there || !hasRate(probe, rates_[rate_])) continue;
    if (!asked_.insert(probe.stop + probe.ask).second) continue;
    return ask(kind);
  }
  nextRate();
}

void LineSearch::ask(const DeviceKind& kind) {
  const TrackerProbe& probe = *kind.probe;
  if (probe.drops_rts) transport_->setRequestToSend(false);
  if (probe.break_ms <= 0) return askAfterBreak(probe);
  transport_->setBreak(true);
  exchange_->tell({}, probe.break_ms, [this, &probe](const std::string&) {
    transport_->setBreak(false);
    askAfterBreak(probe);
  });
}

void LineSearch::askAfterBreak(const TrackerProbe& probe) {
  exchange_->tell(probe.stop, probe.settle_ms, [this, &probe](const std::string&) {
    exchange_->drain(kQuiet_ms, kMostDrain_ms, [this, &probe](const std::string&) {
      const auto is_answer = [&probe](const std::string& heard) { return probe.answer(heard).has_value(); };
      exchange_->ask(probe.ask, is_answer, probe.reply_ms, [this](const std::string& heard) { answered(heard); });
    });
  });
}

void LineSearch::answered(const std::string& heard) {
  for (const DeviceKind* kind : kinds_) {
    if (auto answer = kind->probe->answer(heard)) return found(*kind, std::move(*answer));
  }
  askNext();
}

void LineSearch::nextRate() {
  // It sends and does not answer. Records of others can look like its own, so that these were asked first.
  if (streaming_) return found(*streaming_, stream_answer_);
  if (rate_ + 1 >= rates_.size() || !transport_->setBaud(rates_[rate_ + 1])) return nothing();
  ++rate_;
  listen();
}

void LineSearch::found(const DeviceKind& kind, ProbeAnswer answer) {
  FoundTracker tracker{kind.id, kind.label, {}, streaming_ != nullptr, std::move(answer)};
  const bool on_network_only = !kind.usual_addresses.empty();
  tracker.device = kind.id + ":" + (on_network_only ? withoutNetwork(finding_.line) : finding_.line);
  // Where the line has a rate, it is part of the address.
  const int rate = rates_[rate_];
  if (rate > 0 && transport_->setBaud(rate)) tracker.device += "@" + std::to_string(rate);
  const ProbeAnswer& told = tracker.answer;
  std::string text = told.model.empty() ? kind.label : told.model;
  if (!told.firmware.empty()) text += ", firmware " + told.firmware;
  text += sensorsText(told);
  if (tracker.was_streaming) text += ", was sending already";
  if (finding_.adapter) KnownAdapters::ofUser().remember(*finding_.adapter, finding_.line, tracker.device);
  finding_.tracker = std::move(tracker);
  finish(text);
}

void LineSearch::nothing() {
  const std::uint64_t heard = exchange_->bytesHeard();
  finish(heard > 0 ? "No known tracker: " + std::to_string(heard) + " bytes came that none of them sends"
                   : std::string(
                         "Nothing answered: check that the tracker is switched on and its cable is a null-modem one"));
}

void LineSearch::stop(const QString& why) {
  if (!finished_) finish(why.toStdString());
}

void LineSearch::finish(std::string text) {
  if (finished_) return;
  finished_ = true;
  finding_.text = std::move(text);
  // Both may be on the call stack.
  if (exchange_) exchange_.release()->deleteLater();
  if (transport_) {
    transport_->disconnect();
    transport_->close();
    transport_.release()->deleteLater();
  }
  emit finished();
}

TrackerSearch::TrackerSearch(std::vector<std::string> lines, bool and_usual_lines, QObject* parent)
    : QObject(parent), lines_(std::move(lines)), usual_lines_(and_usual_lines || lines_.empty()) {
  qRegisterMetaType<LineFinding>();
  limit_.setParent(this);
  limit_.setSingleShot(true);
  connect(&limit_, &QTimer::timeout, this, [this] { end("Stopped after 60 s"); });
}

void TrackerSearch::start() {
  if (running_) return;
  running_ = true;
  searches_.clear();
  quiet_.clear();
  std::vector<std::string> lines = lines_;
  const auto add = [&lines](const std::string& line) {
    const bool is_new = std::find(lines.begin(), lines.end(), line) == lines.end();
    if (is_new) lines.push_back(line);
    return is_new;
  };
  if (usual_lines_) {
    for (const SerialPortInfo& port : listSerialPorts()) add(port.path);
    for (const DeviceKind& kind : deviceKinds()) {
      for (const std::string& usual : kind.usual_addresses) {
        if (add(std::string(kNetwork) + usual)) quiet_.insert(std::string(kNetwork) + usual);
      }
    }
  }
  limit_.start(kLongest_ms);
  for (const std::string& line : lines) searches_.push_back(std::make_unique<LineSearch>(line));
  for (const auto& search : searches_) {
    LineSearch* line = search.get();
    connect(
        line, &LineSearch::finished, this, [this, line] { lineFinished(line); }, Qt::QueuedConnection);
  }
  // Not before all are there: the first may be finished at once.
  for (const auto& search : searches_) search->start();
  if (searches_.empty()) end({});
}

void TrackerSearch::lineFinished(LineSearch* line) {
  if (!running_) return;
  const LineFinding& finding = line->finding();
  if (finding.tracker || !quiet_.contains(finding.line)) emit lineDone(finding);
  const auto is_finished = [](const auto& search) { return search->isFinished(); };
  if (std::all_of(searches_.begin(), searches_.end(), is_finished)) end({});
}

void TrackerSearch::stop() { end("Stopped"); }

void TrackerSearch::end(const QString& why) {
  if (!running_) return;
  running_ = false;
  limit_.stop();
  for (const auto& search : searches_) search->stop(why);
  emit finished();
}

std::vector<LineFinding> TrackerSearch::findings() const {
  std::vector<LineFinding> findings;
  for (const auto& search : searches_) {
    const LineFinding& finding = search->finding();
    if (finding.tracker || !quiet_.contains(finding.line)) findings.push_back(finding);
  }
  return findings;
}

}  // namespace fieldtrue::acquisition
