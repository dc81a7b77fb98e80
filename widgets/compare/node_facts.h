#pragma once

#include <QString>
#include <optional>
#include <vector>

#include "widgets/workbench/compared_methods.h"

namespace fieldtrue::widgets {

/// How the sensor's mean place moved while a place was taken.
struct TakeDrift {
  double change_mm = 0.0;     ///< Length of the fitted straight line over the take.
  double chance_sd_mm = 0.0;  ///< SD that the samples' scatter alone gives this figure along the line.
  double duration_s = 0.0;
  std::size_t n_samples = 0;
};

/// A straight line through the accepted samples of one place and visit over time.
/// @param n_effective independent samples the take is worth
/// @return none below 3 samples or without a spread of times
std::optional<TakeDrift> takeDrift(const SampleTable& samples, int node, int visit, int sensor, double n_effective);

/// One line of what is known of a place.
struct Fact {
  QString name;
  QString value;
};

/// What was measured in one row of the table, in words and numbers.
std::vector<Fact> nodeFacts(const Node& node, const SampleTable& samples);

/// What a method leaves at a place that its fit did not see.
struct PlaceResidual {
  QString method;
  double error = 0.0;   ///< mm, or degrees.
  bool covered = true;  ///< Where false the reading stood unchanged.
  bool before = false;  ///< The error before any correction.
  std::size_t row = 0;  ///< Of the comparison's part.
};

/// Every compared method at a place, the smallest error first; empty when the place was not scored.
std::vector<PlaceResidual> positionResiduals(const evaluation::Comparison& comparison, int node);
std::vector<PlaceResidual> orientationResiduals(const evaluation::Comparison& comparison, int node);

}  // namespace fieldtrue::widgets
