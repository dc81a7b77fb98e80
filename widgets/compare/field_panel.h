#pragma once

#include <QWidget>

#include "widgets/views/field/scale_strip.h"
#include "widgets/workbench/compared_methods.h"

class QComboBox;
class QLabel;

namespace fieldtrue::widgets {

class FieldView;
class FittedMethods;
class ViewBar;
class VolumeBar;
class VolumeStore;
struct FieldScale;
struct SceneCell;
struct VolumeField;
struct VolumeKey;

/// The error fields of any two methods side by side, one alone, or their difference; with a slice and a surface through
/// the volume. All views share camera, colours and selection.
class FieldPanel : public QWidget {
  Q_OBJECT
 public:
  FieldPanel(FittedMethods& fitted, VolumeStore& volumes, QWidget* parent = nullptr);

  /// Keeps the methods shown where they are still compared.
  void setComparison(const CalibrationTable& table, const std::optional<evaluation::Comparison>& comparison);
  void setLeft(MethodRow row);
  void setRight(MethodRow row);
  MethodRow left() const;
  MethodRow right() const;
  /// Whose held-out angles are drawn beside a corrected position.
  void setOrientation(MethodRow row);
  void setSelected(int node);
  void setHoles(const std::vector<SceneCell>& holes);
  void setFolds(const std::vector<SceneCell>& cells);

 signals:
  void nodeClicked(int node);
  void shownChanged();  ///< Other methods, or another way to show them.

 private:
  void connectBars();
  QWidget* makeChoosers();
  QWidget* makeViews();
  QWidget* makeLegend();
  void fillChoosers();
  void draw();
  void drawVolume();
  void drawSlice();
  void showScale(const std::vector<const ErrorField*>& fields);
  std::vector<const VolumeField*> volumesShown();
  VolumeKey keyOf(const FieldView* view) const;
  ErrorField fieldOf(MethodRow row);
  void addUncertainty(ErrorField& field, MethodRow row);
  void showCertainty(const std::vector<const ErrorField*>& fields);

  FittedMethods& fitted_;
  VolumeStore& volumes_;
  CalibrationTable table_;
  std::optional<evaluation::Comparison> comparison_;
  MethodRow orientation_row_;
  QComboBox* left_choice_;
  QComboBox* right_choice_;
  QLabel* between_;
  FieldView* left_;
  FieldView* right_;
  ViewBar* view_bar_;
  VolumeBar* volume_bar_;
  ScaleStrip* strip_;
  QComboBox* colors_to_;
  QLabel* certainty_text_;
};

}  // namespace fieldtrue::widgets
