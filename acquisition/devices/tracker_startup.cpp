#include "acquisition/devices/tracker_startup.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "acquisition/devices/line_address.h"

namespace fieldtrue::acquisition {
namespace {

constexpr int kTries = 3;
constexpr int kRateReply_ms = 400;

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

StreamPlan madeStream(Result<StreamPlan> plan) {
  FT_CHECK(plan.has_value());
  return std::move(*plan);
}

TrackerStartup::TrackerStartup(Transport& line, LineSetup setup, QObject* parent)
    : QObject(parent), line_(line), exchange_(line, this), setup_(std::move(setup)) {
  identity_.baud = setup_.baud;
  connect(&exchange_, &LineExchange::bytesSeen, this, &TrackerStartup::bytesSeen);
}

QString TrackerStartup::name() const { return QString::fromStdString(setup_.name); }
QString TrackerStartup::where() const { return QString::fromStdString(setup_.where); }

void TrackerStartup::greet(Greeting greeting, Heard then) {
  greeting_ = std::move(greeting);
  answered_ = std::move(then);
  stopStream();
}

void TrackerStartup::stopStream() {
  const LineTimings& t = setup_.timings;
  exchange_.tell(greeting_.stop, t.settle_ms, [this, &t](const std::string&) {
    exchange_.drain(t.quiet_ms, t.drain_most_ms, [this, &t](const std::string&) {
      exchange_.tell(greeting_.clear, t.clear_ms, [this](const std::string&) { ask(kTries); });
    });
  });
}

void TrackerStartup::ask(int tries) {
  const int most_ms = next_rate_ > 0 ? std::min(kRateReply_ms, setup_.timings.reply_ms) : setup_.timings.reply_ms;
  exchange_.ask(greeting_.ask, greeting_.answered, most_ms, [this, tries](const std::string& heard) {
    // A copy: what it calls may ask again.
    if (const Heard then = answered_; greeting_.answered(heard)) return then(heard);
    // Something came: the answer was damaged, or the rate is wrong. Nothing came: asking again rarely helps.
    const int left = heard.empty() ? std::min(tries - 1, 1) : tries - 1;
    left > 0 && next_rate_ == 0 ? ask(left) : noAnswer();
  });
}

void TrackerStartup::noAnswer() {
  if (rates_known_) return tryNextRate();
  giveUp();
}

void TrackerStartup::tryNextRate() {
  while (next_rate_ < greeting_.rates.size()) {
    const int rate = greeting_.rates[next_rate_++];
    if (rate == setup_.baud) continue;
    if (!line_.setBaud(rate)) break;
    identity_.baud = rate;
    emit progressed(QString("No %1 answered at %2 baud; trying %3.").arg(name()).arg(setup_.baud).arg(rate));
    exchange_.tell(greeting_.clear, setup_.timings.clear_ms, [this](const std::string&) { ask(1); });
    return;
  }
  rates_known_ = false;
  next_rate_ = 0;
  identity_.baud = setup_.baud;
  line_.setBaud(setup_.baud);
  giveUp();
}

void TrackerStartup::giveUp() {
  if (exchange_.bytesHeard() > 0) {
    const int other = setup_.baud == 19200 ? 115200 : 19200;
    const QString shown = QString::fromStdString(firstBytes(exchange_.lastHeard()));
    const QString switches = QString(
                                 "the line's rate is probably wrong; try %1 (%2@%1), and check the rate switches at "
                                 "the back of the tracker")
                                 .arg(other)
                                 .arg(QString::fromStdString(setup_.device_text));
    emit failed(QString("Got bytes that are not %1 records on %2%3: %4")
                    .arg(name(), where(), shown.isEmpty() ? QString() : " (" + shown + ")",
                         greeting_.unreadable.isEmpty() ? switches : greeting_.unreadable));
    return;
  }
  if (setup_.may_reset && !greeting_.reset.empty() && !was_reset_) return reset();
  emit failed(QString("No answer from a %1 on %2: check that it is switched on, that the cable is a null-modem cable "
                      "in the right socket, and that %3 %4")
                  .arg(name(), where(), greeting_.rate_switches)
                  .arg(setup_.baud));
}

void TrackerStartup::reset() {
  was_reset_ = true;
  emit progressed(QString("No answer; restarting the tracker, which takes up to %1 s.")
                      .arg((setup_.timings.reset_ms + 999) / 1000));
  exchange_.tell(greeting_.reset, setup_.timings.reset_ms, [this](const std::string&) { stopStream(); });
}

void TrackerStartup::perform(std::vector<LineStep> steps, std::function<void()> then) {
  steps_ = std::move(steps);
  after_steps_ = std::move(then);
  step(0);
}

void TrackerStartup::step(std::size_t next) {
  if (next >= steps_.size()) {
    // A copy: what it calls may begin other steps.
    const auto then = after_steps_;
    return then();
  }
  const LineStep& now = steps_[next];
  const auto go_on = [this, next](const std::string& heard) {
    // A copy: what it calls may begin other steps.
    const auto look = steps_[next].heard;
    if (!look || look(heard)) step(next + 1);
  };
  if (now.complete) return exchange_.ask(now.say, now.complete, now.wait_ms, go_on);
  exchange_.tell(now.say, now.wait_ms, go_on);
}

void TrackerStartup::askFirmly(const std::string& ask, std::function<bool(const std::string&)> complete, Heard then) {
  firm_ = {ask, setup_.timings.reply_ms, std::move(complete), {}};
  answered_ = std::move(then);
  askOnce(kTries);
}

void TrackerStartup::askOnce(int tries) {
  exchange_.ask(firm_.say, firm_.complete, firm_.wait_ms, [this, tries](const std::string& heard) {
    // A copy: what it calls may ask again.
    if (const Heard then = answered_; firm_.complete(heard)) return then(heard);
    if (tries > 1) return askOnce(tries - 1);
    emit failed(
        QString("The %1 on %2 stopped answering while it was set up; switch it off and on again").arg(name(), where()));
  });
}

void TrackerStartup::finish() {
  // Nothing may be read here any more: what follows are records.
  disconnect(&line_, nullptr, &exchange_, nullptr);
  emit finished();
}

void TrackerStartup::failNothingPluggedIn(const std::vector<int>& wanted) {
  emit failed(QString("The %1 on %2 answers but has no receiver plugged in%3; plug one into station 1")
                  .arg(name(), where(),
                       wanted.empty() ? QString() : " at station " + QString::fromStdString(stationsText(wanted))));
}

void TrackerStartup::failIsAnother(const QString& name, const QString& id) {
  const QString line = QString::fromStdString(setup_.device_text).section(':', 1);
  emit failed(QString("The tracker on %1 is %2: write %3:%4").arg(where(), name, id, line));
}

void TrackerStartup::failNotTaken(const QString& setting) {
  emit failed(QString("The %1 on %2 did not take the setting \"%3\"; switch it off and on again")
                  .arg(name(), where(), setting));
}

}  // namespace fieldtrue::acquisition
