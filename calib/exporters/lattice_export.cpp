#include "calib/exporters/lattice_export.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "calib/core/number_text.h"

namespace fieldtrue::exporters {
namespace {

constexpr double kUsualDeviation_m = 50e-6;
constexpr double kKeptBelow = 0.8;
constexpr int kPadding = 2;
constexpr int kMostTrials = 24;
constexpr std::size_t kBendPoints = 400;
constexpr double kLeastSteps = 3.0;  ///< Of a lattice along its longest axis.
constexpr double kMostSteps = 2000.0;
constexpr double kBendStep = 0.02;  ///< Of the longest side of the box.
constexpr std::size_t kProbesAtOnce = 1000;
constexpr double kShareOfWayBack = 0.1;  ///< Of the progress.
constexpr double kFound_m = 1e-6;        ///< What Newton's method comes to wherever there is a way back.

using Probe = std::pair<Eigen::Vector3d, Eigen::Vector3d>;

struct Extent {
  Eigen::Vector3d low_m;  ///< Along the lattice's axes.
  Eigen::Vector3d high_m;
  Eigen::Vector3d size_m() const { return high_m - low_m; }
};

/// The box of the places, widened by the region's margin.
Extent extentOf(const ExportSubject& subject, const Eigen::Matrix3d& axes) {
  const std::vector<Eigen::Vector3d> places_m = subject.places_m();
  Extent extent{axes.transpose() * places_m.front(), axes.transpose() * places_m.front()};
  for (const Eigen::Vector3d& p_m : places_m) {
    extent.low_m = extent.low_m.cwiseMin(axes.transpose() * p_m);
    extent.high_m = extent.high_m.cwiseMax(axes.transpose() * p_m);
  }
  const double margin_m = std::max(1e-3, subject.corrector().region().margin_m());
  extent.low_m.array() -= margin_m;
  extent.high_m.array() += margin_m;
  return extent;
}

/// The same, and the points of the region: where the map stretches, those of the margin go beyond.
Extent extentOf(const ExportSubject& subject, const Eigen::Matrix3d& axes, const std::vector<Probe>& probes) {
  Extent extent = extentOf(subject, axes);
  for (const auto& [p_m, goes_m] : probes) {
    extent.low_m = extent.low_m.cwiseMin(axes.transpose() * p_m);
    extent.high_m = extent.high_m.cwiseMax(axes.transpose() * p_m);
  }
  return extent;
}

LatticePoints latticeIn(const Extent& extent, const Eigen::Matrix3d& axes, const Eigen::Vector3d& pitch_m, int padding,
                        bool on_multiples) {
  LatticePoints points;
  points.axes = axes;
  points.pitch_m = pitch_m;
  Eigen::Vector3d first_m;
  for (int axis = 0; axis < 3; ++axis) {
    const double pitch = pitch_m[axis];
    if (on_multiples) {
      first_m[axis] = pitch * (std::floor(extent.low_m[axis] / pitch) - padding);
    } else {
      const double steps = std::ceil(extent.size_m()[axis] / pitch - 1e-9);
      first_m[axis] = 0.5 * (extent.low_m[axis] + extent.high_m[axis] - steps * pitch) - padding * pitch;
    }
    points.counts[static_cast<std::size_t>(axis)] =
        1 + padding + static_cast<int>(std::ceil((extent.high_m[axis] - first_m[axis]) / pitch - 1e-9));
  }
  points.origin_m = axes * first_m;
  return points;
}

/// Largest second difference of the map along each axis, as a pitch at which straight lines between points err by what
/// is wanted: h^2 |f''| / 8 is an error's bound on one axis, and three add up.
Eigen::Vector3d firstPitch_m(const ExportSubject& subject, const Extent& extent, const Eigen::Matrix3d& axes,
                             const std::vector<Probe>& probes, double wanted_m, const RunControl& control) {
  const double longest_m = extent.size_m().maxCoeff();
  const double step_m = kBendStep * longest_m;
  const std::size_t n = std::min(kBendPoints, probes.size());
  std::vector<Eigen::Vector3d> bends(n, Eigen::Vector3d::Zero());
  control.parallel_for(n, [&](std::size_t i) {
    const Eigen::Vector3d& p_m = probes[i].first;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d h_m = step_m * axes.col(axis);
      bends[i][axis] = (subject.mapped_m(p_m + h_m) - 2.0 * probes[i].second + subject.mapped_m(p_m - h_m)).norm() /
                       (step_m * step_m);
    }
  });
  Eigen::Vector3d pitch_m;
  for (int axis = 0; axis < 3; ++axis) {
    double largest = 0.0;
    for (const Eigen::Vector3d& bend : bends) largest = std::max(largest, bend[axis]);
    pitch_m[axis] = std::clamp(std::sqrt(8.0 * wanted_m / (3.0 * std::max(largest, 1e-9))), longest_m / kMostSteps,
                               longest_m / kLeastSteps);
  }
  return pitch_m;
}

std::string pitchText(const Eigen::Vector3d& pitch_m) {
  std::string text;
  for (const double one_m : pitch_m) {
    if (!text.empty()) text += " x ";
    text += shortNumber(1000.0 * one_m);
  }
  return text + " mm";
}

std::string countText(const LatticePoints& points) {
  return std::to_string(points.counts[0]) + "x" + std::to_string(points.counts[1]) + "x" +
         std::to_string(points.counts[2]);
}

std::string lengthText(double length_m) {
  return length_m >= 1e-3 ? shortNumber(1e3 * length_m) + " mm" : shortNumber(1e6 * length_m) + " um";
}

std::string positionText(const Eigen::Vector3d& p_m) {
  return "(" + fixedText(p_m.x(), 3) + ", " + fixedText(p_m.y(), 3) + ", " + fixedText(p_m.z(), 3) + ") m";
}

/// Where the way back from a corrected point leads.
struct WayBack {
  Eigen::Vector3d reading_m = Eigen::Vector3d::Zero();
  double residual_m = 0.0;  ///< Of that reading, corrected, from the point.
  double off_m = 0.0;       ///< Of that reading from the one that the point came from.
};

std::string foldText(const Probe& probe, const WayBack& back) {
  const std::string at = positionText(probe.first), reading = positionText(probe.second);
  if (!(back.residual_m <= kFound_m))
    return "from " + at + ", where the reading " + reading + " goes, no way back is found";
  return "the readings " + reading + " and " + positionText(back.reading_m) + " are both corrected to " + at;
}

/// @error kUnsupported naming the worst point whose way back leads elsewhere
Result<void> checkWaysBack(std::span<const Probe> probes, const std::vector<WayBack>& backs, double allowed_m) {
  const auto isLost = [&](const WayBack& back) { return !(back.off_m <= allowed_m); };
  const auto n_lost = std::count_if(backs.begin(), backs.end(), isLost);
  if (n_lost == 0) return {};
  // Two readings for one place say more than none.
  const auto rank = [&](const WayBack& back) {
    return std::pair(isLost(back) && back.residual_m <= kFound_m, back.off_m);
  };
  const auto worst = std::max_element(backs.begin(), backs.end(),
                                      [&](const WayBack& a, const WayBack& b) { return rank(a) < rank(b); });
  return fail(ErrorCode::kUnsupported,
              "This correction folds back, so that nothing can be written true-to-measured: " +
                  foldText(probes[static_cast<std::size_t>(worst - backs.begin())], *worst) + "; so it is at " +
                  std::to_string(n_lost) + " of " + std::to_string(backs.size()) +
                  " points of the region. Write it measured-to-true, or fit a smoother method or a smaller region");
}

/// How far the way there and back is off at most; the probes of a map from true to measured are turned round one block
/// after the other, so that a map that cannot be is told within seconds.
/// @error kUnsupported naming the worst point where a correction folds back; kCancelled
Result<double> inverseResidual_m(const ExportSubject& subject, const std::vector<Probe>& probes, double allowed_m,
                                 const RunControl& control) {
  double residual_m = 0.0;
  for (std::size_t first = 0; first < probes.size(); first += kProbesAtOnce) {
    std::vector<WayBack> backs(std::min(kProbesAtOnce, probes.size() - first));
    control.parallel_for(backs.size(), [&](std::size_t i) {
      if (control.stop.stop_requested()) return;
      const auto& [p_true_m, reading_m] = probes[first + i];
      const Eigen::Vector3d back_m = subject.inverse_m(p_true_m);
      backs[i] = {back_m, (subject.forward_m(back_m) - p_true_m).norm(), (back_m - reading_m).norm()};
    });
    if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
    FT_TRY_VOID(checkWaysBack(std::span(probes).subspan(first, backs.size()), backs, allowed_m));
    for (const WayBack& back : backs) residual_m = std::max(residual_m, back.residual_m);
    control.progress(kShareOfWayBack * static_cast<double>(first + backs.size()) / static_cast<double>(probes.size()));
  }
  return residual_m;
}

double deviationOf(const LatticeField& field, const LatticeForm& form, const std::vector<Probe>& probes) {
  const auto mapped_m = [&](const Eigen::Vector3d& p_m) -> std::optional<Eigen::Vector3d> {
    if (form.mapped_m) return form.mapped_m(field, p_m);
    return field.mapped_m(p_m);
  };
  return deviationAt(probes, mapped_m).worst_m;
}

}  // namespace

LatticePoints latticeAround(const ExportSubject& subject, const Eigen::Matrix3d& axes, const Eigen::Vector3d& pitch_m,
                            int padding, bool on_multiples) {
  return latticeIn(extentOf(subject, axes), axes, pitch_m, padding, on_multiples);
}

Result<LatticeField> sampleField(const ExportSubject& subject, const LatticePoints& points, const LatticeForm& form,
                                 const RunControl& control) {
  LatticeField field;
  field.points = points;
  const std::size_t n = points.size();
  field.displacement_m.resize(n);
  if (form.with_rotation) field.rotation.resize(n);
  if (form.with_uncertainty) {
    field.uncertainty_m.assign(n, std::nan(""));
    field.inside.assign(n, 0);
  }
  const auto plane = static_cast<std::size_t>(points.counts[0]) * static_cast<std::size_t>(points.counts[1]);
  control.parallel_for(static_cast<std::size_t>(points.counts[2]), [&](std::size_t k) {
    if (control.stop.stop_requested()) return;
    for (std::size_t at = k * plane; at < (k + 1) * plane; ++at) {
      const Eigen::Vector3d p_m = points.point_m(at);
      const Eigen::Vector3d goes_m = subject.mapped_m(p_m);
      field.displacement_m[at] = goes_m - p_m;
      const Eigen::Vector3d& tracked_m = subject.isInverse() ? goes_m : p_m;
      if (form.with_rotation) field.rotation[at] = subject.rotation(tracked_m);
      if (!form.with_uncertainty) continue;
      field.uncertainty_m[at] = subject.uncertainty_m(tracked_m).value_or(std::nan(""));
      field.inside[at] = subject.corrector().covers(tracked_m) ? 1 : 0;
    }
  });
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
  return field;
}

Deviation deviationAt(const std::vector<Probe>& probes,
                      const std::function<std::optional<Eigen::Vector3d>(const Eigen::Vector3d&)>& mapped_m) {
  std::vector<double> distances_m;
  for (const auto& [p_m, goes_m] : probes) {
    const auto seen_m = mapped_m(p_m);
    distances_m.push_back(seen_m ? (*seen_m - goes_m).norm() : HUGE_VAL);
  }
  std::sort(distances_m.begin(), distances_m.end());
  Deviation deviation;
  deviation.n_points = distances_m.size();
  if (distances_m.empty()) return deviation;
  deviation.worst_m = distances_m.back();
  deviation.p99_m = distances_m[static_cast<std::size_t>(0.99 * static_cast<double>(distances_m.size() - 1))];
  return deviation;
}

std::string deviationText(const Deviation& deviation) {
  return "off by at most " + lengthText(deviation.worst_m) + " at " + std::to_string(deviation.n_points) +
         " points of the region, 99 % below " + lengthText(deviation.p99_m);
}

Result<void> checkDeviation(const Deviation& deviation, const ExportOptions& options, const std::string& label) {
  if (!options.max_deviation_m || deviation.worst_m <= *options.max_deviation_m) return {};
  return fail(ErrorCode::kUnsupported, label + " is off by up to " + lengthText(deviation.worst_m) +
                                           " from this calibration, more than the " +
                                           lengthText(*options.max_deviation_m) +
                                           " allowed; allow more, or choose a format whose pitch is free");
}

Result<Written> writeLattice(const ExportSubject& subject, const ExportOptions& options,
                             const std::filesystem::path& path, const LatticeForm& form, const RunControl& control) {
  const double allowed_m = options.max_deviation_m.value_or(kUsualDeviation_m);
  const std::vector<Probe> probes = subject.probes(kProbes);
  if (probes.empty())
    return fail(ErrorCode::kDegenerate,
                "This calibration holds nowhere: its places span no volume, so that no lattice "
                "can be written; record places in several layers");
  const Eigen::Matrix3d axes = form.may_be_turned ? subject.rigAxes() : Eigen::Matrix3d::Identity();
  double inverse_residual_m = 0.0;
  if (subject.isInverse()) {
    FT_TRY(inverse_residual_m, inverseResidual_m(subject, probes, allowed_m, control));
  }
  const Extent extent = extentOf(subject, axes, probes);
  Eigen::Vector3d pitch_m = firstPitch_m(subject, extent, axes, probes, kKeptBelow * allowed_m, control);
  LatticeField field;
  double reached_m = HUGE_VAL;
  Eigen::Vector3d reached_pitch_m = pitch_m;
  for (int trial = 0; trial < kMostTrials && !(reached_m <= kKeptBelow * allowed_m); ++trial) {
    const LatticePoints points = latticeIn(extent, axes, pitch_m, kPadding, false);
    const double bytes =
        form.bytes_per_point * static_cast<double>(points.counts[0]) * points.counts[1] * points.counts[2];
    if (bytes > options.max_size_bytes) {
      if (!(reached_m < HUGE_VAL)) {  // Nothing was tried yet: the finest that the size allows.
        pitch_m *= std::cbrt(bytes / (0.5 * options.max_size_bytes));
        continue;
      }
      return fail(ErrorCode::kUnsupported, "A lattice of " + pitchText(reached_pitch_m) + " is off by up to " +
                                               lengthText(reached_m) + ", and one that is off by " +
                                               lengthText(allowed_m) + " takes more than the " +
                                               shortNumber(options.max_size_bytes / 1048576.0) +
                                               " MiB allowed; allow a larger deviation or file");
    }
    FT_TRY(field, sampleField(subject, points, form, control));
    reached_m = deviationOf(field, form, probes);
    if (!std::isfinite(reached_m))
      return fail(
          ErrorCode::kUnsupported,
          "This calibration does not give a position everywhere in its region, so that no lattice can be written");
    reached_pitch_m = pitch_m;
    const double needed = std::sqrt(kKeptBelow * allowed_m / reached_m);
    if (needed < 1.0) pitch_m *= std::clamp(0.97 * needed, 0.5, 0.9);
    control.progress(kShareOfWayBack + 0.7 * (trial + 1) / kMostTrials);
  }
  if (!(reached_m <= allowed_m))
    return fail(ErrorCode::kUnsupported, "A lattice of " + pitchText(reached_pitch_m) + " is still off by up to " +
                                             lengthText(reached_m) + " instead of " + lengthText(allowed_m) +
                                             "; allow a larger deviation");

  Facts facts = subject.facts(form.unit);
  facts.emplace_back("lattice", countText(field.points) + " points, pitch " + pitchText(field.points.pitch_m));
  facts.emplace_back("interpolation", "trilinear");
  facts.emplace_back("largest_deviation_um",
                     shortNumber(1e6 * reached_m) + " at " + std::to_string(probes.size()) + " points of the region");
  if (subject.isInverse()) facts.emplace_back("inverse_residual_um", shortNumber(1e6 * inverse_residual_m));
  facts.emplace_back("beyond",
                     "two steps of padding beyond the places and a quarter of their spacing; what lies there is "
                     "extrapolated");
  FT_TRY_VOID(form.write(field, facts, path));

  FT_TRY(const auto read_back, form.read(path));
  Written written;
  written.deviation = deviationAt(probes, [&](const Eigen::Vector3d& p_m) -> std::optional<Eigen::Vector3d> {
    if (form.mapped_m) return form.mapped_m(read_back, p_m);
    return read_back.mapped_m(p_m);
  });
  if (written.deviation->worst_m > allowed_m) {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    return fail(ErrorCode::kIo, path.string() + " reads back " + deviationText(*written.deviation) +
                                    ", which is not what was written; it was removed");
  }
  if (form.with_rotation) subject.tellOfTurns(written);
  written.notes.push_back("Lattice of " + countText(field.points) + " points, pitch " +
                          pitchText(field.points.pitch_m) + ", " + deviationText(*written.deviation) + ".");
  control.progress(1.0);
  return written;
}

}  // namespace fieldtrue::exporters
