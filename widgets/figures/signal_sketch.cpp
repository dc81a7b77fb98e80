#include "widgets/figures/signal_sketch.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/core/number_text.h"

namespace fieldtrue::widgets {

namespace {

using Eigen::Vector3d;

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr int kCirclePoints = 48;
constexpr const char* kAxisNames[] = {"x", "y", "z"};

std::string scaleText(double metres) { return significantText(1000.0 * metres, 2) + " mm"; }

void addAxes(Sketch& sketch, double length, Tone tone) {
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d end = length * Vector3d::Unit(axis);
    sketch.lines.push_back({{Vector3d::Zero(), end}, tone, false, true});
    sketch.labels.push_back({1.18 * end, kAxisNames[axis], tone});
  }
}

std::vector<Vector3d> ellipse(const Vector3d& first, const Vector3d& second) {
  std::vector<Vector3d> points;
  for (int i = 0; i <= kCirclePoints; ++i) {
    const double angle = kTwoPi * i / kCirclePoints;
    points.push_back(std::cos(angle) * first + std::sin(angle) * second);
  }
  return points;
}

}  // namespace

Eigen::Vector2d onPaper(const Vector3d& point, bool is_flat) {
  if (is_flat) return point.head<2>();
  // From 35 degrees to the side and 25 above: x comes towards the viewer, y goes to the right, z upwards.
  constexpr double kSide = 35.0 * std::numbers::pi / 180.0, kAbove = 25.0 * std::numbers::pi / 180.0;
  const double towards = std::cos(kSide) * point.x() + std::sin(kSide) * point.y();
  return {std::cos(kSide) * point.y() - std::sin(kSide) * point.x(),
          std::cos(kAbove) * point.z() - std::sin(kAbove) * towards};
}

Sketch sideSketch(const std::optional<Vector3d>& position_m) {
  Sketch sketch;
  addAxes(sketch, 0.7, Tone::kText);
  sketch.words = "The transmitter and its axes";
  if (!position_m || position_m->norm() <= 0.0) return sketch;
  const Vector3d sensor = 0.95 * position_m->normalized();
  sketch.lines.push_back({{Vector3d::Zero(), sensor}, Tone::kAccent, true, false});
  sketch.lines.push_back({{Vector3d::Zero(), -sensor}, Tone::kMuted, true, false});
  sketch.dots.push_back({sensor, 0.09, Tone::kAccent, true});
  sketch.dots.push_back({-sensor, 0.09, Tone::kMuted, false});
  sketch.words += "; the sensor where the tracker sees it, and hollow its mirrored place";
  return sketch;
}

Sketch movesSketch(const std::optional<int>& asked, const acquisition::Moves& moves) {
  Sketch sketch;
  addAxes(sketch, 0.95, Tone::kMuted);
  sketch.words = "The three axes";
  for (int axis = 0; axis < 3; ++axis) {
    const auto& move = moves[static_cast<std::size_t>(axis)];
    if (!move) continue;
    const bool as_meant = move->normalized().dot(Vector3d::Unit(axis)) > 0.9;
    sketch.lines.push_back(
        {{Vector3d::Zero(), 0.85 * move->normalized()}, as_meant ? Tone::kText : Tone::kAttention, false, true});
  }
  if (!asked) return sketch;
  const Vector3d end = 0.95 * Vector3d::Unit(*asked);
  sketch.lines.push_back({{0.15 * end, end}, Tone::kAccent, false, true});
  sketch.dots.push_back({0.15 * end, 0.09, Tone::kAccent, true});
  sketch.words = std::string("An arrow along +") + kAxisNames[*asked] + ": move the sensor so";
  return sketch;
}

Sketch driftSketch(const std::vector<acquisition::SecondMean>& seconds) {
  Sketch sketch;
  sketch.is_flat = true;
  sketch.lines.push_back({{{-0.9, 0.0, 0.0}, {0.9, 0.0, 0.0}}, Tone::kMuted, true, false});
  sketch.words = "Where the resting sensor has been";
  if (seconds.size() < 2) return sketch;
  const double begin_s = seconds.front().t_s, span_s = seconds.back().t_s - begin_s;
  Vector3d mean_m = Vector3d::Zero();
  for (const auto& second : seconds) mean_m += second.mean_m / static_cast<double>(seconds.size());
  double most_m = 1e-6;
  for (const auto& second : seconds) most_m = std::max(most_m, (second.mean_m - mean_m).cwiseAbs().maxCoeff());
  constexpr Tone kTones[] = {Tone::kAccent, Tone::kText, Tone::kAttention};
  for (int axis = 0; axis < 3; ++axis) {
    Sketch::Line line{{}, kTones[axis], false, false};
    for (const auto& second : seconds) {
      line.points.push_back(
          {-0.9 + 1.8 * (second.t_s - begin_s) / span_s, 0.6 * (second.mean_m - mean_m)[axis] / most_m, 0.0});
    }
    sketch.lines.push_back(std::move(line));
    sketch.labels.push_back({{0.3 + 0.25 * axis, -0.88, 0.0}, kAxisNames[axis], kTones[axis]});
  }
  sketch.labels.push_back({{-0.5, 0.88, 0.0}, "\u00b1" + scaleText(most_m), Tone::kMuted});
  sketch.labels.push_back({{-0.5, -0.88, 0.0}, fixedText(span_s, 0) + " s", Tone::kMuted});
  return sketch;
}

Sketch noiseSketch(const std::optional<acquisition::NoiseEllipsoid>& noise, const Vector3d& position_m,
                   const std::optional<double>& expected_sd_m) {
  Sketch sketch;
  sketch.words = "The ellipsoid of the noise";
  if (!noise) return sketch;
  // One axis of a sphere whose 3-D SD is as expected.
  const double expected_m = expected_sd_m.value_or(0.0) / std::sqrt(3.0);
  const double largest_m = std::max({noise->sds_m[0], expected_m, 1e-9});
  const Eigen::Matrix3d axes = 0.75 / largest_m * noise->axes * noise->sds_m.asDiagonal();
  if (position_m.norm() > 0.0) {
    const Vector3d towards = -0.95 * position_m.normalized();
    sketch.lines.push_back({{-towards, towards}, Tone::kMuted, true, true});
  }
  if (expected_m > 0.0) sketch.dots.push_back({Vector3d::Zero(), 0.75 * expected_m / largest_m, Tone::kMuted, false});
  for (int axis = 0; axis < 3; ++axis) {
    sketch.lines.push_back({ellipse(axes.col(axis), axes.col((axis + 1) % 3)), Tone::kAccent, false, false});
  }
  const bool is_expected_larger = expected_m > noise->sds_m[0];
  sketch.labels.push_back(
      {{0.0, 0.0, -1.05}, (is_expected_larger ? "circle: " : "largest: ") + scaleText(largest_m), Tone::kMuted});
  return sketch;
}

}  // namespace fieldtrue::widgets
