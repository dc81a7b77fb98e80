#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/core/settings.h"
#include "calib/evaluation/comparison.h"
#include "widgets/report/report.h"

/// What the parts of a report share: numbers gathered from the table and the comparison, no markup.
namespace fieldtrue::widgets {

/// One scored place of a comparison.
struct PlaceSummary {
  int node = 0;
  std::string name;
  Eigen::Vector3d p_true_m = Eigen::Vector3d::Zero();  ///< Of its first row, reference frame.
  bool validation = false;
  double before_mm = 0.0;
  double after_mm = 0.0;                               ///< With the best position method.
  Eigen::Vector3d before_m = Eigen::Vector3d::Zero();  ///< Tracked minus true, reference frame.
  Eigen::Vector3d after_m = Eigen::Vector3d::Zero();
  std::optional<double> before_deg;  ///< Orientation error.
  std::optional<double> sd_mm;       ///< 3-D SD of a single sample, RMS over the place's rows.
  int n_used = 0;
  int n_rejected = 0;
};

/// What the table as a whole holds.
struct MeasurementSummary {
  std::size_t n_rows = 0;
  int n_skipped_rows = 0;
  int n_sensors = 0;
  long n_used = 0;
  long n_rejected = 0;
  bool has_orientation = false;
  std::optional<double> sd_mm;            ///< Median over the rows of the 3-D SD of a single sample.
  std::optional<double> sd_deg;           ///< Median over the rows.
  std::optional<double> autocorrelation;  ///< Lag 1, median over the rows with more than one sample.
  std::optional<double> duration_s;
};

/// The score of the best position method; none when nothing was better than the input.
const evaluation::MethodScore* bestPosition(const evaluation::Comparison& comparison);
const evaluation::MethodScore* bestOrientation(const evaluation::Comparison& comparison);

/// The scored places in the comparison's order.
std::vector<PlaceSummary> placeSummaries(const ReportInput& input);
MeasurementSummary measurementSummary(const CalibrationTable& table);

/// "degree=3, lambda=auto"; empty without settings.
std::string settingsText(const Settings& settings);

/// What a person should know before applying what the verdict recommends: "the field folds back", "the worst place is
/// no better"; empty when there is nothing.
std::string cautionText(const evaluation::Comparison& comparison);

/// The position methods that were not tried, by name; empty when all were.
std::string notComparedText(const evaluation::Comparison& comparison);

/// Distance of a method's RMS to the best one's: "best", "+0.42 (0.31 to 0.55)", and ", as good" where the 90 %
/// interval holds zero.
std::string toBestText(const evaluation::MethodScore& score, bool is_best);

/// What the floor leaves of the error before and after the best method, as a sentence; empty where no floor is known.
std::string truenessText(const evaluation::Comparison& comparison);

/// What each way to bring the measured errors to a grid costs by itself, as a sentence; empty where none was tried.
std::string resamplingText(const evaluation::Comparison& comparison);
/// What is left at each sensor, before and with the best position method; empty with one sensor.
std::string sensorsText(const evaluation::Comparison& comparison);

/// "0.31 mm, 0.02 deg (from samples and jig tolerance)", or that it is not known.
std::string floorText(const evaluation::Comparison& comparison);

}  // namespace fieldtrue::widgets
