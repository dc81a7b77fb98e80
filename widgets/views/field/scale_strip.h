#pragma once

#include <QString>
#include <QWidget>
#include <optional>

#include "widgets/figures/error_field.h"

namespace fieldtrue::widgets {

/// The one legend under views that share it: colours with their unit, magnification of the arrows, what faint arrows
/// mean.
class ScaleStrip : public QWidget {
  Q_OBJECT
 public:
  enum class Scale { kMagnitude, kDifference };

  explicit ScaleStrip(QWidget* parent = nullptr);

  /// @param maximum_mm upper end; of a difference also the lower end, negative
  /// @param exceeded something shown is larger
  void setScale(Scale scale, double maximum_mm, bool exceeded);
  /// @param low_name, high_name of a difference's ends: who is better there
  void setEnds(const QString& low_name, const QString& high_name);
  /// What the colours tell: "error", or "error and correction".
  void setMeaning(const QString& meaning);
  /// A difference's volume has colours of its own, from 0 to the same maximum; empty = none is drawn.
  void setVolumeMeaning(const QString& meaning);
  void setMagnification(double magnification);
  void setOpacityRange(const std::optional<OpacityRange>& range);
  /// The legend in words, as a screen reader says it.
  QString text() const;

  QSize sizeHint() const override;
  QSize minimumSizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  void changed();
  int paintColors(QPainter& painter, Scale scale, const QString& title, int left, int width) const;
  void paintTicks(QPainter& painter, Scale scale, int bar_left, int bar) const;
  void paintOpacity(QPainter& painter, int left, int width) const;

  Scale scale_ = Scale::kMagnitude;
  double maximum_mm_ = 10.0;
  bool exceeded_ = false;
  QString low_name_, high_name_;
  QString meaning_ = tr("error");
  QString volume_meaning_;
  double magnification_ = 1.0;
  std::optional<OpacityRange> opacity_;
};

}  // namespace fieldtrue::widgets
