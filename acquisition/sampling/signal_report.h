#pragma once

#include <map>
#include <optional>
#include <string>

#include "acquisition/sampling/signal_window.h"
#include "calib/recording/sample_spectrum.h"

namespace fieldtrue::acquisition {

/// The noise of a single reading by its principal axes.
struct NoiseEllipsoid {
  Eigen::Vector3d sds_m = Eigen::Vector3d::Zero();     ///< Largest first.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< Columns, in the same order, tracker frame.
  double from_line_of_sight_rad = 0.0;                 ///< Of the largest axis, from the line to the transmitter.
  double sd_m() const { return sds_m.norm(); }         ///< 3-D.
};
/// @param covariance_m2 of a single reading @param position_m from the transmitter
NoiseEllipsoid noiseEllipsoid(const Eigen::Matrix3d& covariance_m2, const Eigen::Vector3d& position_m);

/// How fast a resting sensor's readings move.
struct Drift {
  Eigen::Vector3d m_per_s = Eigen::Vector3d::Zero();
  double sd_m_per_s = 0.0;  ///< Of the error of its length, all axes together.
  double over_s = 0.0;      ///< Time that the sensor has rested.
};
/// A line through the means of ten equal parts of the stand, so that noise that lasts for seconds is not taken for
/// certainty. @return nothing below 20 s
std::optional<Drift> driftOf(const std::vector<SecondMean>& seconds);

/// What one sensor sends, in numbers.
struct SignalReport {
  int sensor = 0;
  std::size_t readings = 0;  ///< Of the last half minute.
  double rate_hz = 0.0;
  std::map<std::string, std::size_t> marks;  ///< Readings with each of the tracker's marks.
  std::optional<Sample> newest;
  double rested_s = 0.0;  ///< 0 while it moves; what follows is of the stand and stays empty while it moves.
  std::optional<Pose> stand;
  std::optional<NoiseEllipsoid> noise;
  double least_sd_m = 0.0;  ///< No less is told along an axis: the step of the readings, or what stands for it.
  double sd_rot_rad = 0.0;
  double correlation = 0.0;  ///< Of successive readings; 1 where all are the same.
  double worth = 0.0;        ///< Independent readings that those of the stand are worth, slow noise counted in.
  std::size_t of_stand = 0;
  std::optional<recording::SampleSpectrum> spectrum;
  std::optional<Drift> drift;
};
SignalReport signalReport(const SensorSignal& signal);

}  // namespace fieldtrue::acquisition
