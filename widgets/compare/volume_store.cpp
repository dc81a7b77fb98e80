#include "widgets/compare/volume_store.h"

#include "widgets/style/unit_texts.h"

namespace fieldtrue::widgets {

VolumeStore::VolumeStore(FittedMethods& fitted, QObject* parent) : QObject(parent), fitted_(fitted) {
  connect(&fitted_, &FittedMethods::changed, this, &VolumeStore::changed);
}

void VolumeStore::reset(const CalibrationTable& table, const std::optional<evaluation::Comparison>& comparison) {
  jobs_.stop();
  table_ = table;
  comparison_ = comparison;
  lattice_ = comparison ? latticeAround(table) : VolumeField{};
  ways_held_ = waysHeld(table);
  volumes_.clear();
  why_.clear();
  broken_.clear();
  running_.clear();
}

const VolumeField* VolumeStore::get(const VolumeKey& key) {
  const auto volume = volumes_.find(key);
  if (volume != volumes_.end()) return &volume->second;
  if (!comparison_ || key.quantity == VolumeQuantity::kNone || running_.contains(key) || broken_.contains(key))
    return nullptr;
  QString why;
  if (const Sampling sampling = samplingOf(key, &why)) start(key, sampling);
  why_[key] = why;
  return nullptr;
}

VolumeStore::Sampling VolumeStore::samplingOf(const VolumeKey& key, QString* why) {
  if (key.quantity == VolumeQuantity::kExpectedError && !key.difference)
    return [errors_mm = heldOutErrors_mm(*comparison_, key.a), comparison = *comparison_, table = table_,
            lattice = lattice_](const RunControl& control) {
      return heldOutVolume(comparison, table, errors_mm, lattice, control);
    };
  // Before correction nothing is moved: there is no fit to ask.
  if (!key.a || (key.difference && !key.b)) {
    *why = key.difference ? tr("A volume difference needs two methods; before correction there is nothing to subtract.")
           : key.quantity == VolumeQuantity::kUncertainty ? tr("Before correction no method states an uncertainty.")
                                                          : tr("Before correction nothing is moved.");
    return {};
  }
  const auto a = fitted_.get(*key.a);
  const auto b = key.difference ? fitted_.get(*key.b) : a;
  if (!a || !b) {
    *why = fitted_.why(!a ? *key.a : *key.b);
    return {};
  }
  const Held held = heldOf(key);
  if (key.difference)
    return [a, b, held, lattice = lattice_](const RunControl& control) {
      return differenceVolume(*a, *b, held, lattice, control);
    };
  const auto sampled = key.quantity == VolumeQuantity::kCorrection ? correctionVolume : uncertaintyVolume;
  return
      [a, held, sampled, lattice = lattice_](const RunControl& control) { return sampled(*a, held, lattice, control); };
}

Held VolumeStore::heldOf(const VolumeKey& key) const {
  return key.held == kMeanHeld ? Held() : Held(ways_held_[static_cast<std::size_t>(key.held)]);
}

/// Empty where no correction of a volume looks at how the sensor is held.
QString VolumeStore::turnOf(const VolumeKey& key) const {
  const auto takes = [this](MethodRow row) {
    const auto corrector = row ? fitted_.get(*row) : nullptr;
    return corrector && corrector->takesOrientation();
  };
  if (ways_held_.empty()) return {};
  if (!takes(key.a) && !takes(key.b)) return tr(" It is the same however the sensor is held.");
  return key.held == kMeanHeld ? tr(" Mean over the ways the sensor was held.")
                               : tr(" The sensor turned by %1.").arg(shortTurnText(*heldOf(key)));
}

QString VolumeStore::titleOf(const VolumeKey& key) const {
  const QString a = positionLabel(*comparison_, key.a);
  if (key.difference)
    return tr("Distance between the corrected positions of A, %1, and B, %2.")
               .arg(a, positionLabel(*comparison_, key.b)) +
           turnOf(key);
  switch (key.quantity) {
    case VolumeQuantity::kCorrection:
      return tr("How far %1 moves a reading, beyond the rigid alignment.").arg(a) + turnOf(key);
    case VolumeQuantity::kExpectedError:
      return tr("%1: held-out error, interpolated between the places (local RMS).").arg(a);
    case VolumeQuantity::kUncertainty:
      return tr("SD of the corrected position as %1 states it.").arg(a) + turnOf(key);
    case VolumeQuantity::kNone:
      break;
  }
  return {};
}

QString VolumeStore::text(const VolumeKey& key) const {
  if (!comparison_ || key.quantity == VolumeQuantity::kNone) return {};
  const auto volume = volumes_.find(key);
  if (volume != volumes_.end()) {
    if (volume->second.largest_mm()) return volume->second.title;
    return key.quantity == VolumeQuantity::kUncertainty && !key.difference
               ? tr("%1 does not state its uncertainty.").arg(positionLabel(*comparison_, key.a))
               : tr("Nothing is known between the places here.");
  }
  const auto why = why_.find(key);
  if (why != why_.end() && !why->second.isEmpty()) return why->second;
  return tr("Sampling the volume...");
}

void VolumeStore::start(const VolumeKey& key, const Sampling& sampling) {
  running_.insert(key);
  jobs_.run(sampling, [this, key](Result<VolumeField> volume) {
    running_.erase(key);
    if (volume) {
      volume->title = titleOf(key);
      volumes_[key] = std::move(*volume);
    } else {
      broken_.insert(key);
      why_[key] = QString::fromStdString(volume.error().message);
    }
    emit changed();
  });
}

}  // namespace fieldtrue::widgets
