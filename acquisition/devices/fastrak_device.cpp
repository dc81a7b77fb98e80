#include "acquisition/devices/fastrak_device.h"

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

FastrakDevice::FastrakDevice(FastrakSetup setup, TransportFactory make_line, double clock_speed, QObject* parent)
    : TrackerDevice(parent), setup_(std::move(setup)), make_line_(std::move(make_line)), clock_speed_(clock_speed) {
  watch_.setParent(this);
  connect(&watch_, &QTimer::timeout, this, &FastrakDevice::watch);
}

FastrakDevice::~FastrakDevice() {
  if (line_ && running_) line_->write(encode(fastrak::continuous(false)).c_str());
  if (line_) line_->disconnect(this);
}

double FastrakDevice::now_s() const { return static_cast<double>(clock_.nsecsElapsed()) * 1e-9 * clock_speed_; }

double FastrakDevice::rate_hz() const {
  const std::size_t stations = identity_ ? std::max<std::size_t>(1, identity_->stations.size()) : 1;
  return setup_.rate_hz / static_cast<double>(stations);
}

void FastrakDevice::start() {
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
  connect(line_.get(), &Transport::lineLost, this, &FastrakDevice::failWith);
  if (line_->isOpen())
    beginStartup();
  else
    connect(line_.get(), &Transport::lineOpened, this, &FastrakDevice::beginStartup);
}

void FastrakDevice::beginStartup() {
  startup_ = std::make_unique<FastrakStartup>(*line_, setup_);
  connect(startup_.get(), &FastrakStartup::bytesSeen, this, &FastrakDevice::bytesSeen);
  connect(startup_.get(), &FastrakStartup::failed, this, &FastrakDevice::failWith);
  connect(startup_.get(), &FastrakStartup::finished, this, &FastrakDevice::startupFinished);
  connect(startup_.get(), &FastrakStartup::progressed, this,
          [this](const QString& text) { emit stateChanged(DeviceState::kConnecting, text); });
  startup_->run();
}

void FastrakDevice::startupFinished() {
  identity_ = startup_->identity();
  FastrakStreamSettings stream;
  for (const int station : identity_->stations) {
    stream.items[static_cast<std::size_t>(station - 1)] = {kFastrakDriverItems.begin(), kFastrakDriverItems.end()};
  }
  auto parser = FastrakParser::make(stream);
  FT_CHECK(parser.has_value());
  parser_ = std::move(*parser);
  clocks_.assign(kFastrakStations, SampleClock(1.0 / rate_hz()));
  hemisphere_ = {};
  last_status_ = {};
  quiet_ticks_ = 0;
  records_seen_ = bytes_at_last_record_ = 0;
  connect(line_.get(), &QIODevice::readyRead, this, &FastrakDevice::readReady);
  watch_.start(kWatch_ms);
}

void FastrakDevice::readReady() {
  const QByteArray bytes = line_->readAll();
  if (bytes.isEmpty()) return;
  emit bytesSeen(false, bytes);
  std::vector<FastrakRecord> records;
  parser_->add({bytes.constData(), static_cast<std::size_t>(bytes.size())}, records);
  if (records.empty()) return;
  bytes_at_last_record_ = parser_->bytes();
  if (!running_) running();
  const double arrival_s = now_s();
  std::array<std::size_t, kFastrakStations> left{};
  for (const auto& record : records) ++left[static_cast<std::size_t>(record.station - 1)];
  std::vector<Sample> samples;
  samples.reserve(records.size());
  for (const auto& record : records) {
    const auto station = static_cast<std::size_t>(record.station - 1);
    Sample sample = toSample(record, clocks_[station].stamp(arrival_s, --left[station]));
    hemisphere_.check(sample);
    noteStatus(sample);
    samples.push_back(std::move(sample));
  }
  emit samplesReceived(samples);
}

void FastrakDevice::running() {
  running_ = true;
  emit stateChanged(DeviceState::kRunning, summary());
}

QString FastrakDevice::summary() const {
  QString text = QString("%1, %2 at %3 Hz")
                     .arg(titleOf(setup_, identity_->status))
                     .arg(identity_->stations.size() == 1 ? QString("station %1").arg(identity_->stations.front())
                                                          : QString("%1 stations").arg(identity_->stations.size()))
                     .arg(rate_hz());
  if (identity_->baud != setup_.baud) {
    text += QString(" (found at %1 baud, not %2: write %3@%1 next time)")
                .arg(identity_->baud)
                .arg(setup_.baud)
                .arg(QString::fromStdString(setup_.device_text));
  }
  return text;
}

void FastrakDevice::noteStatus(const Sample& sample) {
  std::string& last = last_status_[static_cast<std::size_t>(sample.sensor)];
  if (last == sample.status) return;
  last = sample.status;
  emit stateChanged(
      DeviceState::kRunning,
      last.empty() ? summary()
                   : QString("Station %1: %2").arg(sample.sensor + 1).arg(QString::fromStdString(statusMeaning(last))));
}

void FastrakDevice::watch() {
  if (!parser_) return;
  const bool news = parser_->records() > records_seen_;
  records_seen_ = parser_->records();
  quiet_ticks_ = news ? 0 : quiet_ticks_ + 1;
  const int limit_ms = running_ ? setup_.timings.silence_ms : setup_.timings.lock_ms;
  if (quiet_ticks_ * kWatch_ms < limit_ms) return;
  const QString where = QString::fromStdString(setup_.where);
  const QString name = QString::fromStdString(setup_.name);
  if (parser_->bytes() > bytes_at_last_record_) {
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

void FastrakDevice::failWith(const QString& text) {
  if (!line_) return;
  closeLine();
  emit stateChanged(DeviceState::kFailed, text);
}

void FastrakDevice::closeLine() {
  watch_.stop();
  running_ = false;
  retire(this, farewell_);
  retire(this, startup_);
  if (line_) line_->close();
  retire(this, line_);
  parser_.reset();
}

void FastrakDevice::stop() {
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
  running_ = false;
  retire(this, startup_);
  disconnect(line_.get(), &QIODevice::readyRead, this, nullptr);
  farewell_ = std::make_unique<LineExchange>(*line_);
  connect(farewell_.get(), &LineExchange::bytesSeen, this, &FastrakDevice::bytesSeen);
  const auto closed = [this](const std::string&) {
    closeLine();
    emit stateChanged(DeviceState::kClosed, "Closed");
  };
  farewell_->tell(encode(fastrak::continuous(false)), setup_.timings.settle_ms, [this, closed](const std::string&) {
    farewell_->drain(setup_.timings.stop_quiet_ms, setup_.timings.drain_most_ms, closed);
  });
}

TableMetadata FastrakDevice::describe() const {
  TableMetadata metadata;
  metadata.tracker = "Polhemus Fastrak";
  metadata.transmitter_model = "dipole";
  metadata.excitation = "ac";
  metadata.setup["tracker_kind"] = "fastrak";
  if (!identity_) return metadata;
  const FastrakStatus& status = identity_->status;
  metadata.tracker = "Polhemus Fastrak " + status.version + (status.identity.empty() ? "" : ", " + status.identity);
  metadata.rate_hz = rate_hz();
  auto& other = metadata.other;
  other["fastrak_stations"].clear();
  for (const int station : identity_->stations) other["fastrak_stations"] += std::to_string(station);
  other["fastrak_units"] = status.unit == FastrakUnit::kCentimetre ? "centimetres" : "inches";
  other["fastrak_format"] = status.format == FastrakFormat::kBinary ? "binary" : "ascii";
  other["fastrak_filter"] = setup_.filter;
  other["fastrak_compensation"] = status.compensation ? "on" : "off";
  metadata.setup["units"] = other["fastrak_units"];
  metadata.setup["filter"] = other["fastrak_filter"];
  metadata.setup["factory_compensation"] = other["fastrak_compensation"];
  other["fastrak_hemisphere"] = setup_.hemisphere;
  other["fastrak_raw_frame"] = setup_.raw_frame ? "yes" : "no";
  if (!status.self_test_error.empty()) other["fastrak_self_test"] = status.self_test_error;
  for (const auto& [name, text] : identity_->readings) other["fastrak_" + name + "_read_back"] = text;
  for (std::size_t i = 0; i < identity_->refused.size(); ++i) {
    other["fastrak_refused_" + std::to_string(i + 1)] = identity_->refused[i];
  }
  return metadata;
}

}  // namespace fieldtrue::acquisition
