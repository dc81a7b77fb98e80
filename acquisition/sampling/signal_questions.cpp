#include "acquisition/sampling/signal_questions.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/core/number_text.h"
#include "calib/recording/line_sources.h"

namespace fieldtrue::acquisition {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
/// A hand moves the sensor along an axis no better than this.
constexpr double kHand_rad = 25.0 * kDegree;
/// Least singular value of three unit moves that are told apart.
constexpr double kLeastSpread = 0.4;
/// Nearer than this share of its range to the plane where the sides meet, a sensor may be on either.
constexpr double kNearTheEdge = 0.1;
constexpr double kSureSds = 3.0;
/// 0.02 mm a minute: about a millimetre in the hour that a recording takes.
constexpr double kDriftMatters_m_per_s = 2e-5 / 60.0;
constexpr double kShortestStand_s = 60.0;
constexpr double kTooNoisy = 3.0;
constexpr std::size_t kFewestOfStand = 60;

std::string axisName(int axis, double sign) {
  return std::string(sign < 0.0 ? "-" : "+") + static_cast<char>('x' + axis);
}

/// The axis and side along which a vector is longest: "-y".
std::string mainAxis(const Eigen::Vector3d& vector) {
  Eigen::Index axis = 0;
  vector.cwiseAbs().maxCoeff(&axis);
  return axisName(static_cast<int>(axis), vector[axis]);
}

std::string mmText(double metres) { return significantText(1000.0 * metres, 2) + " mm"; }
std::string perMinute(double m_per_s) { return significantText(60000.0 * m_per_s, 2) + " mm a minute"; }
std::string secondsText(double s) { return fixedText(s, 0) + " s"; }

/// What was seen of unit moves along x, y and z: one a column; none where they are not three or not at right angles.
std::optional<Eigen::Matrix3d> unitMoves(const Moves& moves) {
  Eigen::Matrix3d seen;
  for (int axis = 0; axis < 3; ++axis) {
    const auto& move = moves[static_cast<std::size_t>(axis)];
    if (!move || move->norm() <= 0.0) return std::nullopt;
    seen.col(axis) = move->normalized();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(seen);
  return svd.singularValues()[2] < kLeastSpread ? std::nullopt : std::optional(seen);
}

bool allMade(const Moves& moves) {
  return std::all_of(moves.begin(), moves.end(), [](const auto& move) { return move.has_value(); });
}

Answer notAtRightAngles() {
  return {Verdict::kNotKnown,
          "the three moves were not at right angles: move the sensor again, along one axis at a time"};
}

std::string sideText(const Eigen::Vector3d& position_m) {
  return fixedText(position_m.norm(), 2) + " m from the transmitter, on its side " + mainAxis(position_m);
}

/// The component along the side that is set; none where none is.
std::optional<double> towards_m(const Eigen::Vector3d& position_m, const std::string& hemisphere) {
  if (hemisphere.size() != 2 || hemisphere[1] < 'x' || hemisphere[1] > 'z') return std::nullopt;
  return (hemisphere[0] == '-' ? -1.0 : 1.0) * position_m[hemisphere[1] - 'x'];
}

std::string oppositeText(const std::string& hemisphere) {
  if (hemisphere.size() != 2) return "the opposite hemisphere";
  return "hemisphere " + std::string(hemisphere[0] == '-' ? "+" : "-") + hemisphere[1] + " in place of " + hemisphere;
}

/// That there may be less noise than is told.
std::string leastText(const SignalReport& report) {
  constexpr double kRounding = 1.001;
  if (report.noise->sds_m[2] > kRounding * report.least_sd_m) return {};
  return " (along an axis no less than " + mmText(report.least_sd_m) + " is told)";
}

std::string lineText(const SignalReport& report) {
  if (!report.spectrum || report.spectrum->lines.empty()) return {};
  const recording::SpectralLine& line = report.spectrum->lines.front();
  const auto sources = recording::lineSources(line.frequency_hz, report.rate_hz, std::max(0.3, 2.0 * line.error_hz));
  return "; a line stands out at " + fixedText(line.frequency_hz, 1) + " Hz" +
         (sources.empty() ? std::string() : ", as " + sources.front().name + " makes one");
}

/// By how much the tracker's frame is turned from the person's, whose axes it saw as those columns.
Eigen::AngleAxisd turnOf(const Eigen::Matrix3d& seen) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(seen, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return Eigen::AngleAxisd(Eigen::Matrix3d(svd.matrixV() * svd.matrixU().transpose()));
}

}  // namespace

void AxisMoves::begin() {
  asked_ = 0;
  from_m_.reset();
  moves_ = {};
}

void AxisMoves::add(const std::optional<Eigen::Vector3d>& rests_at_m) {
  if (!asked_ || !rests_at_m) return;
  if (!from_m_) {
    from_m_ = rests_at_m;
    return;
  }
  const Eigen::Vector3d went_m = *rests_at_m - *from_m_;
  if (went_m.norm() < kLeast_m) return;
  moves_[static_cast<std::size_t>(*asked_)] = went_m;
  from_m_ = rests_at_m;
  asked_ = *asked_ < 2 ? std::optional(*asked_ + 1) : std::nullopt;
}

Answer hemisphereAnswer(const SignalReport& report, const Moves& moves, const std::string& hemisphere) {
  if (const auto flipped = report.marks.find("flipped"); flipped != report.marks.end()) {
    return {Verdict::kLook, std::to_string(flipped->second) +
                                " readings jumped to the mirrored side of the transmitter: choose the hemisphere on "
                                "which the sensor stays"};
  }
  if (!report.newest) return {Verdict::kNotKnown, "no reading has come yet"};
  const Eigen::Vector3d position_m = report.stand.value_or(report.newest->tracker_from_sensor).position_m;
  if (const auto side_m = towards_m(position_m, hemisphere); side_m && *side_m < kNearTheEdge * position_m.norm()) {
    return {Verdict::kLook, "the sensor is " + mmText(std::max(0.0, *side_m)) +
                                " from the plane through the transmitter where the side " + hemisphere +
                                " ends, and beyond it readings are mirrored: choose the side it stays on"};
  }
  if (allMade(moves)) {
    const auto seen = unitMoves(moves);
    if (!seen) return notAtRightAngles();
    if (seen->determinant() > 0.0) return {Verdict::kGood, "yes: the three moves came out right-handed"};
    return {Verdict::kLook,
            "no: the three moves came out left-handed, as they do where readings are mirrored: connect with " +
                oppositeText(hemisphere)};
  }
  return {Verdict::kNotKnown, "the tracker sees the sensor " + sideText(position_m) +
                                  ": if it is on the other side, or to be sure, move it along the axes"};
}

Answer axesAnswer(const Moves& moves) {
  if (!allMade(moves)) {
    return {Verdict::kNotKnown, "move the sensor along x, y and z as you think they go, resting in between"};
  }
  const auto seen = unitMoves(moves);
  if (!seen) return notAtRightAngles();
  const bool is_mirrored = seen->determinant() < 0.0;
  const Eigen::AngleAxisd turn = turnOf(is_mirrored ? Eigen::Matrix3d(-*seen) : *seen);
  std::string differing;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string meant = axisName(axis, 1.0), came = mainAxis(seen->col(axis));
    if (came == meant) continue;
    if (!differing.empty()) differing += ", ";
    differing += meant;
    differing += " came out as ";
    differing += came;
  }
  if (differing.empty() && turn.angle() < kHand_rad) {
    return {Verdict::kGood,
            "yes: x, y and z go where you think, within " + fixedText(turn.angle() / kDegree, 0) + " degrees"};
  }
  std::string text = "no: " + (differing.empty() ? std::string("the axes are askew") : differing);
  if (is_mirrored) text += "; set the hemisphere right first";
  if (turn.angle() >= kHand_rad) {
    text += "; the transmitter stands turned by " + fixedText(turn.angle() / kDegree, 0) + " degrees about " +
            mainAxis(turn.axis()) + " from what you think";
  }
  return {Verdict::kLook, text};
}

Answer warmUpAnswer(const SignalReport& report) {
  if (report.rested_s <= 0.0) return {Verdict::kNotKnown, "the sensor moves: lay it down for a minute"};
  if (!report.drift || report.rested_s < kShortestStand_s) {
    return {Verdict::kNotKnown, "let the sensor lie for a minute: " + secondsText(report.rested_s) + " so far"};
  }
  const double speed = report.drift->m_per_s.norm(), sd = report.drift->sd_m_per_s;
  if (speed > kSureSds * sd && speed > kDriftMatters_m_per_s) {
    return {Verdict::kLook, "it drifts by " + perMinute(speed) + ": wait until it is steady, or look for what moves"};
  }
  const double most = speed + 2.0 * sd;
  if (most <= kDriftMatters_m_per_s) {
    return {Verdict::kGood, "no: steady to less than " + perMinute(most) + " over " + secondsText(report.rested_s)};
  }
  return {Verdict::kNotKnown, "not to be told from the noise yet: less than " + perMinute(most) + " over " +
                                  secondsText(report.rested_s) + "; let it lie longer"};
}

Answer noiseAnswer(const SignalReport& report, const std::optional<double>& expected_sd_m) {
  if (!report.noise || report.of_stand < kFewestOfStand) {
    return {Verdict::kNotKnown, "the sensor moves, or has just come to rest: let it lie for a few seconds"};
  }
  const double sd_m = report.noise->sd_m();
  const std::string seen = "SD " + mmText(sd_m) + " at " + fixedText(report.stand->position_m.norm(), 2) + " m";
  const std::string more = leastText(report) + lineText(report);
  if (report.correlation >= 1.0) {
    return {Verdict::kLook, "every reading is the same: the tracker is stuck, or its step hides its noise"};
  }
  if (!expected_sd_m) {
    return {Verdict::kNotKnown, seen + "; what this tracker should have there is not known" + more};
  }
  const std::string expected = seen + ", where about " + mmText(*expected_sd_m) + " is to be expected";
  if (sd_m > kTooNoisy * *expected_sd_m) {
    return {Verdict::kLook,
            "no: " + expected + more + ": look for mains, monitors, motors and other transmitters nearby"};
  }
  return {Verdict::kGood, "yes: " + expected + more};
}

}  // namespace fieldtrue::acquisition
