#include "acquisition/devices/line_device.h"

#include <QDateTime>
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

LineDevice::LineDevice(LineSetup setup, StartupFactory make_startup, TransportFactory make_line, TrackerClock clock,
                       QObject* parent)
    : TrackerDevice(parent),
      setup_(std::move(setup)),
      make_startup_(std::move(make_startup)),
      make_line_(std::move(make_line)),
      clock_(std::move(clock)) {
  watch_.setParent(this);
  connect(&watch_, &QTimer::timeout, this, &LineDevice::watch);
  gap_.setParent(this);
  gap_.setSingleShot(true);
  connect(&gap_, &QTimer::timeout, this, [this] { say(reader_->plan().ask_again); });
}

LineDevice::~LineDevice() {
  if (line_ && running_) line_->write(QByteArray::fromStdString(end_));
  if (line_) line_->disconnect(this);
}

void LineDevice::say(const std::string& bytes) {
  if (bytes.empty()) return;
  const QByteArray sent = QByteArray::fromStdString(bytes);
  line_->write(sent);
  seen(true, sent, clock_.now_s());
}

void LineDevice::seen(bool sent, const QByteArray& bytes, double at_s) {
  trace_.add(at_s, sent, {bytes.constData(), static_cast<std::size_t>(bytes.size())});
  emit bytesSeen(sent, bytes);
}

std::optional<Trace> LineDevice::trace() const {
  Trace trace = trace_.content();
  trace.tracker = setup_.id;
  trace.device = setup_.device_text;
  trace.software = "Fieldtrue " FIELDTRUE_VERSION;
  trace.recorded = QDateTime::currentDateTimeUtc().toString(Qt::ISODate).toStdString();
  trace.clock_speed = clock_.speed();
  return trace;
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
  connect(startup_.get(), &TrackerStartup::bytesSeen, this,
          [this](bool sent, const QByteArray& bytes) { seen(sent, bytes, clock_.now_s()); });
  connect(startup_.get(), &TrackerStartup::failed, this, &LineDevice::failWith);
  connect(startup_.get(), &TrackerStartup::finished, this, &LineDevice::startupFinished);
  connect(startup_.get(), &TrackerStartup::progressed, this,
          [this](const QString& text) { emit stateChanged(DeviceState::kConnecting, text); });
  startup_->run();
}

void LineDevice::startupFinished() {
  identity_ = startup_->identity();
  StreamPlan plan = startup_->stream();
  const QString text = summary(plan.part);
  trace_.beginStream({0, 0, plan.settings, identity_->rate_hz, text.toStdString(), describe()});
  reader_ = std::make_unique<StreamReader>(std::move(plan), identity_->rate_hz, clock_.speed(), text);
  quiet_ticks_ = 0;
  heard_since_tick_ = noise_since_reading_ = false;
  answers_ = answers_at_tick_ = 0;
  connect(line_.get(), &QIODevice::readyRead, this, &LineDevice::readReady);
  watch_.start(kWatch_ms);
  say(reader_->plan().begin);
  say(reader_->plan().ask_again);
}

void LineDevice::readReady() {
  const QByteArray bytes = line_->readAll();
  if (bytes.isEmpty()) return;
  const double arrival_s = clock_.now_s();
  seen(false, bytes, arrival_s);
  const auto batch = reader_->read({bytes.constData(), static_cast<std::size_t>(bytes.size())}, arrival_s);
  const StreamPlan& plan = reader_->plan();
  noise_since_reading_ = batch.samples.empty();
  if (plan.parser->answers() != answers_) askAgain(batch.samples.empty() ? plan.ask_gap_ms : 0);
  if (batch.samples.empty()) return;
  heard_since_tick_ = true;
  if (!running_) running();
  for (const QString& remark : batch.remarks) emit stateChanged(DeviceState::kRunning, remark);
  emit samplesReceived(batch.samples);
}

void LineDevice::askAgain(int gap_ms) {
  answers_ = reader_->plan().parser->answers();
  if (gap_ms > 0) return gap_.start(gap_ms);
  say(reader_->plan().ask_again);
}

void LineDevice::running() {
  running_ = true;
  const QString text = reader_->summary();
  emit stateChanged(DeviceState::kRunning, text);
}

QString LineDevice::summary(const QString& part_name) const {
  const auto& stations = identity_->stations;
  const QString part = part_name.toLower();
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

void LineDevice::watch() {
  if (!reader_) return;
  quiet_ticks_ = std::exchange(heard_since_tick_, false) ? 0 : quiet_ticks_ + 1;
  // An answer was lost on the line: who only sends when asked would be silent for ever.
  const std::string& ask_again = reader_->plan().ask_again;
  if (!ask_again.empty() && answers_ == answers_at_tick_) say(ask_again);
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
  trace_.endStream();
  watch_.stop();
  gap_.stop();
  running_ = false;
  retire(this, farewell_);
  retire(this, startup_);
  if (line_) line_->close();
  retire(this, line_);
  reader_.reset();
}

void LineDevice::stop() {
  if (!line_) {
    emit stateChanged(DeviceState::kClosed, "Closed");
    return;
  }
  if (farewell_) return;
  trace_.endStream();
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
  connect(farewell_.get(), &LineExchange::bytesSeen, this,
          [this](bool sent, const QByteArray& bytes) { seen(sent, bytes, clock_.now_s()); });
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
