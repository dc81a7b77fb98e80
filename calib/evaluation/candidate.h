#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/core/run_control.h"
#include "calib/correctors/registry.h"

namespace fieldtrue::evaluation {

/// How one corrected row differs from the truth.
struct RowScore {
  double error = 0.0;                                    ///< mm, or degrees for an orientation.
  Eigen::Vector3d residual_m = Eigen::Vector3d::Zero();  ///< Corrected minus true, reference frame; positions only.
  bool covered = true;  ///< Where false, the input stands unchanged but for the alignment.
};

/// A fitted model of either kind, seen only through what a comparison asks of it.
struct FittedCandidate {
  std::function<RowScore(const Node&, const calibration::Alignment&)> score;
  std::function<double(const Node&)> evaluate;  ///< One evaluation, for timing; the value means nothing.
  std::string note;
  int coefficients = 0;  ///< @see PositionModel::coefficients; of all sensors where each has its own.
};

/// Fits of one candidate that leave rows out. @see HoldOutFits
struct FitsWithout {
  std::function<Result<FittedCandidate>(std::span<const std::size_t> rows, const Pose& fold_from_data)> fit;
  double own_variance = 0.0;
};

/// A method with its settings, of either kind.
struct Candidate {
  std::string id;
  Settings settings;
  bool is_position = true;
  std::function<Result<FittedCandidate>(const correctors::FitData&, const RunControl&)> fit;
  std::function<Result<FitsWithout>(const correctors::FitData&, const RunControl&)>
      hold_out;                                               ///< Empty without a closed form.
  std::function<bool(const correctors::FitData&)> holds_out;  ///< Whether there is one for such data; with hold_out.
  bool is_costly = false;                                     ///< Held out in ten folds at most.
  bool is_tuned = false;                                      ///< @see CorrectionMethod::tunes
};

/// The candidates that texts name; all of the registry with default settings when there are none.
/// @error kBadInput
Result<std::vector<Candidate>> positionCandidates(const std::vector<MethodText>& methods);
Result<std::vector<Candidate>> orientationCandidates(const std::vector<MethodText>& methods);

/// One fit a sensor, from its rows alone, scored each at its own rows.
/// @param dimension of all true positions: fewer rows that lie in a plane by chance are not fitted in it
/// @error as the method's fit, naming the sensor
Result<FittedCandidate> fitSensorsApart(const Candidate& candidate, std::span<const Node> rows,
                                        const TableMetadata& metadata, const calibration::Alignment& alignment,
                                        int dimension, const RunControl& control);

/// Fits of each sensor's rows alone that leave rows out, of which each scores its own sensor's.
/// @param rows numbered in this order
/// @error kUnsupported where there is no closed form for a sensor's rows; as the method's, naming the sensor
Result<FitsWithout> holdOutSensorsApart(const Candidate& candidate, std::span<const Node> rows,
                                        const TableMetadata& metadata, const calibration::Alignment& alignment,
                                        int dimension, const RunControl& control);

/// The score of a row that only the alignment touches.
RowScore alignedPositionScore(const Node& node, const calibration::Alignment& alignment);
RowScore alignedOrientationScore(const Node& node, const calibration::Alignment& alignment);

}  // namespace fieldtrue::evaluation
