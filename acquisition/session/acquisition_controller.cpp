#include "acquisition/session/acquisition_controller.h"

#include "acquisition/devices/registry.h"
#include "acquisition/session/acquisition_impl.h"
#include "acquisition/session/guarded_call.h"

namespace fieldtrue::acquisition {

AcquisitionController::Impl::Impl(AcquisitionController* controller, const SamplerOptions& options)
    : owner(controller),
      tracker(controller),
      places(store),
      usual_length(options.length),
      take(options),
      views(controller) {
  const auto at = [this](const QTimer& timer, auto call) {
    QObject::connect(&timer, &QTimer::timeout, owner, [this, call] { guarded(*owner, call); });
  };
  at(views.status_timer, [this] {
    views.since_status.start();
    emit owner->statusChanged(status());
  });
  at(tracker.silence_timer, [this] { checkSilence(); });
  at(tracker.retry_timer, [this] {
    if (tracker.device) tracker.device->start();
  });
}

AcquisitionController::AcquisitionController(SamplerOptions options, QObject* parent)
    : QObject(parent), impl_(std::make_unique<Impl>(this, options)) {}

AcquisitionController::~AcquisitionController() = default;

void AcquisitionController::setWallClock(std::function<QDateTime()> now) { impl_->now = std::move(now); }

void AcquisitionController::adoptDevice(std::unique_ptr<TrackerDevice> device, const Pose& reference_from_tracker) {
  impl_->adopt(std::move(device), reference_from_tracker);
}

AcquisitionStatus AcquisitionController::status() const { return impl_->status(); }

std::optional<Trace> AcquisitionController::trace() const { return impl_->tracker.trace(); }

void AcquisitionController::requestSignal() {
  emit signalReady(
      {impl_->heard.sensors(), impl_->tracker.device ? impl_->tracker.device->describe() : TableMetadata{}});
}

void AcquisitionController::requestTrace() {
  if (auto last = trace()) {
    emit traceReady(std::make_shared<const Trace>(*std::move(last)));
  } else {
    emit failed(QStringLiteral("There are no bytes to save: no tracker on a line has been connected."));
  }
}

void AcquisitionController::connectDevice(const QString& device, const QString& scene_path) {
  const Result<simulation::Scene> scene =
      scene_path.isEmpty() ? simulation::Scene() : simulation::readScene(scene_path.toStdString());
  auto made = scene ? makeDevice(device.toStdString(), *scene) : tl::unexpected(scene.error());
  if (made) {
    impl_->adopt(*std::move(made), scene->reference_from_tracker);
  } else {
    emit deviceFailed(QString::fromStdString(made.error().message));
  }
}

void AcquisitionController::disconnectDevice() {
  impl_->dropDevice();
  impl_->views.tellSoon();
}

void AcquisitionController::openSession(const QString& path, const QString& create_plan_json,
                                        const std::optional<TakeLength>& length) {
  impl_->open(path, create_plan_json, length);
}

void AcquisitionController::closeSession() { impl_->close(); }

void AcquisitionController::take() {
  if (impl_->take.runs()) return;
  impl_->take.times_again = 0;
  impl_->take.not_stored = false;
  if (!impl_->store) {
    emit takeFailed(QStringLiteral("There is no session to record into; make a plan or open a session first."));
  } else if (impl_->store->isReadOnly()) {
    emit takeFailed(
        QStringLiteral("Nothing can be stored: the session's file cannot be written to. Copy it to a folder "
                       "that can be written to, and open it there."));
  } else if (!impl_->tracker.running()) {
    emit takeFailed(QStringLiteral("The tracker is not connected; connect it and take again."));
  } else if (!impl_->places.current) {
    emit takeFailed(QStringLiteral("All places are done; choose one to retake it."));
  } else if (!impl_->other_names.empty()) {
    impl_->failTake(impl_->other_names);
  } else if (const auto silent = impl_->tracker.silentSensors(); !silent.empty()) {
    impl_->failTake(silentText(silent));
  } else if (const auto off_m = impl_->places.tooFar_m(impl_->tracker.live);
             off_m && !impl_->take.isRefusedAt(impl_->places.current)) {
    impl_->refuse(*off_m);
  } else {
    impl_->take.start(impl_->tracker.sensors, off_m.has_value());
    impl_->views.tellSoon();
  }
}

void AcquisitionController::cancelTake() {
  const bool runs = impl_->take.runs();
  const bool has_something_to_stop = runs || !impl_->take.failure.isEmpty();
  impl_->take.forgetFailure();
  impl_->stopTake();
  if (runs) impl_->take.stayStopped(impl_->tracker.live);
  if (!has_something_to_stop && impl_->places.isRetake()) impl_->setCurrent(impl_->places.next());
  impl_->views.tellSoon();
}

void AcquisitionController::keepTake() {
  if (impl_->take.held() && impl_->take.sampler.canKeep()) impl_->keepTake();
}

void AcquisitionController::waitLonger() {
  if (impl_->take.held()) impl_->waitLonger();
}

void AcquisitionController::takeAgain() {
  if (impl_->take.held()) impl_->takeAgain();
}

void AcquisitionController::skip() {
  if (impl_->store && impl_->places.current) impl_->skip("skipped by the operator");
}

void AcquisitionController::undo() {
  if (!impl_->places.can_undo) return;
  if (impl_->take.runs()) return cancelTake();
  if (const auto place = impl_->step(&SessionStore::undo)) impl_->setCurrent(*place);
}

void AcquisitionController::redo() {
  if (impl_->places.can_redo && impl_->step(&SessionStore::redo)) impl_->advance();
}

void AcquisitionController::goTo(int place) {
  if (!impl_->store || place >= static_cast<int>(impl_->places.states.size())) return;
  impl_->take.forgetFailure();
  impl_->stopTake();
  impl_->setCurrent(place < 0 ? impl_->places.next() : static_cast<std::size_t>(place));
}

void AcquisitionController::setAutomatic(bool automatic) {
  if (impl_->take.automatic == automatic) return;
  impl_->take.automatic = automatic;
  if (!impl_->take.stand.hasTaken()) impl_->take.stand.forget();
  impl_->take.forgetFailure();
  impl_->take.waiting_since_s.reset();
  impl_->views.tellSoon();
}

void AcquisitionController::setSensors(const std::vector<int>& sensors) { impl_->chooseSensors(sensors); }

void AcquisitionController::setReconnects(bool reconnects) { impl_->tracker.reconnects = reconnects; }

void AcquisitionController::setSetup(const Setup& stated) { impl_->correctSetup(stated); }

void AcquisitionController::setSetupOfTracker(const Setup& stated) { impl_->setSetupOfTracker(stated); }

void AcquisitionController::setTakeLength(const TakeLength& length) {
  if (!impl_->store) return;
  if (impl_->keepTakeLength(length)) {
    impl_->useTakeLength(length);
  } else {
    emit takeLengthKnown(impl_->take.options.length);
  }
}

void AcquisitionController::setAtTimeLimit(AtTimeLimit at_time_limit) {
  impl_->take.at_time_limit = at_time_limit;
  impl_->take.options.holds_at_time_limit = at_time_limit != AtTimeLimit::kUsual;
}

void AcquisitionController::setSessionState(const QString& key, const QString& value) {
  if (impl_->store) impl_->told(impl_->store->setState(key.toStdString(), value.toStdString()));
}

void AcquisitionController::storeFit(const QString& name, const QString& ftcal_text) {
  if (impl_->store) emit fitStored(impl_->told(impl_->store->storeFit(name.toStdString(), ftcal_text.toStdString())));
}

void AcquisitionController::requestTables() {
  if (!impl_->store) return;
  const auto table = impl_->store->nodeTable();
  const auto samples = table ? impl_->store->sampleTable() : tl::unexpected(table.error());
  if (impl_->told(samples)) emit tablesReady(*table, *samples);
}

}  // namespace fieldtrue::acquisition
