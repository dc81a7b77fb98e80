#pragma once

#include <QObject>
#include <functional>
#include <map>
#include <set>
#include <tuple>

#include "widgets/compare/volume_sampling.h"
#include "widgets/workbench/background.h"
#include "widgets/workbench/fitted_methods.h"

namespace fieldtrue::widgets {

/// Which volume: a quantity of one method, or the difference of two.
struct VolumeKey {
  VolumeQuantity quantity = VolumeQuantity::kNone;
  MethodRow a;
  MethodRow b;
  bool difference = false;
  int held = kMeanHeld;  ///< Of waysHeld().
  bool operator<(const VolumeKey& other) const {
    return std::tie(quantity, a, b, difference, held) <
           std::tie(other.quantity, other.a, other.b, other.difference, other.held);
  }
};

/// The volumes of a comparison, sampled in the background when first asked for.
class VolumeStore : public QObject {
  Q_OBJECT
 public:
  explicit VolumeStore(FittedMethods& fitted, QObject* parent = nullptr);

  void reset(const CalibrationTable& table, const std::optional<evaluation::Comparison>& comparison);
  /// Null until it is there; the first question starts it.
  const VolumeField* get(const VolumeKey& key);
  /// What is drawn, that it is being made, or why it cannot be drawn, in one sentence.
  QString text(const VolumeKey& key) const;
  bool busy() const { return !running_.empty(); }

 signals:
  void changed();

 private:
  using Sampling = std::function<VolumeField(const RunControl&)>;
  /// What fills the volume; empty while a fit is awaited or where it is impossible, which `why` then tells.
  Sampling samplingOf(const VolumeKey& key, QString* why);
  QString titleOf(const VolumeKey& key) const;
  QString turnOf(const VolumeKey& key) const;
  Held heldOf(const VolumeKey& key) const;
  void start(const VolumeKey& key, const Sampling& sampling);

  FittedMethods& fitted_;
  CalibrationTable table_;
  std::optional<evaluation::Comparison> comparison_;
  VolumeField lattice_;
  std::vector<Eigen::Quaterniond> ways_held_;
  std::map<VolumeKey, VolumeField> volumes_;
  std::map<VolumeKey, QString> why_;
  std::set<VolumeKey> broken_;  ///< Their sampling threw, and would again.
  std::set<VolumeKey> running_;
  BackgroundJobs jobs_{this};
};

}  // namespace fieldtrue::widgets
