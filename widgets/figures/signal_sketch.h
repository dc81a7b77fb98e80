#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/sampling/signal_questions.h"

namespace fieldtrue::widgets {

/// What a line of a sketch is for; the theme gives it a colour.
enum class Tone { kMuted, kText, kAccent, kAttention };

/// A small drawing in space, in a box of -1 to 1: lines, dots and words, seen from the front, the right and above.
struct Sketch {
  struct Line {
    std::vector<Eigen::Vector3d> points;
    Tone tone = Tone::kText;
    bool is_dashed = false;
    bool has_arrow = false;  ///< At its last point.
  };
  struct Dot {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    double radius = 0.05;
    Tone tone = Tone::kText;
    bool is_filled = true;
  };
  struct Label {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    std::string text;
    Tone tone = Tone::kText;
  };
  std::vector<Line> lines;
  std::vector<Dot> dots;
  std::vector<Label> labels;
  bool is_flat = false;  ///< x to the right and y upwards: a chart.
  std::string words;     ///< The same for who cannot see it.
};

/// A point of a sketch on paper: right, upwards.
Eigen::Vector2d onPaper(const Eigen::Vector3d& point, bool is_flat);

/// The transmitter with its axes, and the sensor in the direction in which the tracker sees it; hollow where a mirrored
/// reading would have it.
Sketch sideSketch(const std::optional<Eigen::Vector3d>& position_m);

/// The axes, with the move that is asked for as an arrow; those made are drawn as the tracker saw them.
Sketch movesSketch(const std::optional<int>& asked, const acquisition::Moves& moves);

/// Where the means of the seconds went since the sensor rests, by axis.
Sketch driftSketch(const std::vector<acquisition::SecondMean>& seconds);

/// The ellipsoid of the noise, with the line to the transmitter; dashed the sphere of the noise to be expected.
Sketch noiseSketch(const std::optional<acquisition::NoiseEllipsoid>& noise, const Eigen::Vector3d& position_m,
                   const std::optional<double>& expected_sd_m);

}  // namespace fieldtrue::widgets
