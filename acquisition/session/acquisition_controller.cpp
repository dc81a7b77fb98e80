#include "acquisition/session/acquisition_controller.h"

#include "acquisition/devices/registry.h"
#include "acquisition/session/acquisition_impl.h"
#include "acquisition/session/guarded_call.h"

namespace fieldtrue::acquisition {

namespace {

constexpr int kSilenceCheck_ms = 250;

}  // namespace

AcquisitionController::Impl::Impl(AcquisitionController* controller, SamplerOptions sampler_options)
    : owner(controller),
      options(sampler_options),
      sampler(sampler_options),
      silence_timer(controller),
      retry_timer(controller),
      status_timer(controller) {
  status_timer.setSingleShot(true);
  QObject::connect(&status_timer, &QTimer::timeout, controller, [this] { guarded(*owner, [this] { emitStatus(); }); });
  silence_timer.setInterval(kSilenceCheck_ms);
  QObject::connect(&silence_timer, &QTimer::timeout, controller,
                   [this] { guarded(*owner, [this] { checkSilence(); }); });
  retry_timer.setSingleShot(true);
  QObject::connect(&retry_timer, &QTimer::timeout, controller, [this] {
    guarded(*owner, [this] {
      if (device) device->start();
    });
  });
}

AcquisitionController::Impl::~Impl() {
  if (!device) return;
  QObject::disconnect(device.get(), nullptr, owner, nullptr);
  device->stop();
}

AcquisitionController::AcquisitionController(SamplerOptions options, QObject* parent)
    : QObject(parent), impl_(std::make_unique<Impl>(this, options)) {}

AcquisitionController::~AcquisitionController() = default;

void AcquisitionController::setWallClock(std::function<QDateTime()> now) { impl_->now = std::move(now); }

void AcquisitionController::adoptDevice(std::unique_ptr<TrackerDevice> device, const Pose& reference_from_tracker) {
  impl_->adopt(std::move(device), reference_from_tracker);
}

AcquisitionStatus AcquisitionController::status() const { return impl_->status(); }

void AcquisitionController::connectDevice(const QString& device, const QString& scene_path) {
  simulation::Scene scene;
  if (!scene_path.isEmpty()) {
    auto read = simulation::readScene(scene_path.toStdString());
    if (!read) {
      emit deviceFailed(QString::fromStdString(read.error().message));
      return;
    }
    scene = *std::move(read);
  }
  auto made = makeDevice(device.toStdString(), scene);
  if (!made) {
    emit deviceFailed(QString::fromStdString(made.error().message));
    return;
  }
  impl_->adopt(*std::move(made), scene.reference_from_tracker);
}

void AcquisitionController::disconnectDevice() {
  impl_->dropDevice();
  impl_->changed();
}

void AcquisitionController::openSession(const QString& path, const QString& create_plan_json) {
  impl_->open(path, create_plan_json);
}

void AcquisitionController::closeSession() { impl_->close(); }

void AcquisitionController::take() {
  if (impl_->collecting()) return;
  if (!impl_->store) {
    emit takeFailed(QStringLiteral("There is no session to record into; make a plan or open a session first."));
  } else if (impl_->store->isReadOnly()) {
    emit takeFailed(
        QStringLiteral("Nothing can be stored: the session's file cannot be written to. Copy it to a folder "
                       "that can be written to, and open it there."));
  } else if (impl_->device_state != DeviceState::kRunning) {
    emit takeFailed(QStringLiteral("The tracker is not connected; connect it and take again."));
  } else if (!impl_->current) {
    emit takeFailed(QStringLiteral("All places are done; choose one to retake it."));
  } else if (const auto off_m = impl_->tooFar_m(); off_m && !impl_->isRefused()) {
    impl_->refuse(*off_m);
  } else {
    impl_->startTake();
    impl_->taken_away = off_m.has_value();
  }
}

void AcquisitionController::cancelTake() {
  impl_->failure.clear();
  impl_->refused_at.reset();
  impl_->stopTake();
  impl_->changed();
}

void AcquisitionController::skip() {
  if (!impl_->store || !impl_->current) return;
  impl_->failure.clear();
  impl_->stopTake();
  const std::size_t place = *impl_->current;
  if (!impl_->told(impl_->store->skip(place, "skipped by the operator"))) return;
  if (impl_->told(impl_->reloadPlace(place))) impl_->goOn();
}

void AcquisitionController::undo() {
  if (!impl_->store) return;
  impl_->failure.clear();
  impl_->stopTake();
  const auto place = impl_->store->undo();
  if (!place) {
    emit failed(QString::fromStdString(place.error().message));
    return;
  }
  if (!*place) return;
  if (impl_->told(impl_->reloadPlace(**place))) impl_->setCurrent(**place);
}

void AcquisitionController::redo() {
  if (!impl_->store) return;
  impl_->failure.clear();
  impl_->stopTake();
  const auto place = impl_->store->redo();
  if (!place) {
    emit failed(QString::fromStdString(place.error().message));
    return;
  }
  if (!*place) return;
  if (impl_->told(impl_->reloadPlace(**place))) impl_->goOn();
}

void AcquisitionController::goTo(int place) {
  if (!impl_->store || place >= static_cast<int>(impl_->states.size())) return;
  impl_->failure.clear();
  impl_->stopTake();
  impl_->setCurrent(place < 0 ? impl_->nextPlace() : static_cast<std::size_t>(place));
}

void AcquisitionController::setAutomatic(bool automatic) {
  if (impl_->automatic == automatic) return;
  impl_->automatic = automatic;
  if (!impl_->stand.hasTaken()) impl_->stand.forget();
  impl_->failure.clear();
  impl_->waiting_since_s.reset();
  impl_->changed();
}

void AcquisitionController::setReconnects(bool reconnects) { impl_->reconnects = reconnects; }

void AcquisitionController::setSamplesPerNode(int count) {
  if (count < 1 || count > 100000) {
    emit failed(QStringLiteral("Samples per place must be 1 to 100000, got %1.").arg(count));
    return;
  }
  impl_->options.samples_per_node = count;
  if (!impl_->collecting()) impl_->sampler = NodeSampler(impl_->options);
  impl_->changed();
}

void AcquisitionController::setSessionState(const QString& key, const QString& value) {
  if (!impl_->store) return;
  impl_->told(impl_->store->setState(key.toStdString(), value.toStdString()));
}

void AcquisitionController::storeFit(const QString& name, const QString& ftcal_text) {
  if (!impl_->store) return;
  impl_->told(impl_->store->storeFit(name.toStdString(), ftcal_text.toStdString()));
}

void AcquisitionController::requestTables() {
  if (!impl_->store) return;
  const auto table = impl_->store->nodeTable();
  const auto samples = table ? impl_->store->sampleTable() : tl::unexpected(table.error());
  if (samples) {
    emit tablesReady(*table, *samples);
  } else {
    emit failed(QString::fromStdString(samples.error().message));
  }
}

}  // namespace fieldtrue::acquisition
