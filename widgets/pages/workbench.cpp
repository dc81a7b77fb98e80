#include "widgets/pages/workbench.h"

#include <QDateTime>
#include <QDir>
#include <QFile>
#include <QFileInfo>
#include <QSettings>
#include <QStandardPaths>
#include <algorithm>
#include <array>

#include "widgets/pages/background.h"
#include "widgets/pages/fitted_methods.h"
#include "widgets/report/thread_pool.h"

namespace fieldtrue {
namespace {

struct StepName {
  Step step;
  const char* id;
};
constexpr std::array<StepName, 7> kStepNames{{{Step::kStart, "start"},
                                              {Step::kConnect, "connect"},
                                              {Step::kPlan, "plan"},
                                              {Step::kAcquire, "acquire"},
                                              {Step::kCompare, "compare"},
                                              {Step::kGap, "gap"},
                                              {Step::kExport, "export"}}};

constexpr int kRecentSessions = 6;

}  // namespace

QString stepId(Step step) { return QLatin1String(kStepNames[static_cast<std::size_t>(step)].id); }

std::optional<Step> stepFromId(const QString& id) {
  for (const StepName& name : kStepNames)
    if (id == QLatin1String(name.id)) return name.step;
  return std::nullopt;
}

Workbench::Workbench(QObject* parent) : QObject(parent) {
  qRegisterMetaType<AcquisitionStatus>();
  qRegisterMetaType<Node>();
  qRegisterMetaType<CalibrationTable>();
  qRegisterMetaType<SampleTable>();
  qRegisterMetaType<DeviceState>();
  controller_ = new AcquisitionController;
  controller_->moveToThread(&thread_);
  connect(&thread_, &QThread::finished, controller_, &QObject::deleteLater);
  wireController();
  thread_.setObjectName(QStringLiteral("acquisition"));
  thread_.start();
}

Workbench::~Workbench() {
  emit closing();
  fit_stop_.request_stop();
  comparison_stop_.request_stop();
  QMetaObject::invokeMethod(controller_, &AcquisitionController::closeSession, Qt::BlockingQueuedConnection);
  QMetaObject::invokeMethod(controller_, &AcquisitionController::disconnectDevice, Qt::BlockingQueuedConnection);
  thread_.quit();
  thread_.wait();
  QThreadPool::globalInstance()->waitForDone();
}

template <class... Arguments, class... Given>
void Workbench::post(void (AcquisitionController::*slot)(Arguments...), Given&&... given) {
  QMetaObject::invokeMethod(
      controller_, [this, slot, ... values = std::decay_t<Given>(given)] { (controller_->*slot)(values...); },
      Qt::QueuedConnection);
}

void Workbench::wireController() {
  connect(controller_, &AcquisitionController::statusChanged, this, &Workbench::onStatus);
  connect(controller_, &AcquisitionController::tablesReady, this, &Workbench::onTables);
  connect(controller_, &AcquisitionController::sessionOpened, this, &Workbench::onSessionOpened);
  connect(controller_, &AcquisitionController::fitOpened, this, &Workbench::onFitOpened);
  connect(controller_, &AcquisitionController::nodeStored, this,
          [this](int place, const Node& node, const QString& suspicious) {
            emit nodeStored(place, node, suspicious);
            if (!suspicious.isEmpty())
              showMessage({tr("Stored, but look at it: %1").arg(suspicious), Severity::kAttention, tr("Retake it"),
                           [this, place] { goTo(place); }});
          });
  connect(controller_, &AcquisitionController::takeFailed, this, [this](const QString& reason) {
    showMessage({reason, Severity::kAttention, {}, {}});
  });
  connect(controller_, &AcquisitionController::finished, this, [this] {
    post(&AcquisitionController::requestTables);
    showMessage(
        {tr("Every place is done."), Severity::kInfo, tr("Compare the methods"), [this] { goToStep(Step::kCompare); }});
  });
  connect(controller_, &AcquisitionController::failed, this, [this](const QString& message) {
    showMessage({message, Severity::kDanger, {}, {}});
  });
}

void Workbench::onStatus(const AcquisitionStatus& status) {
  const bool counts_changed = status.n_done != status_.n_done || status.n_skipped != status_.n_skipped;
  const bool connected = status.device == DeviceState::kRunning && status_.device != DeviceState::kRunning;
  status_ = status;
  if (connected && start_when_connected_) {
    start_when_connected_ = false;
    setAutomatic(true);
  }
  emit statusChanged(status_);
  if (counts_changed && sessionIsOpen()) post(&AcquisitionController::requestTables);
}

void Workbench::onTables(const CalibrationTable& table, const SampleTable& samples) {
  table_ = table;
  samples_ = samples;
  emit tableChanged();
}

void Workbench::onSessionOpened(const QString& path, const QString& page, const QString& plan_json) {
  stopComparing();
  session_path_ = path;
  table_ = {};
  samples_ = {};
  comparison_.reset();
  corrector_.reset();
  const auto plan = planFromJson(nlohmann::json::parse(plan_json.toStdString(), nullptr, false), path.toStdString());
  plan_ = plan ? *plan : Plan{};
  rememberSession(path);
  emit sessionChanged();
  emit comparisonChanged();
  emit correctorChanged();
  post(&AcquisitionController::requestTables);
  emit stepRequested(stepFromId(page).value_or(Step::kAcquire));
}

void Workbench::onFitOpened(const QString& ftcal_text) {
  Result<Corrector> loaded = Corrector::fromText(ftcal_text.toStdString(), session_path_.toStdString());
  if (!loaded) {
    showMessage({QString::fromStdString(loaded.error().message), Severity::kAttention, {}, {}});
    return;
  }
  corrector_ = std::move(*loaded);
  emit correctorChanged();
}

bool Workbench::correctorIsCurrent() const {
  if (!corrector_) return false;
  const auto same = [](const Node& a, const Node& b) {
    return a.node == b.node && a.sensor == b.sensor && a.visit == b.visit &&
           a.tracker_from_sensor.position_m == b.tracker_from_sensor.position_m;
  };
  const std::vector<Node> now = fitRows(table_);
  const std::vector<Node>& then = corrector_->table().nodes;
  return std::equal(now.begin(), now.end(), then.begin(), then.end(), same);
}

void Workbench::rememberSession(const QString& path) {
  QSettings settings;
  QStringList recent = settings.value(QStringLiteral("recent")).toStringList();
  recent.removeAll(path);
  recent.prepend(path);
  settings.setValue(QStringLiteral("recent"), QStringList(recent.mid(0, kRecentSessions)));
}

void Workbench::startDemonstration() {
  start_when_connected_ = true;
  connectDevice(QStringLiteral("simulated:speed=3,travel_s=1"), builtInScene(QStringLiteral("steel_floor")));
  Plan plan;
  createSession(freshSessionPath(QStringLiteral("demonstration")), plan, 60);
}

void Workbench::connectDevice(const QString& device, const QString& scene_path) {
  post(&AcquisitionController::connectDevice, device, scene_path);
}

void Workbench::disconnectDevice() { post(&AcquisitionController::disconnectDevice); }

void Workbench::createSession(const QString& path, const Plan& plan, int samples_per_node) {
  post(&AcquisitionController::setSamplesPerNode, samples_per_node);
  post(&AcquisitionController::openSession, path, QString::fromStdString(toJson(plan).dump()));
}

void Workbench::openSession(const QString& path) { post(&AcquisitionController::openSession, path, QString()); }

void Workbench::take() { post(&AcquisitionController::take); }
void Workbench::cancelTake() { post(&AcquisitionController::cancelTake); }
void Workbench::skip() { post(&AcquisitionController::skip); }
void Workbench::undo() { post(&AcquisitionController::undo); }
void Workbench::redo() { post(&AcquisitionController::redo); }
void Workbench::goTo(int place) { post(&AcquisitionController::goTo, place); }
void Workbench::setAutomatic(bool automatic) { post(&AcquisitionController::setAutomatic, automatic); }

void Workbench::compare(const ComparisonOptions& options) {
  stopComparing();
  comparison_stop_ = std::stop_source();
  comparing_ = true;
  const int run = ++comparison_run_;
  RunControl control;
  control.parallel_for = threadedFor(0);
  control.stop = comparison_stop_.get_token();
  control.progress = [this, run](double fraction) {
    QMetaObject::invokeMethod(
        this,
        [this, run, fraction] {
          if (run == comparison_run_) emit comparisonProgress(fraction);
        },
        Qt::QueuedConnection);
  };
  emit comparisonChanged();
  runInBackground(
      this, [table = table_, options, control] { return compareMethods(table, options, control); },
      [this, run](Result<Comparison> result) {
        if (run != comparison_run_) return;
        comparing_ = false;
        if (result) {
          comparison_ = std::move(*result);
        } else if (result.error().code != ErrorCode::kCancelled) {
          comparison_.reset();
          showMessage({QString::fromStdString(result.error().message), Severity::kAttention, {}, {}});
        }
        emit comparisonChanged();
      });
}

void Workbench::stopComparing() {
  if (!comparing_) return;
  comparison_stop_.request_stop();
  ++comparison_run_;
  comparing_ = false;
  emit comparisonChanged();
}

void Workbench::fit(const CorrectorChoice& choice, AlignMode align) {
  if (fitting_) return;
  fitting_ = true;
  emit fittingChanged();
  RunControl control;
  control.parallel_for = threadedFor(0);
  control.stop = fit_stop_.get_token();
  runInBackground(
      this,
      [table = table_, choice, align, control] {
        return Corrector::fit(fitRows(table), table.metadata, choice, align, control);
      },
      [this](Result<Corrector> result) {
        fitting_ = false;
        emit fittingChanged();
        if (!result) {
          showMessage({QString::fromStdString(result.error().message), Severity::kAttention, {}, {}});
          return;
        }
        corrector_ = std::move(*result);
        const CorrectorChoice& fitted = corrector_->choice();
        post(&AcquisitionController::storeFit,
             QString::fromStdString(fitted.position_id + " + " + fitted.orientation_id),
             QString::fromStdString(corrector_->toText()));
        emit correctorChanged();
      });
}

void Workbench::goToStep(Step step) {
  if (sessionIsOpen()) post(&AcquisitionController::setSessionState, QStringLiteral("page"), stepId(step));
  emit stepRequested(step);
}

void Workbench::showMessage(Message message) { emit messageShown(message); }

QString Workbench::sessionFolder() {
  const QString folder =
      QStandardPaths::writableLocation(QStandardPaths::AppDataLocation) + QStringLiteral("/sessions");
  QDir().mkpath(folder);
  return folder;
}

QString Workbench::freshSessionPath(const QString& stem) {
  const QString stamp = QDateTime::currentDateTime().toString(QStringLiteral("yyyy-MM-dd-HHmmss"));
  QString path = QStringLiteral("%1/%2-%3.fieldtrue").arg(sessionFolder(), stem, stamp);
  for (int n = 2; QFileInfo::exists(path); ++n)
    path = QStringLiteral("%1/%2-%3-%4.fieldtrue").arg(sessionFolder(), stem, stamp).arg(n);
  return path;
}

QString Workbench::builtInScene(const QString& name) {
  const QString path = QStringLiteral("%1/%2.scene.json").arg(sessionFolder(), name);
  QFile::remove(path);
  QFile::copy(QStringLiteral(":/scenes/%1.scene.json").arg(name), path);
  QFile::setPermissions(path, QFile::ReadOwner | QFile::WriteOwner);
  return path;
}

}  // namespace fieldtrue
