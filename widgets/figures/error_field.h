#pragma once

#include <Eigen/Core>
#include <QString>
#include <optional>
#include <vector>

#include "calib/core/pose.h"
#include "widgets/figures/believed_body.h"

namespace fieldtrue::widgets {

/// The error at one place: an arrow from where the sensor was to where the tracker said it was.
struct FieldArrow {
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero();   ///< True position, reference frame [m].
  Eigen::Vector3d error_m = Eigen::Vector3d::Zero();  ///< Tracked (or corrected) minus true, reference frame [m].
  int node = 0;
  std::optional<double> angle_deg;  ///< Orientation error.
  bool validation = false;
  bool flagged = false;                  ///< Beyond what noise explains.
  std::optional<double> uncertainty_mm;  ///< SD of the corrected position, when the method knows it.
  std::optional<double> better_mm;       ///< Differences only: error of A less that of B; negative = A is better.
  std::optional<Eigen::Vector3d>
      rotation_axis;  ///< Of the orientation error, reference frame, any length; drawn as a needle through the arc.
  QString name;       ///< What hover calls the place; empty: "P17".
};

/// How the SD of a corrected position is told by an arrow's opacity.
struct OpacityRange {
  double opaque_mm = 0.0;  ///< Up to here fully opaque [mm].
  double faint_mm = 1.0;   ///< From here on as faint as it gets [mm].
  bool operator==(const OpacityRange&) const = default;
};

/// From 1 (certain) down to a faint rest that can still be seen.
double opacityOf(double uncertainty_mm, const OpacityRange& range);

struct ErrorField {
  QString title;
  std::vector<FieldArrow> arrows;
  Pose reference_from_tracker;
  std::vector<BelievedBody> bodies;
};

}  // namespace fieldtrue::widgets
