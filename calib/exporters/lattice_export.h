#pragma once

#include <functional>

#include "calib/exporters/exporter.h"

namespace fieldtrue::exporters {

/// What a format of free pitch can hold.
struct LatticeForm {
  std::string unit = "millimetres";
  double bytes_per_point = 24.0;
  bool may_be_turned = false;  ///< Lattices along the rig's axes; else along those of the map's domain.
  bool with_rotation = false;  ///< Has room for orientations.
  bool with_uncertainty = false;
  std::function<Result<void>(const LatticeField&, const Facts&, const std::filesystem::path&)> write;
  std::function<Result<LatticeField>(const std::filesystem::path&)> read;
  /// How the format's readers take a position, where it is not trilinear in the displacement; empty = trilinear.
  std::function<Eigen::Vector3d(const LatticeField&, const Eigen::Vector3d&)> mapped_m;
};

/// Chooses the pitch, samples, writes, reads the file back and compares it with the calibration at 10,000 points. The
/// pitch along each axis follows the bend of the map along it; all are made finer together until the deviation at the
/// points is four fifths of what is allowed. Beside the box of the places, the region's margin and the points
/// themselves the lattice has two steps more.
/// @error kUnsupported naming pitch and deviation where no lattice of the size allowed is near enough, or, before
///        anything is sampled, two readings where a map from true to measured cannot be; kIo; kCancelled
Result<Written> writeLattice(const ExportSubject& subject, const ExportOptions& options,
                             const std::filesystem::path& path, const LatticeForm& form, const RunControl& control);

/// The map sampled at lattice points. @error kCancelled
Result<LatticeField> sampleField(const ExportSubject& subject, const LatticePoints& points, const LatticeForm& form,
                                 const RunControl& control);

/// The box of the places, widened by the region's margin, as a lattice of a given pitch with so many steps more on
/// every side; its first point is a whole multiple of the pitch where `on_multiples`.
LatticePoints latticeAround(const ExportSubject& subject, const Eigen::Matrix3d& axes, const Eigen::Vector3d& pitch_m,
                            int padding, bool on_multiples = false);

/// How a map compares with the calibration at probes; none where it does not reach one of them.
Deviation deviationAt(const std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>& probes,
                      const std::function<std::optional<Eigen::Vector3d>(const Eigen::Vector3d&)>& mapped_m);

/// "off by at most 31 um at 10000 points of the region, 99 % below 12 um"
std::string deviationText(const Deviation& deviation);

/// Refuses a fixed form that deviates by more than a limit that was given.
Result<void> checkDeviation(const Deviation& deviation, const ExportOptions& options, const std::string& label);

inline constexpr std::size_t kProbes = 10000;

}  // namespace fieldtrue::exporters
