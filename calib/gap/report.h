#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/place_name.h"
#include "calib/core/pose.h"
#include "calib/identify/origin.h"
#include "calib/recording/finding.h"

namespace fieldtrue::gap {

enum class GapVerdict { kNoGap, kExplained, kPartlyExplained, kUnexplained };
/// "no_gap", "explained", "partly_explained", "unexplained".
std::string_view idOf(GapVerdict verdict);

/// A number with its 90 % interval; an end that cannot be estimated is unset.
struct Estimate {
  std::string name;  ///< With its unit.
  std::string unit;
  double value = 0.0;
  std::optional<double> low90;
  std::optional<double> high90;
};

/// Rivals that stand in the ranking beside the effects and `none`.
inline constexpr const char* kUnnamedSmooth = "unnamed_smooth";
inline constexpr const char* kUnnamedScattered = "unnamed_scattered";
bool isNameless(const std::string& effect);

/// How far the gap shrinks on places the fit did not see. An excess is a mean square less the floor's, signed; in mm it
/// is sign(x) sqrt|x|.
struct Shrinkage {
  double before_mm = 0.0;
  double after_mm = 0.0;
  double fraction = 0.0;  ///< 1 - excess after / excess before; not a number where there is none before.
  std::optional<double> low90;
  std::optional<double> high90;
};

/// One cause considered: every effect that can be fitted on this table, and `none`.
struct GapCandidate {
  std::string effect;
  std::vector<std::string> equivalents;  ///< Effects it cannot be told from on this grid, itself included.
  double probability = 0.0;              ///< Over all candidates they sum to 1.
  double bic_gain = 0.0;                 ///< Above 0: better than without.
  std::vector<Estimate> parameters;
  std::optional<Eigen::Vector3d> location_m;  ///< Tracker frame.
  std::optional<Eigen::Matrix3d> location_covariance_m2;
  std::optional<std::string> material;
  Shrinkage shrinkage;
  bool is_plausible = true;
  std::string doubt;                ///< Why it is not plausible.
  nlohmann::json scene_parameters;  ///< As a scene's effect holds them; null for `none`.
};

struct SelectedEffect : GapCandidate {
  double credit_fraction = 0.0;  ///< Share of the shrinkage, averaged over the orders of adding (Shapley 1953).
  double excess2_before_mm2 = 0.0;
  double excess2_after_mm2 = 0.0;
};

/// The gap at one row of the table, after the alignment.
struct GapNode {
  int node = 0;
  int visit = 0;
  int sensor = 0;
  Eigen::Vector3d place_m = Eigen::Vector3d::Zero();     ///< Where the rig says the sensor was, tracker frame.
  Eigen::Vector3d before_m = Eigen::Vector3d::Zero();    ///< Tracked minus simulated by the scene as given.
  Eigen::Vector3d after_m = Eigen::Vector3d::Zero();     ///< Tracked minus simulated with the selected effects.
  Eigen::Vector3d before_rad = Eigen::Vector3d::Zero();  ///< Rotation from simulated to tracked, tracker frame.
  Eigen::Vector3d after_rad = Eigen::Vector3d::Zero();
  double excess = 0.0;  ///< In floors: 0 where the gap is no larger than noise.
  bool is_flagged = false;
};

struct GapChannel {
  std::string name;  ///< `x`, `y`, `z`, `radial`, `transverse`, `rotation_x`...
  std::string unit;
  double rms = 0.0;
  double floor = 0.0;
};

/// RMS of the gap in a bin: of range [m], time [s], or a layer's height [m] (then both ends are the same).
struct GapBin {
  double low = 0.0;
  double high = 0.0;
  double rms_mm = 0.0;
  double floor_mm = 0.0;
};

struct Hotspot {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();  ///< Tracker frame.
  double radius_m = 0.0;
  std::optional<double> sd_m;    ///< Of the centre, of all three axes together: by drawing the places again.
  std::optional<double> half_m;  ///< From the centre, beyond which less than half of the gap there is left.
};

/// What shape a thing in the room has by how it answers along each of its axes.
enum class Shape { kUnclear, kBody, kFlatOrLoop, kLongConductor, kIronBar, kIronSheet };
inline constexpr std::array kShapes = {Shape::kUnclear,       Shape::kBody,    Shape::kFlatOrLoop,
                                       Shape::kLongConductor, Shape::kIronBar, Shape::kIronSheet};
/// "unclear", "body", "flat_or_loop", "long_conductor", "iron_bar", "iron_sheet".
std::string_view idOf(Shape shape);

/// The thing in the room that bends the readings most, as one dipole of any polarizability; tracker frame.
struct SourceShape {
  Shape shape = Shape::kUnclear;
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d values_m3 = Eigen::Vector3d::Zero();  ///< Principal polarizabilities, the largest first.
  Eigen::Vector3d sds_m3 = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< Unit columns, in the order of the values.
};

struct IsolabilityPair {
  std::string a;
  std::string b;
  double r2 = 0.0;  ///< Share of the smaller imitation: how much of a's signal b can imitate, and of b's a; the less.
  /// RMS signal over noise, per channel, from which they are told apart, wrong once in fifty, at nine of ten places of
  /// either; none: not by any strength, or not asked for.
  std::optional<double> told_apart_from;
};

struct Isolability {
  std::vector<IsolabilityPair> pairs;
  std::vector<std::string> warnings;
};

/// One bar of the way from the start to the floor.
struct GapStep {
  std::string effect;      ///< "" for the start.
  double excess_mm = 0.0;  ///< Held out, with this and all effects before it.
  std::optional<double> low90_mm;
  std::optional<double> high90_mm;
  std::optional<double> excess_deg = std::nullopt;  ///< The same of rotations; none where the tracker tells none.
  std::optional<double> low90_deg = std::nullopt;
  std::optional<double> high90_deg = std::nullopt;
};

struct SmallestDetectable {
  std::string effect;
  std::string parameter;
  double value = 0.0;
  std::string unit;
};

/// What would happen at the worst places were an effect taken away: to be checked by doing so.
struct Prediction {
  std::string effect;
  std::size_t selected = 0;  ///< Which of the selected effects it is.
  int node = 0;
  double now_mm = 0.0;
  double then_mm = 0.0;
  double then_sd_mm = 0.0;
};

/// What is left with all selected effects, on places the fit did not see.
struct Remaining {
  double position_rms_mm = 0.0;
  double fraction = 1.0;  ///< Excess left over the excess at the start; signed, never clamped.
  std::optional<double> low90;
  std::optional<double> high90;
  bool is_of_rotation = false;  ///< The fraction is of rotations: positions do not stand out of the floor.
  double excess2_before_mm2 = 0.0;
  double excess2_after_mm2 = 0.0;
  double p50_mm = 0.0;
  double p90_mm = 0.0;
  double p95_mm = 0.0;
  double worst_mm = 0.0;
  int worst_node = 0;
  std::vector<int> where;
};

/// The selected effects, or those that were refused, against a smooth field without a name.
struct RivalReport {
  double nats_over_unnamed = 0.0;  ///< Log evidence over a smooth field alone, every parameter counted.
  double unnamed_nats = 0.0;       ///< Of the smooth field alone over noise alone.
  double unseen_gain = 0.0;        ///< Better foretold in blocks not seen, in noise variances a place.
  std::optional<double> unseen_gain_low90;
  double named_share = 1.0;          ///< Of what effects and a smooth rest take, what the effects take.
  std::vector<std::string> refused;  ///< Effects that fit together and are not named.
  std::string why;                   ///< A sentence; empty where nothing was refused.
};

/// How often recordings made again under the diagnosis are named as this one was.
struct Replicates {
  int n = 0;
  int named_right = 0;
  std::optional<double> within_m_median;  ///< From what stands in the room to where it was found again.
  std::string runner_up;                  ///< Likeliest other cause; "" where there is none.
  int runner_up_n = 0;
  int runner_up_named_right = 0;
  int runner_up_named_as_this = 0;
  std::string text;
};

/// What changed since an earlier recording.
struct Against {
  bool changed = false;
  double p_value = 1.0;                       ///< At most so often two recordings of one field differ as much.
  double rms_mm = 0.0;                        ///< Of the change of positions, above the noise.
  std::optional<Eigen::Vector3d> location_m;  ///< Of what is named, else where positions changed most; tracker frame.
  std::string effect;                         ///< "" where nothing is named.
};

/// All that a diagnosis found; `*.gap.json` is this struct (design contract `fieldtrue.gap/1`).
struct GapReport {
  struct Input {
    int places = 0;
    int rows = 0;
    int samples = 0;
    int orientations = 1;
    bool position_only = false;
  } input;
  Pose tracker_from_reference;
  Pose sensor_from_mount;                   ///< Of the first sensor.
  std::map<int, Pose> sensors_from_mounts;  ///< Of each, by its number.
  GapVerdict verdict = GapVerdict::kNoGap;
  std::string text;  ///< One sentence: what was found, how sure, what to do.
  std::vector<SmallestDetectable> smallest_detectable;
  double position_rms_mm = 0.0;
  std::optional<double> orientation_rms_deg;
  double floor_position_mm = 0.0;
  std::optional<double> floor_orientation_deg;
  double ratio_to_floor = 0.0;  ///< RMS over rows and channels, each in units of its own noise.
  double p_value = 1.0;
  std::vector<GapNode> nodes;
  PlaceNames names;  ///< What the places are called; not in the document.
  std::optional<Hotspot> hotspot;
  std::optional<SourceShape> source_shape;
  std::vector<GapChannel> channels;
  std::vector<GapBin> by_range;
  std::vector<GapBin> by_layer;
  std::vector<GapBin> by_time;
  identify::GapOrigin origin;
  std::vector<recording::GapFinding> findings;
  std::vector<GapCandidate> candidates;  ///< Best first.
  std::vector<SelectedEffect> selected;  ///< In the order they were added.
  std::vector<GapStep> sequence;         ///< Start, then after each selected effect.
  Remaining remaining;
  RivalReport rival;
  std::optional<Replicates> replicates;
  std::optional<Against> against;
  std::optional<double> odds_over_next;  ///< Of the first candidate over the second.
  std::string not_looked_for;            ///< Why causes of a gap were not, half a sentence; empty where they were.
  Isolability isolability;
  std::string next_measurement;
  std::vector<std::string> next_separates;
  std::vector<Prediction> predictions;
};

/// Whether the selected causes leave no more of the squared gap than *explained* allows, 95 % sure, by an interval that
/// is narrower than what is between that and *unexplained*; where not, the word means only that these places show
/// nothing else.
bool isSurelyExplained(const GapReport& report);

/// One sentence: how far readings lie off that no fit saw, with the causes that are named added: the middle, 90 and 95
/// % of them, and the worst.
std::string howFarOffText(const GapReport& report);

}  // namespace fieldtrue::gap
