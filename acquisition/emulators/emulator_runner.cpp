#include "acquisition/emulators/emulator_runner.h"

#include <algorithm>

namespace fieldtrue::acquisition {
namespace {

constexpr int kTick_ms = 2;
constexpr double kLate_s = 0.6;

}  // namespace

EmulatorRunner::EmulatorRunner(std::unique_ptr<EmulatedTracker> tracker, std::unique_ptr<EmulatorEndpoint> endpoint,
                               EmulatorFaults faults, TrackerClock clock, QObject* parent)
    : QObject(parent),
      tracker_(std::move(tracker)),
      endpoint_(endpoint.release()),
      faults_(faults),
      clock_(std::move(clock)) {
  endpoint_->setParent(this);
  timer_.setParent(this);
  timer_.setTimerType(Qt::PreciseTimer);
  connect(&timer_, &QTimer::timeout, this, &EmulatorRunner::tick);
  connect(endpoint_, &EmulatorEndpoint::received, this, &EmulatorRunner::receive);
  connect(endpoint_, &EmulatorEndpoint::notice, this, &EmulatorRunner::notice);
  connect(endpoint_, &EmulatorEndpoint::hostCame, this, [this] {
    tracker_->hostCame(time_s());
    if (tracker_->streaming() && !timer_.isActive()) timer_.start(kTick_ms);
  });
}

Result<void> EmulatorRunner::start() {
  if (auto opened = endpoint_->open(); !opened) return opened;
  clock_.start();
  if (tracker_->streaming()) timer_.start(kTick_ms);
  return {};
}

void EmulatorRunner::receive(const QByteArray& bytes) {
  emit bytesFromHost(bytes);
  if (faults_.silence || unplugged_) return;
  if (faults_.wrong_baud) {
    std::string noise(static_cast<std::size_t>(bytes.size()) * 12, '\xFF');
    for (char& c : noise) c = random_() % 5 == 0 ? '\xFE' : c;
    transmit(noise);
    return;
  }
  if (faults_.garbage_at_open && !std::exchange(greeted_, true)) sendGarbage();
  std::vector<EmulatedOutput> out;
  tracker_->receive({bytes.constData(), static_cast<std::size_t>(bytes.size())}, time_s(), out);
  deliver(out);
  if (tracker_->streaming() && !timer_.isActive()) timer_.start(kTick_ms);
}

void EmulatorRunner::sendGarbage() {
  constexpr std::size_t kBytes = 200;
  std::string garbage(kBytes, '\0');
  for (char& c : garbage) c = static_cast<char>(random_() & 0xFF);
  transmit(garbage);
}

void EmulatorRunner::tick() {
  if (unplugged_) return;
  const double now_s = time_s();
  while (!late_.empty() && late_.front().due_s <= now_s) {
    transmit(late_.front().bytes);
    late_.pop_front();
  }
  std::vector<EmulatedOutput> out;
  const bool more = !faults_.silence && !faults_.wrong_baud && tracker_->tick(now_s, out);
  deliver(out);
  if (unplugged_ || (!tracker_->streaming() && late_.empty())) {
    timer_.stop();
  } else if (const int interval_ms = more ? 0 : kTick_ms; timer_.interval() != interval_ms) {
    timer_.start(interval_ms);
  }
}

void EmulatorRunner::deliver(std::vector<EmulatedOutput>& out) {
  for (auto& piece : out) {
    if (unplugged_) return;
    if (faults_.slow_reply && !piece.record) {
      late_.push_back({time_s() + kLate_s * clock_.speed(), std::move(piece.bytes)});
      if (!timer_.isActive()) timer_.start(kTick_ms);
      continue;
    }
    transmit(piece.bytes);
    if (!piece.record) continue;
    ++records_sent_;
    if (faults_.unplug_after > 0 && records_sent_ >= faults_.unplug_after) unplug();
  }
}

void EmulatorRunner::transmit(const std::string& bytes) {
  constexpr unsigned kOneLostIn = 400;
  QByteArray sent;
  sent.reserve(static_cast<qsizetype>(bytes.size()));
  for (const char c : bytes) {
    if (!faults_.lost_bytes || random_() % kOneLostIn != 0) sent.append(c);
  }
  emit bytesToHost(sent);
  if (!faults_.split_writes) return endpoint_->send(sent);
  while (!sent.isEmpty()) {
    const auto piece = std::min<qsizetype>(sent.size(), 1 + static_cast<qsizetype>(random_() % 7));
    endpoint_->send(sent.first(piece));
    sent.remove(0, piece);
  }
}

void EmulatorRunner::unplug() {
  if (std::exchange(unplugged_, true)) return;
  timer_.stop();
  endpoint_->unplug();
  emit unplugged();
}

}  // namespace fieldtrue::acquisition
