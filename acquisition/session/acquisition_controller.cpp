#include "acquisition/session/acquisition_controller.h"

#include "acquisition/devices/registry.h"
#include "acquisition/session/acquisition_impl.h"

namespace fieldtrue {

namespace {

constexpr int kSilenceCheck_ms = 250;

}  // namespace

AcquisitionController::Impl::Impl(AcquisitionController* controller, SamplerOptions sampler_options)
    : owner(controller),
      options(sampler_options),
      sampler(sampler_options),
      silence_timer(controller),
      status_timer(controller) {
  status_timer.setSingleShot(true);
  QObject::connect(&status_timer, &QTimer::timeout, controller, [this] { emitStatus(); });
  silence_timer.setInterval(kSilenceCheck_ms);
  QObject::connect(&silence_timer, &QTimer::timeout, controller, [this] { checkSilence(); });
}

AcquisitionController::Impl::~Impl() {
  if (!device) return;
  QObject::disconnect(device.get(), nullptr, owner, nullptr);
  device->stop();
}

AcquisitionController::AcquisitionController(SamplerOptions options, QObject* parent)
    : QObject(parent), impl_(std::make_unique<Impl>(this, options)) {}

AcquisitionController::~AcquisitionController() = default;

void AcquisitionController::adoptDevice(std::unique_ptr<TrackerDevice> device, const Pose& reference_from_tracker) {
  impl_->adopt(std::move(device), reference_from_tracker);
}

AcquisitionStatus AcquisitionController::status() const { return impl_->status(); }

void AcquisitionController::connectDevice(const QString& device, const QString& scene_path) {
  Scene scene;
  if (!scene_path.isEmpty()) {
    auto read = readScene(scene_path.toStdString());
    if (!read) {
      emit failed(QString::fromStdString(read.error().message));
      return;
    }
    scene = *std::move(read);
  }
  auto made = makeDevice(device.toStdString(), scene);
  if (!made) {
    emit failed(QString::fromStdString(made.error().message));
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
  } else if (impl_->device_state != DeviceState::kRunning) {
    emit takeFailed(QStringLiteral("The tracker is not connected; connect it and take again."));
  } else if (!impl_->current) {
    emit takeFailed(QStringLiteral("All places are done; choose one to retake it."));
  } else {
    impl_->startTake();
  }
}

void AcquisitionController::cancelTake() {
  impl_->failure.clear();
  impl_->stopTake();
  impl_->changed();
}

void AcquisitionController::skip() {
  if (!impl_->store || !impl_->current) return;
  impl_->failure.clear();
  impl_->stopTake();
  const std::size_t place = *impl_->current;
  if (const auto skipped = impl_->store->skip(place, "skipped by the operator"); !skipped) {
    emit failed(QString::fromStdString(skipped.error().message));
    return;
  }
  impl_->reloadPlace(place);
  impl_->goOn();
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
  impl_->reloadPlace(**place);
  impl_->setCurrent(**place);
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
  impl_->reloadPlace(**place);
  impl_->goOn();
}

void AcquisitionController::goTo(int place) {
  if (!impl_->store || place >= static_cast<int>(impl_->states.size())) return;
  impl_->failure.clear();
  impl_->stopTake();
  impl_->setCurrent(place < 0 ? impl_->store->nextPlace() : static_cast<std::size_t>(place));
}

void AcquisitionController::setAutomatic(bool automatic) {
  if (impl_->automatic == automatic) return;
  impl_->automatic = automatic;
  if (!impl_->stand.hasTaken()) impl_->stand.forget();
  impl_->failure.clear();
  impl_->waiting_since_s.reset();
  impl_->changed();
}

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
  if (const auto kept = impl_->store->setState(key.toStdString(), value.toStdString()); !kept) {
    emit failed(QString::fromStdString(kept.error().message));
  }
}

void AcquisitionController::storeFit(const QString& name, const QString& ftcal_text) {
  if (!impl_->store) return;
  if (const auto kept = impl_->store->storeFit(name.toStdString(), ftcal_text.toStdString()); !kept) {
    emit failed(QString::fromStdString(kept.error().message));
  }
}

void AcquisitionController::requestTables() {
  if (impl_->store) emit tablesReady(impl_->store->nodeTable(), impl_->store->sampleTable());
}

}  // namespace fieldtrue
