#pragma once

#include <array>
#include <optional>
#include <string>

#include "acquisition/sampling/signal_report.h"

namespace fieldtrue::acquisition {

/// What is said to a question about the signal.
enum class Verdict { kNotKnown, kGood, kLook };
struct Answer {
  Verdict verdict = Verdict::kNotKnown;
  std::string text;  ///< A sentence: what was seen and, where it is not good, what to do.
  bool operator==(const Answer&) const = default;
};

/// How far the tracker saw the sensor go [m] when it was moved along x, along y and along z, as the person sees them.
using Moves = std::array<std::optional<Eigen::Vector3d>, 3>;

/// Follows a person who moves the sensor along +x, then +y, then +z, and rests it between.
class AxisMoves {
 public:
  static constexpr double kLeast_m = 0.05;  ///< A move.
  void begin();
  void stop() { asked_.reset(); }
  /// @param rests_at_m where the sensor rests; none while it moves
  void add(const std::optional<Eigen::Vector3d>& rests_at_m);
  /// The axis that is asked for now, 0 to 2; none before, after and between.
  std::optional<int> asked() const { return asked_; }
  bool hasStart() const { return from_m_.has_value(); }
  const Moves& moves() const { return moves_; }

 private:
  std::optional<int> asked_;
  std::optional<Eigen::Vector3d> from_m_;
  Moves moves_;
};

/// Is the sensor on the side of the transmitter where the tracker takes it to be? A mirrored reading is at -p for p:
/// three moves come out left-handed, however the transmitter stands.
/// @param hemisphere as it is set, "+x" to "-z"; empty = not known, or none
Answer hemisphereAnswer(const SignalReport& report, const Moves& moves, const std::string& hemisphere);

/// Do the tracker's axes go where the person thinks?
Answer axesAnswer(const Moves& moves);

/// Is the tracker still warming up, or something else moving?
Answer warmUpAnswer(const SignalReport& report);

/// Is the noise what this tracker should have at this range?
/// @param expected_sd_m 3-D SD of a single reading there; none = not known
Answer noiseAnswer(const SignalReport& report, const std::optional<double>& expected_sd_m);

}  // namespace fieldtrue::acquisition
