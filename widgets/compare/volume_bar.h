#pragma once

#include <QWidget>

#include "widgets/compare/volume_sampling.h"

class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QSlider;

namespace fieldtrue::widgets {

/// What is drawn in the volume: a quantity, a plane through it that keys and mouse move, and a surface of one value.
class VolumeBar : public QWidget {
  Q_OBJECT
 public:
  explicit VolumeBar(QWidget* parent = nullptr);

  VolumeQuantity quantity() const;
  /// The ways a sensor may be held, of which one is chosen, or the mean over all; asked for where there are several.
  void setWaysHeld(const std::vector<Eigen::Quaterniond>& ways);
  int held() const;
  void setQuantity(VolumeQuantity quantity);
  /// In a difference the quantity is always the distance between the two.
  void setDifference(bool difference);
  /// The range of the plane; it keeps its share of the way.
  void setLattice(const VolumeField& lattice);
  /// None where no plane is wanted.
  std::optional<SlicePlane> slice() const;
  /// None where no surface is wanted [mm].
  std::optional<double> iso_mm() const;
  /// A value to begin with, used until a person has typed one.
  void suggestIso_mm(double value_mm);
  void setText(const QString& text);
  QString text() const;

 signals:
  void quantityChanged();
  void sliceChanged();
  void isoChanged();

 private:
  void makeSlice();
  void makeIso();
  void showState();
  double position_m() const;

  QComboBox* quantity_;
  QComboBox* held_;
  QCheckBox* show_slice_;
  QComboBox* axis_;
  QSlider* position_;
  QLabel* position_text_;
  QCheckBox* show_iso_;
  QDoubleSpinBox* iso_;
  QLabel* text_;
  VolumeField lattice_;
  bool difference_ = false;
  bool iso_by_hand_ = false;
};

}  // namespace fieldtrue::widgets
