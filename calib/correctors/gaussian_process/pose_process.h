#pragma once

#include <memory>
#include <optional>
#include <string>

#include "calib/core/memory_limit.h"
#include "calib/core/run_control.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/gaussian_process/pose_covariance.h"

namespace fieldtrue::correctors {

/// What orientation must bring for each further parameter [nats], and the share of the held-out error it must leave at
/// most: by one per cent that falls where orientation says nothing, too, since parameters more follow the noise.
inline constexpr double kNatsAParameter = 3.0;
inline constexpr double kClearlyLess = 0.97;

/// Everything a Gaussian process over poses and its hold-outs share.
struct PoseSystem {
  RadialKernel kernel = RadialKernel::kMatern52;
  FieldFrame frame;  ///< Not in units of the lengths.
  PoseScales scales;
  PoseRows rows;  ///< All rows of the fit data, in their order.
  Eigen::MatrixXd displacement_m;
  Eigen::MatrixXd tracked_m;
  std::string note;
  MemoryBooking memory;
};

/// Why position alone was kept, or the system over poses where that is better.
struct PoseChoice {
  std::optional<PoseSystem> system;
  std::string note;  ///< Empty where there is nothing to choose.
};

/// Whether rows are turned so differently that orientation can be asked about: fewer than nine of ten within 15 degrees
/// of any one, as the rig states it; where it states one orientation or none, within 45 degrees as tracked. What metal
/// does to the readings of a sensor that never turned says nothing of one that is turned.
bool hasSeveralOrientations(const FitData& data);

/// Chooses between position alone and poses, and finds the scales. Poses need 3 nats of restricted likelihood a further
/// parameter, and 3 % less error at rows whose places are left out.
/// @param places merged rows of the data; @param frame around them; @param start scales of the process over positions
/// @param must take poses whatever the comparison says
/// @error kUnsupported with `must` where rows are turned alike; as MemoryBooking::book; kCancelled
Result<PoseChoice> choosePoses(const FitData& data, const Places& places, RadialKernel kernel, const FieldFrame& frame,
                               const GaussianProcessScales& start, std::size_t tuning_places, bool must,
                               const RunControl& control);

/// The rows of fit data as a system without scales.
/// @error as MemoryBooking::book
Result<PoseSystem> poseSystemOf(const FitData& data, const Places& places, RadialKernel kernel, const FieldFrame& frame,
                                const RunControl& control);
/// So many well-spread places that their rows are no more than about `most`.
std::vector<std::size_t> placesOfAbout(const Places& places, std::size_t n_rows, std::size_t most);
/// Their rows, ascending.
std::vector<std::size_t> rowsOfPlaces(const Places& places, std::span<const std::size_t> some);
/// The likeliest scales of rows whose error is of position alone, from a start; none on a request to stop.
std::optional<PoseScales> rowScales(const PoseSystem& system, const GaussianProcessScales& start,
                                    std::span<const std::size_t> used, double spacing_m, const RunControl& control);
/// RMS over places, each left out with all its rows, with these scales kept; infinite where it cannot be told.
double heldOutRms_m(const PoseSystem& system, const PoseScales& scales, std::span<const std::size_t> used);

Result<std::unique_ptr<PositionModel>> fitPoses(const PoseSystem& system);
Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutPoses(PoseSystem system);

/// @param parameters as PositionModel::parameters stores them
std::unique_ptr<PositionModel> readPoses(const JsonReader& parameters);

}  // namespace fieldtrue::correctors
