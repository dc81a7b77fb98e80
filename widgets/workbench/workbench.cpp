#include "widgets/workbench/workbench.h"

#include <QDateTime>
#include <QDesktopServices>
#include <QDir>
#include <QFile>
#include <QFileInfo>
#include <QSettings>
#include <QStandardPaths>
#include <QUrl>
#include <algorithm>
#include <array>
#include <utility>

#include "acquisition/devices/trace_file.h"
#include "acquisition/plan/place_state.h"
#include "acquisition/session/guarded_call.h"
#include "calib/calibration/alignment.h"
#include "calib/core/json_text.h"
#include "calib/core/thread_pool.h"
#include "calib/evaluation/sensor_splits.h"
#include "calib/tables/table_sensors.h"
#include "widgets/style/unit_texts.h"
#include "widgets/workbench/background.h"
#include "widgets/workbench/fitted_methods.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kRecentSessions = 6;

}  // namespace

Workbench::Workbench(QObject* parent) : QObject(parent) {
  qRegisterMetaType<acquisition::AcquisitionStatus>();
  qRegisterMetaType<Node>();
  qRegisterMetaType<CalibrationTable>();
  qRegisterMetaType<SampleTable>();
  qRegisterMetaType<acquisition::DeviceState>();
  table_timer_.setSingleShot(true);
  connect(&table_timer_, &QTimer::timeout, this, &Workbench::tableChanged);
  controller_ = new acquisition::AcquisitionController;
  controller_->setAtTimeLimit(acquisition::AtTimeLimit::kAsk);
  controller_->moveToThread(&thread_);
  connect(&thread_, &QThread::finished, controller_, &QObject::deleteLater);
  wireController();
  thread_.setObjectName(QStringLiteral("acquisition"));
  thread_.start();
}

Workbench::~Workbench() {
  emit closing();
  fit_jobs_.stop();
  comparison_jobs_.stop();
  const auto leave = [this] {
    acquisition::guarded(*controller_, [this] { controller_->closeSession(); });
    acquisition::guarded(*controller_, [this] { controller_->disconnectDevice(); });
  };
  QMetaObject::invokeMethod(controller_, leave, Qt::BlockingQueuedConnection);
  thread_.quit();
  thread_.wait();
  QThreadPool::globalInstance()->waitForDone();
}

template <class... Arguments, class... Given>
void Workbench::post(void (acquisition::AcquisitionController::*slot)(Arguments...), Given&&... given) {
  // g++ 12 builds a lambda that holds a pack by value and is captured by a second one wrongly; hence std::bind_front.
  QMetaObject::invokeMethod(
      controller_,
      [controller = controller_, call = std::bind_front(slot, controller_, std::decay_t<Given>(given)...)] {
        acquisition::guarded(*controller, call);
      },
      Qt::QueuedConnection);
}

template <class... Arguments, class... Given>
void Workbench::postToSession(void (acquisition::AcquisitionController::*slot)(Arguments...), Given&&... given) {
  QMetaObject::invokeMethod(
      controller_,
      [controller = controller_, path = session_path_,
       call = std::bind_front(slot, controller_, std::decay_t<Given>(given)...)] {
        acquisition::guarded(*controller, [&] {
          if (controller->status().session->path == path) call();
        });
      },
      Qt::QueuedConnection);
}

void Workbench::wireController() {
  connect(controller_, &acquisition::AcquisitionController::statusChanged, this, &Workbench::onStatus);
  connect(controller_, &acquisition::AcquisitionController::tablesReady, this, &Workbench::onTables);
  connect(controller_, &acquisition::AcquisitionController::placeChanged, this, &Workbench::onPlace);
  connect(controller_, &acquisition::AcquisitionController::looseKept, this,
          [this](const std::vector<SampleRow>& rows) {
            loose_samples_.insert(loose_samples_.end(), rows.begin(), rows.end());
          });
  connect(controller_, &acquisition::AcquisitionController::metadataChanged, this,
          [this](const TableMetadata& metadata) {
            table_.metadata = metadata;
            changeTable();
          });
  connect(controller_, &acquisition::AcquisitionController::remarked, this, [this](const QString& remark) {
    showMessage({remark, Severity::kAttention, {}, {}, QStringLiteral("session/remark/") + remark});
  });
  connect(controller_, &acquisition::AcquisitionController::sessionOpened, this, &Workbench::onSessionOpened);
  connect(controller_, &acquisition::AcquisitionController::fitOpened, this, &Workbench::onFitOpened);
  connect(controller_, &acquisition::AcquisitionController::gapOpened, this,
          [this](const QString& text) { kept_gap_ = text; });
  connect(controller_, &acquisition::AcquisitionController::fitStored, this, &Workbench::onFitStored);
  connect(controller_, &acquisition::AcquisitionController::takeLengthKnown, this, &Workbench::takeLengthKnown);
  connect(controller_, &acquisition::AcquisitionController::nodesStored, this,
          [this](int place, const std::vector<Node>&, const QString& suspicious) { onNodesStored(place, suspicious); });
  connect(controller_, &acquisition::AcquisitionController::takeFailed, this, &Workbench::onTakeFailed);
  connect(controller_, &acquisition::AcquisitionController::takeRefused, this, &Workbench::onTakeRefused);
  connect(controller_, &acquisition::AcquisitionController::finished, this, [this] {
    showMessage({tr("Every place is done."), Severity::kInfo, tr("Compare the methods"),
                 [this] { goToPage(QStringLiteral("compare")); }, QStringLiteral("session/finished")});
  });
  connect(controller_, &acquisition::AcquisitionController::deviceFailed, this, [this](const QString& text) {
    const bool has_trace = status_.has_trace;
    showMessage({text, Severity::kDanger, has_trace ? tr("Save the line's bytes") : QString(),
                 has_trace ? std::function<void()>([this] { saveTrace(); }) : nullptr, QStringLiteral("device")});
  });
  connect(controller_, &acquisition::AcquisitionController::traceReady, this, &Workbench::onTrace);
  connect(controller_, &acquisition::AcquisitionController::signalReady, this, &Workbench::signalReady);
  connect(controller_, &acquisition::AcquisitionController::deviceBack, this, [this] {
    endCondition(QStringLiteral("device"));
    showMessage({tr("The tracker is back."), Severity::kInfo, {}, {}});
  });
  connect(controller_, &acquisition::AcquisitionController::failed, this, [this](const QString& message) {
    showMessage({message, Severity::kDanger, {}, {}, QStringLiteral("session/failed")});
    if (std::exchange(is_opening_, false)) emit tableChanged();
  });
}

QString Workbench::nameOf(int place) const {
  const auto index = static_cast<std::size_t>(place);
  return place < 0 || index >= status_.session->places.size()
             ? QString()
             : QString::fromStdString(placeName(status_.session->places[index]));
}

void Workbench::onNodesStored(int place, const QString& suspicious) {
  for (const char* kind : {"session/take/%1", "session/look/%1"}) endCondition(QString::fromLatin1(kind).arg(place));
  endCondition(QStringLiteral("session/failed"));
  if (suspicious.isEmpty()) return;
  spoken_of_.insert(place);
  showMessage({tr("%1: stored, but look at it: %2").arg(nameOf(place), suspicious), Severity::kAttention,
               tr("Retake it"), [this, place] { goTo(place); }, QStringLiteral("session/look/%1").arg(place)});
}

void Workbench::onTakeFailed(const QString& reason, int place) {
  if (place >= 0) spoken_of_.insert(place);
  Message message{
      reason, Severity::kAttention, {}, {}, place < 0 ? QString() : QStringLiteral("session/take/%1").arg(place)};
  if (status_.device == acquisition::DeviceState::kClosed) {
    message.action_label = tr("Connect");
    message.action = [this] { goToPage(QStringLiteral("connect")); };
  }
  showMessage(message);
}

void Workbench::onTakeRefused(int place, double off_m) {
  showMessage({tr("%1 is not taken: the sensor is %2 away from it. Carry it there, or press Space again to take it "
                  "here all the same.")
                   .arg(nameOf(place), distanceText(off_m)),
               Severity::kAttention,
               {},
               {},
               QStringLiteral("session/refused")});
}

void Workbench::tellMisfits(const acquisition::AcquisitionStatus& before, const acquisition::AcquisitionStatus& now) {
  const auto has = [](const acquisition::AcquisitionStatus& status, std::size_t place) {
    return std::any_of(status.recorded->misfits.begin(), status.recorded->misfits.end(),
                       [place](const acquisition::PlaceMisfit& misfit) { return misfit.place == place; });
  };
  for (const acquisition::PlaceMisfit& misfit : before.recorded->misfits)
    if (!has(now, misfit.place)) endCondition(QStringLiteral("session/misfit/%1").arg(misfit.place));
  for (const acquisition::PlaceMisfit& misfit : now.recorded->misfits) {
    if (std::find(before.recorded->misfits.begin(), before.recorded->misfits.end(), misfit) !=
        before.recorded->misfits.end())
      continue;
    const int place = static_cast<int>(misfit.place);
    showMessage({tr("%1 does not fit the others: %2 off.").arg(nameOf(place), distanceText(misfit.off_m)),
                 Severity::kAttention, tr("Retake it"), [this, place] { goTo(place); },
                 QStringLiteral("session/misfit/%1").arg(place)});
  }
}

void Workbench::endWhatIsOver(const acquisition::AcquisitionStatus& now) {
  if (now.device != status_.device && now.device != acquisition::DeviceState::kFailed)
    endCondition(QStringLiteral("device"));
  if (!now.refused) endCondition(QStringLiteral("session/refused"));
  if (now.current) endCondition(QStringLiteral("session/finished"));
  if (now.recorded->revision == status_.recorded->revision) return;
  for (auto place = spoken_of_.begin(); place != spoken_of_.end();) {
    const auto index = static_cast<std::size_t>(*place);
    const acquisition::PlaceState state =
        index < now.recorded->states.size() ? now.recorded->states[index] : acquisition::PlaceState::kDone;
    const QString number = QString::number(*place);
    if (state != acquisition::PlaceState::kSuspicious) endCondition(QStringLiteral("session/look/") + number);
    const bool over = state == acquisition::PlaceState::kDone || state == acquisition::PlaceState::kSkipped;
    if (over) endCondition(QStringLiteral("session/take/") + number);
    place = over ? spoken_of_.erase(place) : std::next(place);
  }
}

void Workbench::onStatus(const acquisition::AcquisitionStatus& status) {
  endWhatIsOver(status);
  const acquisition::AcquisitionStatus before = std::exchange(status_, status);
  if (before.recorded->revision != status_.recorded->revision) tellMisfits(before, status_);
  const bool running = status.device == acquisition::DeviceState::kRunning;
  if (running && !demonstration_path_.isEmpty() && status.session->path == demonstration_path_) {
    demonstration_path_.clear();
    setAutomatic(true);
  }
  emit statusChanged(status_);
}

void Workbench::onSessionOpened(const QString& path, const QString& page, const QString& plan_json) {
  if (path == session_path_) {  // It was open all along.
    emit pageRequested(page == QStringLiteral("start") ? QStringLiteral("acquire") : page);
    return;
  }
  stopComparing();
  stopFitting();
  session_path_ = path;
  is_opening_ = true;
  table_ = {};
  table_is_stale_ = false;
  loose_samples_.clear();
  chosen_sensor_.reset();
  uses_any_units_ = false;
  refusal_.clear();
  comparison_.reset();
  corrector_.reset();
  corrector_is_kept_.reset();
  kept_gap_.clear();
  spoken_of_.clear();
  endCondition(QStringLiteral("session"));
  const auto plan = parseJson(plan_json.toStdString(), path.toStdString()).and_then([&](const nlohmann::json& json) {
    return acquisition::planFromJson(json, path.toStdString());
  });
  plan_ = plan ? *plan : acquisition::Plan{};
  places_.clear();
  for (const PlannedPlace& place : places(plan_)) places_.push_back({place.node, place.visit, {}, {}});
  rememberSession(path);
  emit sessionChanged();
  emit comparisonChanged();
  emit correctorChanged();
  post(&acquisition::AcquisitionController::requestTables);
  emit pageRequested(page);
}

void Workbench::onFitOpened(const QString& ftcal_text) {
  Result<calibration::Corrector> loaded =
      calibration::Corrector::fromText(ftcal_text.toStdString(), session_path_.toStdString());
  if (!loaded) {
    showMessage(
        {QString::fromStdString(loaded.error().message), Severity::kAttention, {}, {}, QStringLiteral("session/fit")});
    return;
  }
  corrector_ = std::move(*loaded);
  corrector_is_kept_ = true;
  emit correctorChanged();
}

void Workbench::onFitStored(bool is_stored) {
  if (!corrector_) return;
  corrector_is_kept_ = is_stored;
  emit correctorChanged();
}

bool Workbench::correctorIsCurrent() const {
  if (!corrector_) return false;
  const auto same = [](const Node& a, const Node& b) {
    return a.node == b.node && a.sensor == b.sensor && a.visit == b.visit &&
           a.tracker_from_sensor.position_m == b.tracker_from_sensor.position_m;
  };
  const std::vector<Node>& then = corrector_->table().nodes;
  // Of the sensors that it was fitted to, whichever are shown.
  const std::vector<int> fitted = sensorsOf(then);
  std::vector<Node> now = evaluation::fitRowsOf(recordedTable());
  std::erase_if(now, [&](const Node& node) { return !std::binary_search(fitted.begin(), fitted.end(), node.sensor); });
  return std::equal(now.begin(), now.end(), then.begin(), then.end(), same);
}

bool Workbench::correctorCorrects() const {
  return corrector_ && (corrector_->choice().position_id != "none" || corrector_->choice().orientation_id != "none");
}

void Workbench::rememberSession(const QString& path) {
  QSettings settings;
  // Another folder may be the current one next time.
  const QString whole = QFileInfo(path).absoluteFilePath();
  QStringList recent = settings.value(QStringLiteral("recent")).toStringList();
  recent.removeAll(whole);
  recent.prepend(whole);
  settings.setValue(QStringLiteral("recent"), QStringList(recent.mid(0, kRecentSessions)));
}

void Workbench::startDemonstration() {
  demonstration_path_ = freshSessionPath(QStringLiteral("demonstration"));
  connectDevice(QStringLiteral("simulated:speed=3,travel_s=1"), builtInScene(QStringLiteral("steel_floor")));
  acquisition::Plan plan;
  createSession(demonstration_path_, plan);
}

void Workbench::connectDevice(const QString& device, const QString& scene_path) {
  post(&acquisition::AcquisitionController::connectDevice, device, scene_path);
}

void Workbench::disconnectDevice() { post(&acquisition::AcquisitionController::disconnectDevice); }

void Workbench::requestSignal() { post(&acquisition::AcquisitionController::requestSignal); }

void Workbench::saveTrace() {
  endCondition(QStringLiteral("trace"));
  post(&acquisition::AcquisitionController::requestTrace);
}

void Workbench::onTrace(const std::shared_ptr<const acquisition::Trace>& trace) {
  const QFileInfo beside(session_path_.isEmpty() ? QString() : QFileInfo(session_path_).absolutePath());
  const QString folder = beside.isWritable() ? beside.filePath() : sessionFolder();
  const QString path = freshPath(folder, QString::fromStdString(trace->tracker), QStringLiteral("trace.zip"));
  // Not in the thread of the tracker: to compress 16 MiB takes longer than its line may wait.
  auto write = [trace, path](const RunControl&) { return acquisition::writeTrace(path.toStdString(), *trace); };
  trace_jobs_.run(std::move(write), [this, path, size = trace->bytes.size()](const Result<void>& written) {
    if (!written) {
      const QString why = QString::fromStdString(written.error().message);
      showMessage({tr("The line's bytes are not saved: %1.").arg(why), Severity::kAttention, {}, {}, "trace"});
      return;
    }
    showMessage({tr("The line's last %1 KiB are saved: %2").arg((size + 1023) / 1024).arg(path), Severity::kInfo,
                 tr("Show the folder"),
                 [path] { QDesktopServices::openUrl(QUrl::fromLocalFile(QFileInfo(path).absolutePath())); }, "trace"});
  });
}

void Workbench::setSetup(const Setup& stated) { post(&acquisition::AcquisitionController::setSetup, stated); }

void Workbench::setSetupOfTracker(const Setup& stated) {
  post(&acquisition::AcquisitionController::setSetupOfTracker, stated);
}

void Workbench::createSession(const QString& path, const acquisition::Plan& plan,
                              const acquisition::TakeLength& length) {
  post(&acquisition::AcquisitionController::openSession, path, QString::fromStdString(toJson(plan).dump()), length);
}

void Workbench::openSession(const QString& path) {
  post(&acquisition::AcquisitionController::openSession, path, QString(), std::optional<acquisition::TakeLength>());
}

void Workbench::setTakeLength(const acquisition::TakeLength& length) {
  if (sessionIsOpen()) postToSession(&acquisition::AcquisitionController::setTakeLength, length);
}

void Workbench::take() { post(&acquisition::AcquisitionController::take); }
void Workbench::keepTake() { post(&acquisition::AcquisitionController::keepTake); }
void Workbench::waitLonger() { post(&acquisition::AcquisitionController::waitLonger); }
void Workbench::takeAgain() { post(&acquisition::AcquisitionController::takeAgain); }
void Workbench::setAtTimeLimit(acquisition::AtTimeLimit at_time_limit) {
  post(&acquisition::AcquisitionController::setAtTimeLimit, at_time_limit);
}
void Workbench::cancelTake() { post(&acquisition::AcquisitionController::cancelTake); }
void Workbench::skip() { post(&acquisition::AcquisitionController::skip); }
void Workbench::undo() { post(&acquisition::AcquisitionController::undo); }
void Workbench::redo() { post(&acquisition::AcquisitionController::redo); }
void Workbench::goTo(int place) { post(&acquisition::AcquisitionController::goTo, place); }
void Workbench::setAutomatic(bool automatic) { post(&acquisition::AcquisitionController::setAutomatic, automatic); }
void Workbench::setSensors(const std::vector<int>& sensors) {
  post(&acquisition::AcquisitionController::setSensors, sensors);
}

void Workbench::compare(const evaluation::ComparisonOptions& options, MethodCount count) {
  comparison_jobs_.stop();
  endCondition(QStringLiteral("session/compare"));
  if (!mayUse(table())) {
    comparison_.reset();
    emit comparisonChanged();
    return;
  }
  comparison_jobs_.run([table = table(), options](
                           const RunControl& control) { return evaluation::compareMethods(table, options, control); },
                       [this, count, rows = rows_version_](Result<evaluation::Comparison> result) {
                         if (result) {
                           comparison_ = std::move(*result);
                           compared_ = count;
                           compared_rows_ = rows;
                         } else if (result.error().code != ErrorCode::kCancelled) {
                           comparison_.reset();
                           showMessage({QString::fromStdString(result.error().message),
                                        Severity::kAttention,
                                        {},
                                        {},
                                        QStringLiteral("session/compare")});
                         }
                         emit comparisonChanged();
                       },
                       [this](double fraction) { emit comparisonProgress(fraction); });
  emit comparisonChanged();
}

void Workbench::stopComparing() {
  if (!isComparing()) return;
  comparison_jobs_.stop();
  emit comparisonChanged();
}

void Workbench::fit(const calibration::CorrectorChoice& choice, calibration::AlignMode align) {
  if (isFitting() || !mayUse(table())) return;
  endCondition(QStringLiteral("session/fit"));
  auto work = [table = table(), choice, align](const RunControl& control) {
    return evaluation::fitByEvidence(table, choice, align, control);
  };
  fit_jobs_.run(std::move(work), [this](Result<calibration::Corrector> result) {
    emit fittingChanged();
    if (!result) {
      showMessage({QString::fromStdString(result.error().message),
                   Severity::kAttention,
                   {},
                   {},
                   QStringLiteral("session/fit")});
      return;
    }
    corrector_ = std::move(*result);
    corrector_is_kept_.reset();
    const calibration::CorrectorChoice& fitted = corrector_->choice();
    postToSession(&acquisition::AcquisitionController::storeFit,
                  QString::fromStdString(fitted.position_id + " + " + fitted.orientation_id),
                  QString::fromStdString(corrector_->toText()));
    emit correctorChanged();
  });
  emit fittingChanged();
}

void Workbench::stopFitting() {
  if (!isFitting()) return;
  fit_jobs_.stop();
  emit fittingChanged();
}

void Workbench::goToPage(const QString& page) {
  if (sessionIsOpen())
    postToSession(&acquisition::AcquisitionController::setSessionState, QStringLiteral("page"), page);
  emit pageRequested(page);
}

void Workbench::importFile(const QString& path) {
  goToPage(QStringLiteral("import"));
  emit importRequested(path);
}

void Workbench::compareWith(const QString& calibration) {
  goToPage(QStringLiteral("difference"));
  emit earlierCalibrationChosen(calibration);
}

void Workbench::setGapReport(std::optional<gap::GapReport> report) {
  gap_report_ = std::move(report);
  emit gapReportChanged();
}

void Workbench::keepGap(const QString& text) {
  if (!sessionIsOpen() || text == kept_gap_) return;
  kept_gap_ = text;
  postToSession(&acquisition::AcquisitionController::setSessionState, QStringLiteral("gap"), text);
}

void Workbench::showMessage(const Message& message) { emit messageShown(message); }

QString Workbench::sessionFolder() {
  const QString folder =
      QStandardPaths::writableLocation(QStandardPaths::AppDataLocation) + QStringLiteral("/sessions");
  QDir().mkpath(folder);
  return folder;
}

QString Workbench::freshPath(const QString& folder, const QString& stem, const QString& ending) {
  const QString stamp = QDateTime::currentDateTime().toString(QStringLiteral("yyyy-MM-dd-HHmmss"));
  QString path = QStringLiteral("%1/%2-%3.%4").arg(folder, stem, stamp, ending);
  for (int n = 2; QFileInfo::exists(path); ++n)
    path = QStringLiteral("%1/%2-%3-%4.%5").arg(folder, stem, stamp).arg(n).arg(ending);
  return path;
}

QString Workbench::freshSessionPath(const QString& stem) {
  return freshPath(sessionFolder(), stem, QStringLiteral("fieldtrue"));
}

QString Workbench::builtInScene(const QString& name) {
  const QString path = QStringLiteral("%1/%2.scene.json").arg(sessionFolder(), name);
  QFile::remove(path);
  QFile::copy(QStringLiteral(":/scenes/%1.scene.json").arg(name), path);
  QFile::setPermissions(path, QFile::ReadOwner | QFile::WriteOwner);
  return path;
}

}  // namespace fieldtrue::widgets
