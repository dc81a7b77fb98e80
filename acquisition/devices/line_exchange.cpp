#include "acquisition/devices/line_exchange.h"

#include <algorithm>
#include <utility>

namespace fieldtrue::acquisition {

LineExchange::LineExchange(Transport& line, QObject* parent) : QObject(parent), line_(line) {
  timer_.setParent(this);
  timer_.setSingleShot(true);
  connect(&timer_, &QTimer::timeout, this, &LineExchange::finish);
  connect(&line_, &QIODevice::readyRead, this, &LineExchange::readReady);
}

void LineExchange::tell(const std::string& bytes, int pause_ms, Then then) { begin(bytes, pause_ms, std::move(then)); }

void LineExchange::drain(int quiet_ms, int most_ms, Then then) {
  begin({}, std::min(quiet_ms, most_ms), std::move(then));
  quiet_ms_ = quiet_ms;
  most_ms_ = most_ms;
}

void LineExchange::ask(const std::string& bytes, std::function<bool(const std::string&)> complete, int most_ms,
                       Then then) {
  begin(bytes, most_ms, std::move(then));
  complete_ = std::move(complete);
}

void LineExchange::begin(const std::string& bytes, int wait_ms, Then then) {
  then_ = std::move(then);
  complete_ = {};
  quiet_ms_ = 0;
  heard_.clear();
  step_.start();
  timer_.start(wait_ms);
  if (bytes.empty()) return;
  const QByteArray sent = QByteArray::fromStdString(bytes);
  line_.write(sent);
  emit bytesSeen(true, sent);
}

void LineExchange::readReady() {
  const QByteArray bytes = line_.readAll();
  if (bytes.isEmpty()) return;
  bytes_heard_ += static_cast<std::uint64_t>(bytes.size());
  emit bytesSeen(false, bytes);
  heard_.append(bytes.constData(), static_cast<std::size_t>(bytes.size()));
  if (complete_ && complete_(heard_)) return finish();
  if (quiet_ms_ > 0 && timer_.isActive()) {
    timer_.start(std::clamp<int>(most_ms_ - static_cast<int>(step_.elapsed()), 0, quiet_ms_));
  }
}

void LineExchange::finish() {
  timer_.stop();
  complete_ = {};
  quiet_ms_ = 0;
  last_heard_ = std::exchange(heard_, {});
  if (const Then then = std::exchange(then_, {})) then(last_heard_);
}

}  // namespace fieldtrue::acquisition
