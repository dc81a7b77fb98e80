#include "acquisition/devices/line_device.h"

#include <algorithm>

namespace fieldtrue::acquisition {
namespace {

constexpr int kWatch_ms = 250;

/// Deletes later: the object may be the one whose signal is being handled.
template <class Object>
void retire(QObject* owner, std::unique_ptr<Object>& object) {
  if (!object) return;
  object->disconnect(owner);
  object.release()->deleteLater();
}

}  // namespace

LineDevice::LineDevice(LineSetup setup, StartupFactory make_startup, TransportFactory make_line, double clock_speed,
                       QObject* parent)
    : TrackerDevice(parent),
      setup_(std::move(setup)),
      make_startup_(std::move(make_startup)),
      make_line_(std::move(make_line)),
      clock_speed_(clock_speed) {
  watch_.setParent(this);
  connect(&watch_, &QTimer::timeout, this, &LineDevice::watch);
  gap_.setParent(this);
  gap_.setSingleShot(true);
  connect(&gap_, &QTimer::timeout, this, [this] { say(stream_.ask_again); });
}

LineDevice::~LineDevice() {
  if (line_ && running_) line_->write(QByteArray::fromStdString(end_));
  if (line_) line_->disconnect(this);
}

double LineDevice::now_s() const { return static_cast<double>(clock_.nsecsElapsed()) * 1e-9 * clock_speed_; }

void LineDevice::say(const std::string& bytes) {
  if (bytes.empty()) return;
  const QByteArray sent = QByteArray::fromStdString(bytes);
  line_->write(sent);
  emit bytesSeen(true, sent);
}

void LineDevice::start() {
  if (line_) return;
  emit stateChanged(DeviceState::kConnecting, "Opening " + QString::fromStdString(setup_.where));
  clock_.start();
  auto line = make_line_();
  if (line) {
    if (auto opened = (*line)->openLine(); !opened) line = tl::unexpected(opened.error());
  }
  if (!line) {
    emit stateChanged(DeviceState::kFailed, QString::fromStdString(line.error().message));
    return;
  }
  line_ = std::move(*line);
  connect(line_.get(), &Transport::lineLost, this, &LineDevice::failWith);
  if (line_->isOpen())
    beginStartup();
  else
    connect(line_.get(), &Transport::lineOpened, this, &LineDevice::beginStartup);
}

void LineDevice::beginStartup() {
  startup_ = make_startup_(*line_);
  end_ = startup_->farewell();
  connect(startup_.get(), &TrackerStartup::bytesSeen, this, &LineDevice::bytesSeen);
  connect(startup_.get(), &TrackerStartup::failed, this, &LineDevice::failWith);
  connect(startup_.get(), &TrackerStartup::finished, this, &LineDevice::startupFinished);
  connect(startup_.get(), &TrackerStartup::progressed, this,
          [this](const QString& text) { emit stateChanged(DeviceState::kConnecting, text); });
  startup_->run();
}

void LineDevice::startupFinished() {
  identity_ = startup_->identity();
  stream_ = startup_->stream();
  FT_CHECK(stream_.parser != nullptr && identity_->rate_hz > 0.0);
  clocks_.clear();
  unit_clock_ = UnitClock(clock_speed_);
  hemisphere_ = {};
  last_status_.clear();
  quiet_ticks_ = 0;
  heard_since_tick_ = noise_since_reading_ = false;
  answers_ = answers_at_tick_ = 0;
  connect(line_.get(), &QIODevice::readyRead, this, &LineDevice::readReady);
  watch_.start(kWatch_ms);
  say(stream_.begin);
  say(stream_.ask_again);
}

void LineDevice::readReady() {
  const QByteArray bytes = line_->readAll();
  if (bytes.isEmpty()) return;
  emit bytesSeen(false, bytes);
  std::vector<Reading> readings;
  stream_.parser->add({bytes.constData(), static_cast<std::size_t>(bytes.size())}, readings);
  noise_since_reading_ = readings.empty();
  if (stream_.parser->answers() != answers_) askAgain(readings.empty() ? stream_.ask_gap_ms : 0);
  if (readings.empty()) return;
  heard_since_tick_ = true;
  if (!running_) running();
  const double arrival_s = now_s();
  std::map<int, std::size_t> left;
  for (const Reading& reading : readings) ++left[reading.sample.sensor];
  std::vector<Sample> samples;
  samples.reserve(readings.size());
  for (Reading& reading : readings) {
    Sample sample = stamped(reading, arrival_s, --left[reading.sample.sensor]);
    if (stream_.watches_mirrors) hemisphere_.check(sample);
    noteStatus(sample);
    samples.push_back(std::move(sample));
  }
  emit samplesReceived(samples);
}

void LineDevice::askAgain(int gap_ms) {
  answers_ = stream_.parser->answers();
  if (gap_ms > 0) return gap_.start(gap_ms);
  say(stream_.ask_again);
}

Sample LineDevice::stamped(Reading& reading, double arrival_s, std::size_t later_in_bunch) {
  Sample sample = std::move(reading.sample);
  if (reading.unit_s) {
    sample.time_s = unit_clock_.stamp(arrival_s, *reading.unit_s);
    if (unit_clock_.jumped()) noteJump();
  } else {
    SampleClock& clock = clocks_.try_emplace(sample.sensor, 1.0 / identity_->rate_hz).first->second;
    sample.time_s = clock.stamp(arrival_s, later_in_bunch);
  }
  return sample;
}

void LineDevice::running() {
  running_ = true;
  emit stateChanged(DeviceState::kRunning, summary());
}

QString LineDevice::summary() const {
  const auto& stations = identity_->stations;
  const QString part = QString(stream_.part).toLower();
  QString text = QString("%1, %2 at %3 Hz")
                     .arg(identity_->title, stations.size() == 1 ? QString("%1 %2").arg(part).arg(stations.front())
                                                                 : QString("%1 %2s").arg(stations.size()).arg(part))
                     .arg(identity_->rate_hz);
  if (identity_->baud != setup_.baud) {
    text += QString(" (found at %1 baud, not %2: write %3@%1 next time)")
                .arg(identity_->baud)
                .arg(setup_.baud)
                .arg(QString::fromStdString(setup_.device_text));
  }
  return text;
}

void LineDevice::noteStatus(const Sample& sample) {
  std::string& last = last_status_[sample.sensor];
  if (last == sample.status) return;
  last = sample.status;
  emit stateChanged(DeviceState::kRunning, last.empty() ? summary()
                                                        : QString("%1 %2: %3")
                                                              .arg(stream_.part)
                                                              .arg(sample.sensor + 1)
                                                              .arg(QString::fromStdString(stream_.meaning(last))));
}

void LineDevice::noteJump() {
  emit stateChanged(DeviceState::kRunning,
                    QString("%1; its clock jumped by %2 s").arg(summary()).arg(unit_clock_.jump_s(), 0, 'f', 2));
}

void LineDevice::watch() {
  if (!stream_.parser) return;
  quiet_ticks_ = std::exchange(heard_since_tick_, false) ? 0 : quiet_ticks_ + 1;
  // An answer was lost on the line: who only sends when asked would be silent for ever.
  if (!stream_.ask_again.empty() && answers_ == answers_at_tick_) say(stream_.ask_again);
  answers_at_tick_ = answers_;
  const int limit_ms = running_ ? setup_.timings.silence_ms : setup_.timings.lock_ms;
  if (quiet_ticks_ * kWatch_ms < limit_ms) return;
  const QString where = QString::fromStdString(setup_.where);
  const QString name = QString::fromStdString(setup_.name);
  if (noise_since_reading_) {
    failWith(QString("Got bytes that are not %1 records on %2: another program may be changing the tracker's settings, "
                     "or the line is disturbed; connect again")
                 .arg(name, where));
  } else if (running_) {
    failWith(
        QString("The %1 on %2 has gone silent: check its power and its cable, then connect again").arg(name, where));
  } else {
    failWith(QString("The %1 on %2 answers but sends no records: check that the receiver and the transmitter are "
                     "plugged in, then connect again")
                 .arg(name, where));
  }
}

void LineDevice::failWith(const QString& text) {
  if (!line_) return;
  closeLine();
  emit stateChanged(DeviceState::kFailed, text);
}

void LineDevice::closeLine() {
  watch_.stop();
  gap_.stop();
  running_ = false;
  retire(this, farewell_);
  retire(this, startup_);
  if (line_) line_->close();
  retire(this, line_);
  stream_.parser.reset();
}

void LineDevice::stop() {
  if (!line_) {
    emit stateChanged(DeviceState::kClosed, "Closed");
    return;
  }
  if (farewell_) return;
  if (!line_->isOpen()) {
    closeLine();
    emit stateChanged(DeviceState::kClosed, "Closed");
    return;
  }
  watch_.stop();
  gap_.stop();
  running_ = false;
  retire(this, startup_);
  disconnect(line_.get(), &QIODevice::readyRead, this, nullptr);
  farewell_ = std::make_unique<LineExchange>(*line_);
  connect(farewell_.get(), &LineExchange::bytesSeen, this, &LineDevice::bytesSeen);
  const auto closed = [this](const std::string&) {
    closeLine();
    emit stateChanged(DeviceState::kClosed, "Closed");
  };
  farewell_->tell(end_, setup_.timings.settle_ms, [this, closed](const std::string&) {
    farewell_->drain(setup_.timings.stop_quiet_ms, setup_.timings.drain_most_ms, closed);
  });
}

TableMetadata LineDevice::describe() const {
  TableMetadata metadata;
  metadata.tracker = setup_.make;
  metadata.transmitter_model = setup_.transmitter_model;
  if (!setup_.excitation.empty()) metadata.excitation = setup_.excitation;
  metadata.setup["tracker_kind"] = setup_.id;
  if (!identity_) return metadata;
  metadata.tracker = identity_->model;
  metadata.rate_hz = identity_->rate_hz;
  metadata.quantum_m = identity_->quantum_m;
  if (identity_->transmitter_model) metadata.transmitter_model = identity_->transmitter_model;
  if (identity_->excitation) metadata.excitation = identity_->excitation;
  if (metadata.excitation == "") metadata.excitation.reset();
  const std::string prefix = setup_.id + "_";
  metadata.other[prefix + "stations"] = stationsText(identity_->stations);
  for (const auto& [key, text] : identity_->facts) metadata.other[prefix + key] = text;
  for (std::size_t i = 0; i < identity_->refused.size(); ++i) {
    metadata.other[prefix + "refused_" + std::to_string(i + 1)] = identity_->refused[i];
  }
  constexpr std::pair<const char*, const char*> kSetupFacts[] = {{"units", "units"},
                                                                 {"filter", "filter"},
                                                                 {"compensation", "factory_compensation"},
                                                                 {"serial", "tracker_serial"},
                                                                 {"transmitter_serial", "transmitter_serial"}};
  for (const auto& [fact, key] : kSetupFacts) {
    if (const auto told = identity_->facts.find(fact); told != identity_->facts.end())
      metadata.setup[key] = told->second;
  }
  return metadata;
}

}  // namespace fieldtrue::acquisition
