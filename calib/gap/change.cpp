#include "calib/gap/change.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "calib/core/file_io.h"
#include "calib/core/units.h"
#include "calib/gap/two_recordings.h"
#include "calib/gap/verdict.h"
#include "calib/identify/field_comparison.h"

namespace fieldtrue::gap {
namespace {

constexpr std::size_t kRowsForField = 500;  ///< Of the earlier one, to foretell what it would have read.

/// What would have been read at one row, metres or radians beside the alignment, and the variance of each component.
struct Foretold {
  Eigen::Vector3d value;
  double variance = 0.0;
};

/// Positions or rotations of both recordings: whether they changed, and what the earlier one foretells of the later.
class Channel {
 public:
  Channel(const Recording& before, const Recording& now, const Alignments& alignments, std::span<const int> places,
          bool rotation)
      : earlier_(identify::readingsOf(*before.search, alignments.before, rotation)
                     .only(evenlyPlaced(before.rows, kRowsForField))),
        later_(identify::readingsOf(*now.search, alignments.now, rotation)),
        both_(someOfBoth(before, now, alignments, places, rotation)),
        places_(places.begin(), places.end()),
        pitch_m_(std::max(before.search->design().pitch_m, now.search->design().pitch_m)),
        thresholds_(now.search->thresholds()) {
    parts_.turn = before.rows.several_orientations || now.rows.several_orientations;
    earlier_.free.clear();  // The alignment is settled: what it leaves is of the field.
  }

  void run(const RunControl& control) {
    found_ = identify::compareFields(both_, parts_, pitch_m_, thresholds_, control);
    const identify::SharedField field(earlier_, found_.earlier);
    for (std::size_t i = 0; i < later_.size(); ++i)
      foretold_.push_back(
          {field.sharedAt(later_.points[i], places_[i]), field.sharedVarianceAt(later_.points[i], places_[i])});
  }
  const identify::FieldComparison& found() const { return found_; }
  /// SD of each component about any smooth field, of the earlier or of the later recording.
  double scatter(bool of_later) const {
    const identify::FieldReadings& own = of_later ? later_ : earlier_;
    return found_.law.noiseFactor(of_later) * std::sqrt(own.variances.mean());
  }
  /// What the earlier recording would have read at the later one's rows.
  const std::vector<Foretold>& foretold() const { return foretold_; }

  /// How far a reading is from what is foretold, in SDs of a component of noise, placing and what is foretold.
  double farOff(std::size_t row) const {
    const auto i = static_cast<Eigen::Index>(row);
    const Eigen::Vector3d off = later_.values.row(i).transpose() - foretold_[row].value;
    return off.norm() / std::sqrt(3.0 * (later_.variances[i] + foretold_[row].variance));
  }

  std::vector<Eigen::Vector3d> change() const {
    const identify::SharedField field(both_, found_.earlier, found_.change);
    std::vector<Eigen::Vector3d> change;
    for (const identify::FieldPoint& point : later_.points) change.push_back(field.changeAt(point));
    return change;
  }

  /// A reading counts where what is foretold is no less sure than itself, or at least far surer than without any.
  bool knows(std::size_t row) const {
    const identify::SmoothLaw& law = found_.earlier.field;
    const double unknown = law.by_place * law.by_place + law.by_turn * law.by_turn;
    return foretold_[row].variance <=
               std::max(later_.variances[static_cast<Eigen::Index>(row)], thresholds_.far_surer * unknown) &&
           nearestBefore_m(row) <= 2.0 * pitch_m_;
  }

 private:
  double nearestBefore_m(std::size_t row) const {
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const identify::FieldPoint& point : earlier_.points)
      nearest_m = std::min(nearest_m, (point.place_m - later_.points[row].place_m).norm());
    return nearest_m;
  }

  identify::FieldReadings earlier_;
  identify::FieldReadings later_;
  identify::FieldReadings both_;
  std::vector<int> places_;
  double pitch_m_;
  identify::Thresholds thresholds_;
  identify::SmoothParts parts_;
  identify::FieldComparison found_;
  std::vector<Foretold> foretold_;
};

/// Positions changed, rotations did, or both: each as likely beforehand.
double jointLogOdds(double of_positions, const std::optional<double>& of_rotations) {
  if (!of_rotations) return of_positions;
  const double both = of_positions + *of_rotations;
  const double most = std::max({of_positions, *of_rotations, both});
  return most +
         std::log((std::exp(of_positions - most) + std::exp(*of_rotations - most) + std::exp(both - most)) / 3.0);
}

/// The middle of what changed by half of the largest and more, weighed by its square, around where that is: two far
/// edges that changed alike have no middle.
Eigen::Vector3d hottest(const std::vector<Eigen::Vector3d>& change, const std::vector<field::SensorSetting>& settings,
                        const std::vector<char>& known) {
  constexpr double kAround = 0.25;  // Of the way to the farthest.
  const auto at_m = [&](std::size_t i) { return settings[i].tracker_from_sensor.position_m; };
  std::size_t top = 0;
  double most = -1.0;
  for (std::size_t i = 0; i < change.size(); ++i) {
    if (known[i] == 0 || change[i].norm() <= most) continue;
    top = i;
    most = change[i].norm();
  }
  double farthest_m = 0.0;
  for (std::size_t i = 0; i < change.size(); ++i)
    if (known[i] != 0) farthest_m = std::max(farthest_m, (at_m(i) - at_m(top)).norm());
  Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
  double weights = 0.0;
  for (std::size_t i = 0; i < change.size(); ++i) {
    if (known[i] == 0 || change[i].norm() < 0.5 * most || (at_m(i) - at_m(top)).norm() > kAround * farthest_m) continue;
    sum_m += change[i].squaredNorm() * at_m(i);
    weights += change[i].squaredNorm();
  }
  return sum_m / weights;
}

/// Where most places are the same: how far the whole rig stands from where it stood.
void describeRig(const Recording& before, const Recording& now, const Alignments& alignments,
                 std::span<const int> places, RecordingChange& change) {
  const auto is_old = [&](int place) { return static_cast<std::size_t>(place) < before.rows.place_nodes.size(); };
  if (2 * std::count_if(places.begin(), places.end(), is_old) < static_cast<std::ptrdiff_t>(places.size())) return;
  const Pose& was = alignments.before.tracker_from_reference;
  const Pose& is = alignments.now.tracker_from_reference;
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
  for (const identify::GapRow& row : now.rows.rows)
    middle_m += row.reference_from_sensor.position_m / static_cast<double>(now.rows.rows.size());
  change.rig_moved_mm = 1e3 * (is * middle_m - was * middle_m).norm();
  change.rig_turned_deg = kDegPerRad * angleBetween_rad(was.orientation, is.orientation);
}

/// What the later table states, where what both recordings share of the rig's errors is no placing any more.
TableMetadata metadataOfChange(TableMetadata metadata, const std::vector<Channel>& channels) {
  metadata.alignment_known = false;
  const auto own_share = [](const Channel& channel) { return std::sqrt(1.0 - channel.found().earlier.rig_share); };
  if (metadata.jig_tolerance_m) *metadata.jig_tolerance_m *= own_share(channels[0]);
  if (metadata.jig_tolerance_rad && channels.size() > 1) *metadata.jig_tolerance_rad *= own_share(channels[1]);
  return metadata;
}

/// The later rows where the earlier recording tells the field, each held to stand where that would have reported it.
recording::Cleaned rowsOfChange(const Recording& now, const Alignments& alignments,
                                const std::vector<Channel>& channels, const std::vector<char>& known) {
  const bool has_rotation = channels.size() > 1;
  recording::Cleaned change{{}, now.cleaned.findings, now.cleaned.names};
  const std::vector<field::SensorSetting> settings = now.search->physics().settings(alignments.now);
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (known[i] == 0) continue;
    Node node = now.cleaned.nodes[i];
    const double n = std::max(1.0, node.n_effective);
    const Foretold& place = channels[0].foretold()[i];
    node.reference_from_sensor = settings[i].tracker_from_sensor;
    node.reference_from_sensor.position_m += place.value;
    node.covariance_m2 =
        node.covariance_m2.value_or(Eigen::Matrix3d::Zero()) + n * place.variance * Eigen::Matrix3d::Identity();
    node.has_orientation = node.has_orientation && has_rotation;
    if (has_rotation) {
      const Foretold& turn = channels[1].foretold()[i];
      node.reference_from_sensor.orientation = rotationFromVector(turn.value) * node.reference_from_sensor.orientation;
      node.sd_rot_rad = std::sqrt(std::pow(node.sd_rot_rad.value_or(0.0), 2) + 3.0 * n * turn.variance);
    }
    change.nodes.push_back(node);
  }
  return change;
}

/// Bound of the tail of chi-square of three numbers a place, as shares of their variance.
/// @source Chernoff 1952: P(chi2_k >= k x) <= exp(-k/2 (x - 1 - ln x))
double tailOfPlaces(double n_places, double share) {
  return std::exp(-1.5 * n_places * (share - 1.0 - std::log(share)));
}

/// Of the later readings about what the earlier recording foretells, of them all or of those that are far off.
double astrayPValue(const Recording& now, const std::vector<Channel>& channels, const std::vector<char>& known,
                    const RecordingChange& change, const identify::Thresholds& thresholds) {
  const double bound_mm = 1e3 * identify::worstPlacing_m(now.rows, thresholds);
  const double ratio = change.scatter_now_mm / bound_mm;
  if (ratio > thresholds.clearly_scattered &&
      change.scatter_now_mm > thresholds.told_scatter * change.scatter_before_mm)
    return tailOfPlaces(change.places, ratio * ratio);
  std::set<std::size_t> far;
  for (std::size_t i = 0; i < known.size(); ++i)
    for (const Channel& channel : channels)
      if (known[i] != 0 && channel.farOff(i) > thresholds.far_off) far.insert(now.rows.rows[i].place);
  if (far.size() < thresholds.fewest_far_off) return 1.0;
  return tailOfPlaces(static_cast<double>(far.size()), thresholds.far_off * thresholds.far_off);
}

/// How large the likeliest change is where the earlier recording tells the field, and where it is largest.
void describeSize(const Recording& now, const Alignments& alignments, const Channel& positions,
                  const std::vector<char>& known, double log_odds, RecordingChange& change) {
  const std::vector<Eigen::Vector3d> changed_m = positions.change();
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (known[i] == 0) continue;
    squares += changed_m[i].squaredNorm();
    count += 1.0;
  }
  const double probability = 1.0 / (1.0 + std::exp(-log_odds));
  change.rms_mm = 1e3 * probability * std::sqrt(squares / count);
  if (change.changed) change.hottest_m = hottest(changed_m, now.search->physics().settings(alignments.now), known);
}

/// What the later of two recordings shows beside the earlier one.
/// @param metadata of the later table
Result<RecordingChange> changeBetween(const Recording& before, const Recording& now, const Alignments& alignments,
                                      std::span<const int> places, const TableMetadata& metadata,
                                      const identify::Thresholds& thresholds, const RunControl& control) {
  std::vector<Channel> channels;
  for (const bool rotation : {false, true}) {
    if (rotation && !(before.rows.has_orientation && now.rows.has_orientation)) break;
    channels.emplace_back(before, now, alignments, places, rotation).run(control);
    if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "The comparison was stopped.");
  }

  std::vector<char> known;
  std::vector<char> place_known(now.rows.place_nodes.size(), 0);
  for (std::size_t i = 0; i < now.rows.rows.size(); ++i) {
    known.push_back(channels[0].knows(i) ? 1 : 0);
    if (known[i] != 0) place_known[now.rows.rows[i].place] = 1;
  }
  RecordingChange change;
  change.places = static_cast<int>(std::count(place_known.begin(), place_known.end(), char{1}));
  change.places_left_out = static_cast<int>(place_known.size()) - change.places;
  if (static_cast<std::size_t>(change.places) < thresholds.fewest_places) {
    return fail(ErrorCode::kTooFewNodes, "The earlier recording tells the field at " + std::to_string(change.places) +
                                             " places of this one; at least " +
                                             std::to_string(thresholds.fewest_places) + " are needed to compare them.");
  }
  const double log_odds = jointLogOdds(
      channels[0].found().log_odds, channels.size() > 1 ? std::optional(channels[1].found().log_odds) : std::nullopt);
  change.p_value = std::min(1.0, std::exp(-log_odds));
  change.changed = log_odds > thresholds.sure_of_change;
  change.scatter_before_mm = 1e3 * channels[0].scatter(false);
  change.scatter_now_mm = 1e3 * channels[0].scatter(true);
  if (!change.changed) change.astray_p_value = astrayPValue(now, channels, known, change, thresholds);
  change.least_shown_mm = 1e3 * std::sqrt(3.0) * channels[0].found().least_shown;
  describeSize(now, alignments, channels[0], known, log_odds, change);
  describeRig(before, now, alignments, places, change);
  change.tracker_from_reference = alignments.now.tracker_from_reference;
  for (std::size_t s = 0; s < now.rows.sensors.size(); ++s)
    change.sensors_from_mounts[now.rows.sensors[s]] = inverse(alignments.now.mount_from_sensor[s]);
  change.metadata = metadataOfChange(metadata, channels);
  change.rows = rowsOfChange(now, alignments, channels, known);
  return change;
}

}  // namespace

Result<RecordingChange> changeSince(const CalibrationTable& before_table, const CalibrationTable& now_table,
                                    const identify::Thresholds& thresholds, const RunControl& control) {
  FT_TRY(auto before, recordingOf(before_table, thresholds));
  FT_TRY(auto now, recordingOf(now_table, thresholds));
  const std::vector<int> places = placesBefore(*before, *now);
  const Alignments alignments = alignedTogether(*before, *now, places);
  FT_TRY(auto change, changeBetween(*before, *now, alignments, places, now_table.metadata, thresholds, control));
  if (change.isAstray()) return change;
  // What stood there and is gone may pass for noise of the earlier recording, and foretells nothing where it bent a few
  // places alone: asked the other way round, it is the earlier readings that show it.
  auto back = changeBetween(*now, *before, {alignments.now, alignments.before}, placesBefore(*now, *before),
                            before_table.metadata, thresholds, control);
  if (!back && back.error().code == ErrorCode::kCancelled) return tl::unexpected(back.error());
  if (!back) return change;
  // Two were asked: either may be wrong by chance.
  back->p_value = std::min(1.0, 2.0 * back->p_value);
  back->changed = back->changed && back->p_value < std::exp(-thresholds.sure_of_change);
  // What came in shows both ways; what went, clearly only this way.
  const bool is_far_surer = back->changed && back->p_value < std::pow(change.p_value, thresholds.gone_is_surer);
  if (change.changed ? !is_far_surer : !back->changed && !back->isAstray()) return change;
  back->is_gone = true;
  back->rig_moved_mm = change.rig_moved_mm;
  back->rig_turned_deg = change.rig_turned_deg;
  std::swap(back->scatter_before_mm, back->scatter_now_mm);
  return back;
}

namespace {

/// The next larger thousandth or, from a hundredth on, hundredth.
std::string howSure(double p_value) {
  const double steps = p_value < 0.01 ? 1000.0 : 100.0;
  return "p < " + formatNumber(std::min(1.0, (std::floor(p_value * steps) + 1.0) / steps));
}

std::string nothingText(const RecordingChange& change) {
  return "Nothing changed since the earlier recording that these two would show; they would show a change of about " +
         shown(change.least_shown_mm) + " mm (RMS).";
}

std::string astrayText(const RecordingChange& change, const GapReport& report) {
  if (change.is_gone) {
    return "Something is gone: the earlier readings lie off what the later recording tells of their places by more "
           "than "
           "placing does (" +
           howSure(change.astray_p_value) + "). Of what stood there: " + report.text;
  }
  return "No smooth change of the field shows, but the later readings lie off what the earlier recording foretells by "
         "more than placing does (" +
         howSure(change.astray_p_value) + "). " + report.text;
}

std::string changedText(const RecordingChange& change, const GapReport& report) {
  std::string text = "The field changed since the earlier recording (" + howSure(change.p_value) + ")";
  if (change.is_gone) text += ": something is gone";
  if (change.hottest_m)
    text += ", most near (" + shown(change.hottest_m->x()) + ", " + shown(change.hottest_m->y()) + ", " +
            shown(change.hottest_m->z()) + ") m";
  return text + (change.is_gone ? ". Of what stood there: " : ". ") + report.text;
}

void addRigMoved(const RecordingChange& change, const identify::Thresholds& thresholds, GapReport& report) {
  if (!change.rig_moved_mm) return;
  if (*change.rig_moved_mm < thresholds.told_rig_moved_mm && *change.rig_turned_deg < thresholds.told_rig_turned_deg)
    return;
  report.findings.push_back({"",
                             "The whole rig stands " + shown(*change.rig_moved_mm) + " mm and " +
                                 shown(*change.rig_turned_deg) +
                                 " degrees from where the tracker saw it before: it was set down anew, or the "
                                 "transmitter moved. That is no change of the field.",
                             {}});
}

/// Noise that grew is no field, and yet something to look for.
void addScatter(const RecordingChange& change, const identify::Thresholds& thresholds, GapReport& report) {
  const double ratio = change.scatter_now_mm / change.scatter_before_mm;
  if (ratio < thresholds.told_scatter && ratio > 1.0 / thresholds.told_scatter) return;
  report.findings.push_back({"",
                             "About any smooth field the places scatter by " + shown(change.scatter_now_mm) +
                                 " mm now and by " + shown(change.scatter_before_mm) +
                                 " mm before (SD per axis): placing, noise, or a change from place to place that no "
                                 "smooth field is.",
                             {}});
}

}  // namespace

void describeChange(const RecordingChange& change, const identify::Thresholds& thresholds, GapReport& report) {
  report.tracker_from_reference = change.tracker_from_reference;
  report.sensors_from_mounts = change.sensors_from_mounts;
  report.sensor_from_mount = change.sensors_from_mounts.begin()->second;
  Against against;
  against.changed = change.changed;
  against.p_value = change.p_value;
  against.rms_mm = change.rms_mm;
  against.location_m = change.hottest_m;
  if (!change.changed && (!change.isAstray() || report.verdict == GapVerdict::kNoGap)) {
    report.verdict = GapVerdict::kNoGap;
    report.text = nothingText(change);
  } else {
    against.changed = true;
    against.p_value = std::min(change.p_value, change.astray_p_value);
    against.rms_mm =
        std::sqrt(std::max(0.0, std::pow(report.position_rms_mm, 2) - std::pow(report.floor_position_mm, 2)));
    if (!report.selected.empty()) {
      against.effect = report.selected.front().effect;
      if (report.selected.front().location_m) against.location_m = report.selected.front().location_m;
    }
    report.text = change.changed ? changedText(change, report) : astrayText(change, report);
  }
  addRigMoved(change, thresholds, report);
  addScatter(change, thresholds, report);
  if (change.places_left_out > 0) {
    report.findings.push_back({"",
                               std::to_string(change.places_left_out) +
                                   " places are left out: the earlier recording does not tell the field there.",
                               {}});
  }
  report.against = std::move(against);
}

}  // namespace fieldtrue::gap
