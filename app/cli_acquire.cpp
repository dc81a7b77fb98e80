#include <unistd.h>

#include <QCoreApplication>
#include <QFile>
#include <QFileInfo>
#include <QSocketNotifier>
#include <QTimer>
#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "acquisition/devices/registry.h"
#include "acquisition/devices/trace_file.h"
#include "acquisition/plan/place_state.h"
#include "acquisition/plan/plan.h"
#include "acquisition/session/acquisition_controller.h"
#include "acquisition/session/recorded_sensors.h"
#include "app/cli.h"
#include "app/cli_acquire_sensors.h"
#include "app/cli_acquire_trace.h"
#include "app/cli_live_line.h"
#include "app/cli_signals.h"
#include "app/cli_values.h"
#include "calib/core/json_text.h"
#include "calib/core/number_text.h"
#include "calib/tables/table_sensors.h"
#include "widgets/report/numbers.h"

/// acquire: records a plan with a tracker, place by place, into a session file.
namespace fieldtrue::cli {
namespace {

constexpr int kTakesBeforeSkipping = 3;
constexpr const char* kHeldKeys = "Enter waits longer, a takes again";  ///< Where there is nothing to keep.
constexpr int kPlaceCheck_ms = 2000;
constexpr double kReconnect_s = 300.0;  ///< Where nothing is said.

struct AcquireOptions {
  std::string device;
  std::string scene;
  std::string plan;
  std::string session;
  std::optional<int> samples_per_node;
  std::string until;          ///< When a take is complete, where not by that.
  std::string at_time_limit;  ///< What becomes of a take whose time is over, where not the usual.
  bool automatic = false;
  std::string sensors;                ///< Those recorded, as readSensors reads them.
  std::optional<double> reconnect_s;  ///< For so long a tracker that was lost is waited for.
  std::string trace;                  ///< Where the bytes of the tracker's line are written; empty = nowhere.
  std::vector<std::string> setup;
};

std::string placeText(const PlannedPlace& place) {
  const Eigen::Vector3d& p_m = place.reference_from_sensor.position_m;
  return placeName(place) + "  (" + fixedText(p_m.x(), 2) + " m, " + fixedText(p_m.y(), 2) + " m, " +
         fixedText(p_m.z(), 2) + " m)";
}

double sd_mm(const Node& node) { return node.covariance_m2 ? 1000.0 * std::sqrt(node.covariance_m2->trace()) : NAN; }

bool holdsNothing(const QString& session_path) {
  const auto session = acquisition::SessionStore::open(session_path);
  if (!session) return false;
  const auto table = session->nodeTable();
  const auto newest_s = session->newestSample_s();
  return table && table->nodes.empty() && newest_s && !*newest_s;
}

/// One acquisition on the event loop: prints what happens, reads what the operator types, and knows when it is over.
class Acquisition {
 public:
  Acquisition(const AcquireOptions& options, const CommonOptions& common)
      : options_(options), lines_(common.json ? std::cerr : std::cout), controller_({}, nullptr) {
    connectSignals();
  }

  /// @param length none = the session's own
  void setTakes(const std::optional<acquisition::TakeLength>& length, acquisition::AtTimeLimit at_time_limit) {
    take_length_ = length;
    controller_.setAtTimeLimit(at_time_limit);
    asks_ = at_time_limit == acquisition::AtTimeLimit::kAsk;
  }

  Outcome run(const QString& plan_json, const Setup& setup, const std::vector<int>& sensors) {
    const EndRequest end_request([this] { end("stopped"); });
    controller_.setSetup(setup);
    controller_.openSession(QString::fromStdString(options_.session), plan_json);
    if (failure_) return tl::unexpected(*failure_);
    if (controller_.status().session->read_only) return notPossible(remarks_.front());
    for (const std::string& remark : remarks_) tell(remark);
    is_open_ = true;
    if (const auto other = otherPlan(); !other.empty()) return notPossible(other);
    controller_.setAutomatic(options_.automatic);
    if (const auto others = otherSensors(sensors); !others.empty()) return notPossible(others);
    chooseSensors(sensors);
    if (take_length_) controller_.setTakeLength(*take_length_);
    controller_.setReconnects(patience_s() > 0.0);
    controller_.connectDevice(QString::fromStdString(options_.device), QString::fromStdString(options_.scene));
    if (!options_.automatic || asks_) listenToOperator();
    watchTracesPlace();
    if (!over_) QCoreApplication::exec();
    writeTraceOfLine();
    controller_.disconnectDevice();
    controller_.closeSession();
    live_line_.clear();
    if (!failure_) return answer();
    if (!plan_json.isEmpty()) removeIfEmpty();
    if (QFileInfo::exists(QString::fromStdString(options_.session)))
      lines_ << "What was read stays in " << options_.session << std::endl;
    return tl::unexpected(*failure_);
  }

  /// Whatever ended the recording: its faults are what a trace is for.
  void writeTraceOfLine() {
    const auto trace = options_.trace.empty() ? std::nullopt : controller_.trace();
    if (!trace) return;
    live_line_.clear();
    if (const auto written = acquisition::writeTrace(options_.trace, *trace); !written) {
      if (!failure_) failure_ = Failure{kNotPossible, written.error().message};
      return;
    }
    lines_ << "The line's last " << trace->bytes.size() << " bytes are in " << options_.trace << std::endl;
  }

  /// The plan that was asked for; a session that is resumed must have been made with it.
  void expectPlan(nlohmann::json plan) { expected_plan_ = std::move(plan); }

 private:
  void connectSignals() {
    const auto connect = [this](auto signal, auto slot) {
      QObject::connect(&controller_, signal, &context_, [this, slot](auto&&... values) { (this->*slot)(values...); });
    };
    connect(&acquisition::AcquisitionController::statusChanged, &Acquisition::onStatus);
    connect(&acquisition::AcquisitionController::nodesStored, &Acquisition::onStored);
    connect(&acquisition::AcquisitionController::takeFailed, &Acquisition::onTakeFailed);
    connect(&acquisition::AcquisitionController::takeHeld, &Acquisition::onTakeHeld);
    connect(&acquisition::AcquisitionController::takeRefused, &Acquisition::onTakeRefused);
    connect(&acquisition::AcquisitionController::deviceFailed, &Acquisition::onDeviceFailed);
    connect(&acquisition::AcquisitionController::deviceBack, &Acquisition::onDeviceBack);
    connect(&acquisition::AcquisitionController::sessionOpened, &Acquisition::onOpened);
    connect(&acquisition::AcquisitionController::failed, &Acquisition::onFailed);
    connect(&acquisition::AcquisitionController::finished, &Acquisition::onFinished);
    connect(&acquisition::AcquisitionController::remarked, &Acquisition::onRemark);
  }

  void onOpened(const QString&, const QString&, const QString& plan_json) { session_plan_ = plan_json.toStdString(); }

  std::string otherPlan() const {
    if (!expected_plan_) return {};
    if (const auto plan = parseJson(session_plan_, options_.session); plan && *plan == *expected_plan_) return {};
    return options_.session +
           " was recorded with another plan; leave --plan out to resume it, or name a new session file";
  }

  double patience_s() const { return options_.reconnect_s.value_or(kReconnect_s); }

  /// Why the sensors that were asked for cannot go on with the session; empty when they can.
  std::string otherSensors(const std::vector<int>& asked) const {
    const std::vector<int> of_session = controller_.status().of_session;
    if (of_session.empty() || acquisition::areAmong(asked, of_session)) return {};
    return notTheSessionsText(options_.session, of_session, asked);
  }

  /// Whether the leading sensor may be left out is known when the tracker runs: only where it is dead.
  void chooseSensors(const std::vector<int>& asked) {
    const std::vector<int> recorded = recordedSensors(controller_.status());
    const bool is_resumed = controller_.status().takes_settle_sensors;
    if (is_resumed && !asked.empty() && !acquisition::isAmong(recorded.front(), asked)) {
      without_leader_ = asked;
      return;
    }
    if (!options_.sensors.empty()) controller_.setSensors(asked);
    if (is_resumed && !asked.empty() && asked.front() != recorded.front()) tell(leaderStaysText(recorded, asked));
  }

  /// @return whether it is sure what is recorded
  bool leaderIsSettled() {
    if (without_leader_.empty()) return true;
    const int leader = recordedSensors(status_).front();
    if (acquisition::isAmong(leader, status_.reporting)) {
      fail(notTheSessionsText(options_.session, status_.of_session, without_leader_,
                              "sensor " + std::to_string(leader) + " leads and reports"));
    } else if (acquisition::isAmong(leader, status_.missing)) {
      controller_.setSensors(std::exchange(without_leader_, {}));
    }
    return false;
  }

  /// Which of several sensors are recorded, whenever that changes.
  void tellSensors() {
    const std::vector<int> recorded = recordedSensors(status_);
    const bool is_news = recorded != told_sensors_ && !recorded.empty() && status_.reporting.size() > 1;
    if (!is_news || !acquisition::areAmong(recorded, status_.reporting)) return;
    told_sensors_ = recorded;
    tell(recordingText(recorded, status_.reporting.size()));
  }

  /// One of several that is silent is waited for as a tracker that is lost.
  void tellSilent() {
    const std::vector<int> silent = silentSensors(status_);
    if (silent == silent_) return;
    silent_ = silent;
    patience_.reset();
    if (silent.empty()) return tell("Every recorded sensor reports again");
    const std::string what = acquisition::silentText(silent);
    tell(what + "; nothing is taken without");
    beginPatience(what + "; nothing came");
  }

  /// A sensor that was asked for and is not there; empty where each is.
  std::string notThere() const {
    if (options_.sensors.empty() || status_.missing.empty() || status_.takes_settle_sensors) return {};
    return "--sensor " + options_.sensors + ": the tracker sends only " + sensorsText(status_.reporting);
  }

  /// Who asked for a sensor that is not there is not left to wait for it, but where --reconnect says for how long.
  void endWhereOneIsMissing() {
    const std::string why = notThere();
    if (!why.empty() && options_.reconnect_s.value_or(0.0) == 0.0) fail(why);
  }

  void onStatus(const acquisition::AcquisitionStatus& status) {
    const auto before = status_.current;
    const std::vector<acquisition::PlaceMisfit> misfits = status_.recorded->misfits;
    status_ = status;
    tellMisfits(misfits);
    if (status.reconnecting) return;
    if (status.device == acquisition::DeviceState::kFailed) {
      fail(status.device_text.toStdString());
      return;
    }
    if (status.device == acquisition::DeviceState::kClosed && told_start_ && !over_) {
      fail(status.device_text.toStdString());
      return;
    }
    if (status.device != acquisition::DeviceState::kRunning) return;
    if (!leaderIsSettled()) return;
    if (!told_start_) tellStart();
    tellSensors();
    endWhereOneIsMissing();
    tellSilent();
    live_line_.show(status);
    const bool takes =
        status.take == acquisition::TakeState::kCollecting || status.take == acquisition::TakeState::kHeld;
    if (options_.automatic || !status.current || takes) return;
    if (before != status.current || !prompted_) prompt();
  }

  void tellStart() {
    told_start_ = true;
    const std::size_t n_there = status_.recorded->n_done + status_.recorded->n_skipped;
    if (n_there > 0) {
      lines_ << "Resuming: " << status_.recorded->n_done << " of " << status_.session->places.size() << " done, "
             << status_.recorded->n_skipped << " skipped" << std::endl;
    }
    if (!status_.current) onFinished();
    if (enter_waits_) controller_.take();
  }

  void prompt() {
    prompted_ = true;
    live_line_.clear();
    lines_ << "Next: " << placeText(status_.session->places.at(*status_.current))
           << "   Enter takes, s skips, u takes back, q quits" << std::endl;
  }

  void onStored(int place, const std::vector<Node>& nodes, const QString& suspicious) {
    const auto index = static_cast<std::size_t>(place);
    const acquisition::AcquisitionStatus now = controller_.status();
    failed_takes_.erase(index);
    live_line_.clear();
    lines_ << placeText(now.session->places.at(index)) << "  done " << now.recorded->n_done << " of "
           << now.session->places.size();
    for (const Node& node : nodes) {
      if (nodes.size() > 1) lines_ << ", sensor " << node.sensor;
      lines_ << ", SD " << widgets::errorFigure(sd_mm(node)) << " mm, " << node.n_used << " samples worth "
             << fixedText(node.n_effective, 0);
      if (node.n_rejected > 0) lines_ << ", " << node.n_rejected << " rejected";
    }
    if (!suspicious.isEmpty()) lines_ << "  SUSPICIOUS: " << suspicious.toStdString();
    lines_ << std::endl;
  }

  /// A disk that fills while places are taken is told when it does, not at the end of the day.
  void watchTracesPlace() {
    if (options_.trace.empty()) return;
    QObject::connect(&place_timer_, &QTimer::timeout, &context_, [this] { tellNoPlace(); });
    place_timer_.start(kPlaceCheck_ms);
  }

  void tellNoPlace() {
    if (told_no_place_) return;
    const std::string why = noPlaceFor(options_.trace);
    told_no_place_ = !why.empty();
    if (told_no_place_) tell(why);
  }

  void onTakeHeld(int place, const QString& reason, bool can_keep) {
    live_line_.clear();
    lines_ << "Time is up at " << placeName(status_.session->places.at(static_cast<std::size_t>(place))) << ": "
           << reason.toStdString() << ".   " << (can_keep ? "Enter keeps it, w waits longer, a takes again" : kHeldKeys)
           << ", s skips, q quits" << std::endl;
    if (!hears_) answerAlone();
  }

  /// Nobody is there to be asked.
  void answerAlone() {
    const acquisition::AcquisitionStatus now = controller_.status();
    if (now.take != acquisition::TakeState::kHeld) return;
    if (now.can_keep) return controller_.keepTake();
    controller_.skip();
  }

  void onTakeRefused(int place, double off_m) {
    live_line_.clear();
    std::cerr << "Not taken: the sensor is " << fixedText(off_m, 2) << " m away from "
              << placeName(status_.session->places.at(static_cast<std::size_t>(place)))
              << "; carry it there, or press Enter again to take it here all the same" << std::endl;
    prompted_ = true;
  }

  void tellMisfits(const std::vector<acquisition::PlaceMisfit>& before) {
    for (const acquisition::PlaceMisfit& misfit : status_.recorded->misfits) {
      if (std::find(before.begin(), before.end(), misfit) != before.end()) continue;
      live_line_.clear();
      lines_ << placeName(status_.session->places.at(misfit.place))
             << " does not fit the others: " << fixedText(misfit.off_m, 2) << " m off" << std::endl;
    }
  }

  void onTakeFailed(const QString& reason, int) {
    const acquisition::AcquisitionStatus now = controller_.status();
    // What cannot be stored would wait for a person, and by itself there may be none.
    if (options_.automatic && now.not_stored) return fail(reason.toStdString());
    live_line_.clear();
    std::cerr << "Not taken: " << reason.toStdString() << std::endl;
    prompted_ = false;
    if (!options_.automatic || !now.current || ++failed_takes_[*now.current] < kTakesBeforeSkipping) return;
    std::cerr << placeText(now.session->places.at(*now.current)) << "  skipped after " << kTakesBeforeSkipping
              << " takes without success" << std::endl;
    failed_takes_.erase(*now.current);
    controller_.skip();
  }

  void onRemark(const QString& message, acquisition::RemarkKind kind) {
    if (kind == acquisition::RemarkKind::kOtherSensors) return fail(message.toStdString());
    remarks_.push_back(message.toStdString());
    if (is_open_) tell(remarks_.back());
  }

  void tell(const std::string& remark) {
    live_line_.clear();
    std::cerr << "note: " << remark << std::endl;
  }

  void onFailed(const QString& message) { fail(message.toStdString()); }

  void onDeviceFailed(const QString& message) {
    if (!controller_.status().reconnecting) return onFailed(message);
    live_line_.clear();
    std::cerr << "Tracker lost - reconnecting: " << message.toStdString() << std::endl;
    beginPatience(message.toStdString() + "; it did not come back");
  }

  void beginPatience(const std::string& what) {
    patience_ = std::make_unique<QTimer>();
    patience_->setSingleShot(true);
    const std::string within = " within " + fixedText(patience_s(), 0) + " s (--reconnect)";
    QObject::connect(patience_.get(), &QTimer::timeout, &context_, [this, what, within] {
      const std::string not_there = notThere();
      fail((not_there.empty() ? what : not_there) + within);
    });
    patience_->start(static_cast<int>(1000.0 * patience_s()));
  }

  void onDeviceBack() {
    patience_.reset();
    std::cerr << "Tracker is back: " << controller_.status().device_text.toStdString() << std::endl;
    prompted_ = false;
  }

  void onFinished() { end("finished"); }

  void fail(const std::string& message) {
    if (!failure_) failure_ = Failure{kNotPossible, message};
    end("failed");
  }

  void end(const std::string& how) {
    if (over_) return;
    over_ = true;
    how_ = how;
    QCoreApplication::quit();
  }

  void listenToOperator() {
    input_ = std::make_unique<QSocketNotifier>(STDIN_FILENO, QSocketNotifier::Read);
    QObject::connect(input_.get(), &QSocketNotifier::activated, &context_, [this] { readInput(); });
  }

  void readInput() {
    std::array<char, 256> bytes{};
    const ssize_t n = ::read(STDIN_FILENO, bytes.data(), bytes.size());
    if (n <= 0) return onInputEnded();
    typed_.append(bytes.data(), static_cast<std::size_t>(n));
    for (auto line_end = typed_.find('\n'); line_end != std::string::npos && !over_; line_end = typed_.find('\n')) {
      const std::string command = typed_.substr(0, line_end);
      typed_.erase(0, line_end + 1);
      obey(command);
    }
  }

  /// By itself the recording goes on without an operator.
  void onInputEnded() {
    input_->setEnabled(false);
    hears_ = false;
    if (!options_.automatic) return end("stopped");
    answerAlone();
  }

  /// Pressed before the tracker runs.
  void keepEnter() {
    if (!std::exchange(enter_waits_, true))
      lines_ << "Kept: the place is taken as soon as the tracker runs" << std::endl;
  }

  void obey(const std::string& command) {
    prompted_ = false;
    if (controller_.status().take == acquisition::TakeState::kHeld && decide(command)) return;
    if (command.empty() && options_.automatic) return;
    if (command.empty()) return told_start_ ? controller_.take() : keepEnter();
    if (command == "s") return controller_.skip();
    if (command == "u") return controller_.undo();
    if (command == "q") return end("stopped");
    lines_ << "'" << command << "' is not known: Enter takes, s skips, u takes back, q quits" << std::endl;
  }

  /// What becomes of a take whose time is over. @return whether the command said so
  bool decide(const std::string& command) {
    const bool can_keep = controller_.status().can_keep;
    if (command == "w" || (command.empty() && !can_keep)) {
      controller_.waitLonger();
    } else if (command == "a") {
      controller_.takeAgain();
    } else if (command.empty()) {
      controller_.keepTake();
    } else {
      return false;
    }
    return true;
  }

  /// A session that was made for a tracker that never answered would only be in the way.
  void removeIfEmpty() const {
    const QString path = QString::fromStdString(options_.session);
    if (holdsNothing(path)) QFile::remove(path);
  }

  /// Tells what the file holds, not what was seen on the way.
  Outcome answer() const {
    const auto session = acquisition::SessionStore::open(QString::fromStdString(options_.session));
    if (!session) return notPossible(session.error());
    const auto states = session->states();
    if (!states) return notPossible(states.error());
    const auto table = session->nodeTable();
    if (!table) return notPossible(table.error());
    const auto count = [&states](acquisition::PlaceState state) {
      return std::count(states->begin(), states->end(), state);
    };
    const auto n_skipped = count(acquisition::PlaceState::kSkipped);
    const auto n_suspicious = count(acquisition::PlaceState::kSuspicious);
    const auto n_done = count(acquisition::PlaceState::kDone) + n_suspicious;
    Answer answer;
    answer.json = {{"session", options_.session}, {"ended", how_},
                   {"places", states->size()},    {"done", n_done},
                   {"skipped", n_skipped},        {"suspicious", n_suspicious},
                   {"sensors", sensorsOf(*table)}};
    answer.text = (how_ == "finished" ? "Finished: " : "Stopped: ") + std::to_string(n_done) + " of " +
                  std::to_string(states->size()) + " places done, " + std::to_string(n_skipped) + " skipped, all in " +
                  options_.session + "\n";
    if (how_ != "finished") answer.text += "The same command resumes it.\n";
    return answer;
  }

  AcquireOptions options_;
  std::ostream& lines_;
  QObject context_;
  acquisition::AcquisitionController controller_;
  acquisition::AcquisitionStatus status_;
  std::unique_ptr<QSocketNotifier> input_;
  std::unique_ptr<QTimer> patience_;  ///< While a tracker that was lost, or a silent sensor, is waited for.
  std::vector<int> silent_;           ///< Sensors that were told of.
  std::vector<int> without_leader_;   ///< Asked for, and not settled until it is known whether the leading one is dead.
  std::string typed_;
  std::vector<int> told_sensors_;
  std::string session_plan_;
  std::vector<std::string> remarks_;  ///< On how the session was opened, and on what it is recorded with.
  bool is_open_ = false;
  std::optional<nlohmann::json> expected_plan_;
  std::optional<acquisition::TakeLength> take_length_;
  std::map<std::size_t, int> failed_takes_;
  LiveLine live_line_;
  QTimer place_timer_;
  std::optional<Failure> failure_;
  std::string how_;
  bool asks_ = false;  ///< What becomes of a take whose time is over.
  bool hears_ = true;  ///< The operator may type.
  bool told_start_ = false;
  bool enter_waits_ = false;
  bool told_no_place_ = false;
  bool prompted_ = false;
  bool over_ = false;
};

/// Nothing at all is no way to say all of them.
CLI::Validator someSensors() {
  return CLI::Validator(
      [](std::string& text) {
        return text.empty() ? std::string("'' names no sensors: all, 0 or 0+2 (numbers up to 1000) do") : std::string();
      },
      "");
}

/// As it was asked for; none where nothing was said.
Result<std::optional<acquisition::TakeLength>> takeLengthOf(const AcquireOptions& options) {
  std::optional<acquisition::TakeLength> length;
  if (!options.until.empty()) {
    FT_TRY(length, acquisition::readTakeLength(options.until));
  } else if (options.samples_per_node) {
    FT_TRY(length, acquisition::readTakeLength(std::to_string(*options.samples_per_node)));
  }
  return length;
}

Outcome runAcquire(const AcquireOptions& options, const CommonOptions& common) {
  const auto scene = readSceneArgument(options.scene);
  if (!scene) return tl::unexpected(scene.error());
  // Made only to see that its text can be read, before a session file is made; it is not started.
  const auto device = acquisition::makeDevice(options.device, *scene);
  if (!device) return wrongUsage(device.error());
  if (const auto why = noTraceOf(**device, options.device, options.trace); !why.empty()) return wrongUsage(why);
  const auto setup = readSetupArgument(options.setup);
  if (!setup) return tl::unexpected(setup.error());
  const auto length = takeLengthOf(options);
  if (!length) return wrongUsage("--until: " + length.error().message);
  const auto at_time_limit = options.at_time_limit.empty() ? Result<acquisition::AtTimeLimit>()
                                                           : acquisition::readAtTimeLimit(options.at_time_limit);
  if (!at_time_limit) return wrongUsage("--at-timeout: " + at_time_limit.error().message);
  const auto sensors = acquisition::readSensors(options.sensors);
  if (!sensors) return wrongUsage("--sensor: " + sensors.error().message);
  const bool resumes = QFileInfo::exists(QString::fromStdString(options.session));
  if (!resumes && options.plan.empty()) {
    return wrongUsage(options.session + " does not exist yet; a new session needs --plan");
  }
  QString create_plan_json;
  std::optional<nlohmann::json> plan_json;
  if (!options.plan.empty()) {
    const auto plan = readPlanArgument(options.plan);
    if (!plan) return tl::unexpected(plan.error());
    plan_json = toJson(*plan);
    if (!resumes) create_plan_json = QString::fromStdString(plan_json->dump());
  }
  Acquisition acquisition(options, common);
  if (resumes && plan_json) acquisition.expectPlan(*plan_json);
  acquisition.setTakes(*length, *at_time_limit);
  return acquisition.run(create_plan_json, *setup, *sensors);
}

}  // namespace

void addAcquireCommand(CommandLine& line) {
  auto [command, options] = line.add("acquire", "Record a plan with a tracker into a session file", runAcquire);
  addDeviceOptions(*command, options->device, options->scene);
  command->add_option("--plan", options->plan, "grid:... or a *.plan.json; not needed to resume a session")
      ->type_name("PLAN");
  auto* samples = command
                      ->add_option("--samples-per-node", options->samples_per_node,
                                   "Good samples at each place (default 60; of a session that is resumed, its own)")
                      ->type_name("N")
                      ->check(CLI::Range(1, 100000));
  command
      ->add_option("--until", options->until,
                   "When a take is complete, instead: after a time (2.5s), or when its mean is known so well (0.05mm)")
      ->type_name("LENGTH")
      ->excludes(samples);
  command
      ->add_option(
          "--at-timeout", options->at_time_limit,
          "What becomes of a take that is not complete within its time: keep what it has, take it again (up to "
          "twice), skip its place, or ask; default: keep a mean that is known, though less well than --until "
          "asks, and let any other take fail")
      ->type_name("keep|again|skip|ask");
  addSetupOption(*command, options->setup, "What the tracker does not tell of itself");
  command
      ->add_option("--sensor", options->sensors,
                   "Record these of several sensors: 0, or 0+2 of which the first leads; default all that report. A "
                   "session that is resumed goes on without those of its own that are not named")
      ->type_name("N[+N]|all")
      ->check(someSensors());
  command->add_flag("--auto", options->automatic, "Take by itself whenever the sensor stands still at its place");
  command
      ->add_option("--reconnect", options->reconnect_s,
                   "Wait so long for a tracker that is lost to come back (default 300), and for a sensor that --sensor "
                   "names; 0 = end at once")
      ->type_name("S")
      ->check(numberWithin(0.0, 1e6));
  command->add_option("--trace", options->trace, "Writes the last bytes of the tracker's line (*.trace.zip) at the end")
      ->type_name("FILE");
  command->add_option("--session", options->session, "Session file (*.fieldtrue); made new, or resumed if it exists")
      ->type_name("FILE")
      ->required();
}

}  // namespace fieldtrue::cli
