#pragma once

#include <QWidget>

#include "widgets/views/host/camera.h"

class QButtonGroup;
class QCheckBox;
class QHBoxLayout;
class QLabel;
class QSlider;

namespace fieldtrue::widgets {

/// How the error fields are looked at: two, one or their difference; arrow length, turns, certainty and camera.
class ViewBar : public QWidget {
  Q_OBJECT
 public:
  enum class Mode { kSideBySide, kOne, kDifference };

  explicit ViewBar(QWidget* parent = nullptr);

  Mode mode() const;
  void setMode(Mode mode);
  bool certaintyShown() const;
  /// Sets the magnification that suits the fields shown, times what a person made of it so far.
  void suitMagnification(double magnification);

 signals:
  void modeChanged();
  void magnified(double magnification);
  void turnsShown(bool on);
  void certaintyChanged();
  void cameraChosen(fieldtrue::widgets::CameraPreset preset);

 private:
  void makeModes(QHBoxLayout* layout);
  void makeArrows(QHBoxLayout* layout);
  void makeChecks(QHBoxLayout* layout);
  void makeCamera(QHBoxLayout* layout);
  void show(double magnification);

  QButtonGroup* modes_;
  QSlider* arrows_;
  QLabel* arrows_text_;
  QCheckBox* certainty_;
  double suited_ = 1.0;  ///< Magnification that suits the fields shown.
  double factor_ = 1.0;  ///< What a person made of it.
};

}  // namespace fieldtrue::widgets
