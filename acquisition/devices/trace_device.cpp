#include "acquisition/devices/trace_device.h"

#include <algorithm>
#include <cmath>

#include "acquisition/devices/line_address.h"
#include "acquisition/devices/registry.h"
#include "acquisition/devices/stream_reader.h"
#include "acquisition/devices/trace_file.h"
#include "acquisition/emulators/pose_source.h"
#include "calib/core/declare.h"
#include "calib/tables/table_io.h"

namespace fieldtrue::acquisition {
namespace {

const DeviceKind* kindWithStream(const std::string& id) {
  for (const DeviceKind& kind : deviceKinds()) {
    if (kind.id == id && kind.stream) return &kind;
  }
  return nullptr;
}

/// The chunks that came from a tracker while it streamed.
class TracePlayback : public Playback {
 public:
  /// @error kBadInput: what is wrong with the trace, without the file's name
  static Result<std::unique_ptr<Playback>> make(Trace trace) {
    const DeviceKind* kind = kindWithStream(trace.tracker);
    if (!kind) return fail(ErrorCode::kBadInput, "it is of a tracker '" + trace.tracker + "', which is not known here");
    std::unique_ptr<TracePlayback> playback(new TracePlayback(std::move(trace), *kind));
    // Made once now, so that settings that cannot be read are refused here and not in the middle.
    for (const TraceStream& stream : playback->trace_.streams) FT_TRY_VOID(kind->stream(stream.settings));
    if (playback->pieces_.empty()) {
      return fail(ErrorCode::kBadInput, "no stream is in it: the tracker never got to send its readings");
    }
    playback->rewind();
    return playback;
  }

  std::size_t pieces() const override { return pieces_.size(); }
  double due_s(std::size_t piece) const override { return trace_.chunks[pieces_[piece]].t_s; }
  bool breaksBefore(std::size_t piece) const override {
    return std::find(breaks_.begin(), breaks_.end(), piece) != breaks_.end();
  }
  double round_s() const override { return due_s(pieces_.size() - 1) - due_s(0) + 1.0 / trace_.streams[0].rate_hz; }
  QString summary() const override { return QString::fromStdString(trace_.streams[0].summary); }
  TableMetadata describe() const override { return trace_.streams[0].metadata; }

  void rewind() override {
    reader_.reset();
    next_stream_ = 0;
  }

  Piece play(std::size_t piece) override {
    const std::size_t at = pieces_[piece];
    while (next_stream_ < trace_.streams.size() && trace_.streams[next_stream_].first_chunk <= at) beginStream();
    const TraceChunk& chunk = trace_.chunks[at];
    auto batch = reader_->read(std::string_view(trace_.bytes).substr(chunk.offset, chunk.length), chunk.t_s);
    return {std::move(batch.samples), std::move(batch.remarks)};
  }

 private:
  TracePlayback(Trace trace, const DeviceKind& kind) : trace_(std::move(trace)), kind_(kind) {
    std::size_t from = 0;
    for (const TraceStream& stream : trace_.streams) {
      if (!pieces_.empty()) breaks_.push_back(pieces_.size());
      for (from = std::max(from, stream.first_chunk); from < stream.end_chunk; ++from) {
        if (!trace_.chunks[from].sent) pieces_.push_back(from);
      }
    }
  }

  void beginStream() {
    const TraceStream& stream = trace_.streams[next_stream_++];
    reader_ = std::make_unique<StreamReader>(madeStream(kind_.stream(stream.settings)), stream.rate_hz,
                                             trace_.clock_speed, QString::fromStdString(stream.summary));
  }

  Trace trace_;
  const DeviceKind& kind_;
  std::vector<std::size_t> pieces_;  ///< Chunks.
  std::vector<std::size_t> breaks_;  ///< Pieces with which another stream begins.
  std::size_t next_stream_ = 0;
  std::unique_ptr<StreamReader> reader_;
};

/// The samples of a table, one by one in the order of their times.
class TablePlayback : public Playback {
 public:
  explicit TablePlayback(const SampleTable& table)
      : metadata_(table.metadata), source_(table), rows_(table.rows.size()) {
    for (int sensor = 0; sensor < static_cast<int>(kMostSensors); ++sensor) sensors_.push_back(sensor);
  }

  std::size_t pieces() const override { return rows_; }
  double due_s(std::size_t piece) const override { return *source_.due_s(piece, 1); }
  Piece play(std::size_t piece) override { return {source_.read(piece, sensors_, 0.0), {}}; }
  double round_s() const override {
    const double rate_hz = metadata_.rate_hz.value_or(source_.rate_hz());
    return due_s(rows_ - 1) + (rate_hz > 0.0 ? 1.0 / rate_hz : 1.0);
  }
  void rewind() override {}
  QString summary() const override {
    return QString("%1, %2 readings")
        .arg(QString::fromStdString(metadata_.tracker.value_or("a sample table")))
        .arg(rows_);
  }
  TableMetadata describe() const override { return metadata_; }

 private:
  TableMetadata metadata_;
  mutable ReplaySource source_;
  std::size_t rows_;
  std::vector<int> sensors_;
};

Result<std::unique_ptr<Playback>> openTable(const std::filesystem::path& file) {
  FT_TRY(const auto reading, readSampleTable(file));
  return std::make_unique<TablePlayback>(reading.table);
}

}  // namespace

Result<std::unique_ptr<Playback>> openPlayback(const std::filesystem::path& file) {
  if (file.extension() == ".csv") return openTable(file);
  FT_TRY(auto trace, readTrace(file));
  auto playback = TracePlayback::make(std::move(trace));
  if (!playback) {
    return fail(playback.error().code, file.string() + " is no trace that can be played: " + playback.error().message);
  }
  return playback;
}

std::vector<Setting> traceSettings() {
  return {
      declare::number("rate", "Rate", {0.01, 1000.0}, 1.0, "The recording's seconds per second."),
      declare::flag("loop", "Loop", false, "Start anew at the recording's end."),
  };
}

Result<std::unique_ptr<TrackerDevice>> makeTraceDevice(const std::string& address, const simulation::Scene&) {
  const std::size_t comma = std::min(address.find(','), address.size());
  TraceSetup setup;
  setup.file = address.substr(0, comma);
  if (setup.file.empty()) {
    return fail(ErrorCode::kBadInput,
                "No recording is named; write e.g. trace:fault.trace.zip or trace:room.samples.csv");
  }
  FT_TRY(const Settings settings,
         readDeviceSettings("trace", traceSettings(), address.substr(std::min(comma + 1, address.size()))));
  setup.rate = numberSetting(settings, "rate");
  setup.loop = boolSetting(settings, "loop");
  return std::make_unique<TraceDevice>(std::move(setup));
}

TraceDevice::TraceDevice(TraceSetup setup, QObject* parent) : TrackerDevice(parent), setup_(std::move(setup)) {
  timer_.setParent(this);
  timer_.setSingleShot(true);
  timer_.setTimerType(Qt::PreciseTimer);
  connect(&timer_, &QTimer::timeout, this, &TraceDevice::playDue);
}

void TraceDevice::start() {
  if (broken_) return goOn();
  if (playback_) return;
  const QString file = QString::fromStdString(setup_.file.string());
  emit stateChanged(DeviceState::kConnecting, "Opening " + file);
  auto opened = openPlayback(setup_.file);
  if (!opened) {
    emit stateChanged(DeviceState::kFailed, QString::fromStdString(opened.error().message));
    return;
  }
  playback_ = std::move(*opened);
  next_ = 0;
  round_s_ = 0.0;
  from_s_ = playback_->due_s(0);
  clock_.start();
  timer_.start(0);
  emit stateChanged(DeviceState::kRunning, QString("Playing %1: %2").arg(file, playback_->summary()));
}

void TraceDevice::playDue() {
  // A slice at a time: who listens may stop it, and a fast recording must not keep the thread.
  constexpr qint64 kSlice_ms = 20;
  QElapsedTimer slice;
  slice.start();
  while (playback_ && slice.elapsed() < kSlice_ms) {
    if (next_ == playback_->pieces()) return end();
    if (found_again_ != next_ && playback_->breaksBefore(next_)) return breakOff();
    const double now_s = 1e-9 * static_cast<double>(clock_.nsecsElapsed()) * setup_.rate;
    const double wait_s = (playback_->due_s(next_) - from_s_ + round_s_ - now_s) / setup_.rate;
    if (wait_s > 0.0) return timer_.start(static_cast<int>(std::min(1e6, std::ceil(1e3 * wait_s))));
    play();
  }
  if (playback_) timer_.start(0);
}

void TraceDevice::breakOff() {
  broken_ = true;
  emit stateChanged(DeviceState::kFailed, "Here the tracker was lost when this was recorded");
}

void TraceDevice::goOn() {
  broken_ = false;
  found_again_ = next_;
  // Who asked late misses nothing: what is due already is due now, and the rest so much later.
  const double now_s = 1e-9 * static_cast<double>(clock_.nsecsElapsed()) * setup_.rate;
  from_s_ = std::min(from_s_, playback_->due_s(next_) + round_s_ - now_s);
  emit stateChanged(DeviceState::kConnecting, "Waiting for the recording to go on");
  timer_.start(0);
}

void TraceDevice::play() {
  if (found_again_ == next_) emit stateChanged(DeviceState::kRunning, playback_->summary());
  if (!playback_) return;
  Playback::Piece piece = playback_->play(next_++);
  for (Sample& sample : piece.samples) sample.time_s += round_s_;
  for (const QString& remark : piece.remarks) emit stateChanged(DeviceState::kRunning, remark);
  if (playback_ && !piece.samples.empty()) emit samplesReceived(piece.samples);
}

void TraceDevice::end() {
  if (setup_.loop) {
    round_s_ += playback_->round_s();
    next_ = 0;
    found_again_.reset();
    playback_->rewind();
    return timer_.start(0);
  }
  stop();
}

void TraceDevice::stop() {
  const bool is_at_end = playback_ && next_ == playback_->pieces();
  broken_ = false;
  found_again_.reset();
  timer_.stop();
  playback_.reset();
  const QString file = QString::fromStdString(setup_.file.string());
  emit stateChanged(DeviceState::kClosed, is_at_end ? QString("The recording %1 is at its end").arg(file) : "Closed");
}

TableMetadata TraceDevice::describe() const {
  TableMetadata metadata = playback_ ? playback_->describe() : TableMetadata{};
  if (!metadata.tracker) metadata.tracker = "a recording";
  metadata.other["played_from"] = setup_.file.filename().string();
  return metadata;
}

}  // namespace fieldtrue::acquisition
