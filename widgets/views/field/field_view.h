#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "widgets/figures/error_field.h"
#include "widgets/style/theme.h"
#include "widgets/views/field/volume_field.h"
#include "widgets/views/host/orbit_view.h"

namespace fieldtrue::widgets {

class FieldScene;

/// Arrows from the true to the tracked (or corrected) position of every place, coloured by length on a shared scale.
class FieldView : public OrbitView {
  Q_OBJECT
 public:
  explicit FieldView(QWidget* parent = nullptr);
  ~FieldView() override;

  void setField(const ErrorField& field);
  const ErrorField& field() const;
  /// One colour scale for every view compared: its upper end [mm].
  void setScaleMax_mm(double scale_max_mm);
  /// Arrows (and arcs) are drawn this much larger than true; the legend says so.
  void setMagnification(double magnification);
  void setShowOrientation(bool show);
  /// Upper end of the orientation scale [deg]; until set, the largest error of the field.
  void setAngleScaleMax_deg(double scale_max_deg);
  void setSelected(std::optional<int> node);
  /// A volume to cut and to draw a surface in; an empty one takes both away.
  void setVolume(const VolumeField& volume);
  /// Where the volume is cut; none draws no plane.
  void setSlice(const std::optional<SlicePlane>& plane);
  /// The value whose surface is drawn [mm]; none draws none.
  void setIso(const std::optional<double>& value_mm);
  /// Parts of the region no place is near.
  void setHoles(const std::vector<SceneCell>& holes);
  /// Cells in which the map is not one-to-one.
  void setFolds(const std::vector<SceneCell>& cells);
  /// Arrows whose SD is known fade with it; none draws all of them opaque.
  void setOpacityRange(const std::optional<OpacityRange>& range);
  /// Off where a legend beside the view serves several views.
  void setLegendShown(bool shown);

 signals:
  void nodeClicked(int node);
  void nodeHovered(int node, QString text);  ///< -1 and an empty text when the mouse left it.

 protected:
  void restyle(double pixel_ratio) override;
  void prepareFrame() override;
  QMargins legendMargins() const override;
  std::vector<Eigen::Vector3d> pickPoints_m() const override;
  void pointHovered(std::optional<int> index) override;
  void pointClicked(int index) override;

 private:
  std::unique_ptr<FieldScene> scene_;
};

}  // namespace fieldtrue::widgets
