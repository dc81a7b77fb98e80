#include "calib/gap/two_recordings.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "calib/identify/field_comparison.h"

namespace fieldtrue::gap {

Result<std::unique_ptr<Recording>> recordingOf(const CalibrationTable& table, const identify::Thresholds& thresholds) {
  auto recording = std::make_unique<Recording>();
  recording->cleaned = recording::cleanRows(table);
  FT_TRY(recording->rows, identify::makeGapRows(recording->cleaned.nodes, table.metadata, thresholds));
  recording->search =
      std::make_unique<identify::GapSearch>(recording->rows, std::vector<std::unique_ptr<field::PhysicalEffect>>{},
                                            identify::NoiseFrom::kResiduals, thresholds);
  return recording;
}

std::vector<int> placesBefore(const Recording& before, const Recording& now) {
  constexpr double kSame_m = 1e-3;
  std::map<int, std::pair<int, Eigen::Vector3d>> known;
  for (const identify::GapRow& row : before.rows.rows)
    known.emplace(row.node, std::pair{static_cast<int>(row.place), row.reference_from_sensor.position_m});
  std::vector<int> places;
  for (const identify::GapRow& row : now.rows.rows) {
    const auto found = known.find(row.node);
    const bool same =
        found != known.end() && (found->second.second - row.reference_from_sensor.position_m).norm() < kSame_m;
    places.push_back(same ? found->second.first : static_cast<int>(before.rows.place_nodes.size() + row.place));
  }
  return places;
}

std::vector<std::size_t> evenlyPlaced(const identify::GapRows& rows, std::size_t most) {
  std::vector<std::size_t> order(rows.rows.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t i) {
    const Eigen::Vector3d& p = rows.rows[i].reference_from_sensor.position_m;
    return std::tuple(p.z(), p.y(), p.x(), rows.rows[i].visit, rows.rows[i].sensor);
  };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  std::vector<std::size_t> chosen;
  for (const std::size_t k : identify::evenChoice(order.size(), most)) chosen.push_back(order[k]);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

identify::FieldReadings someOfBoth(const Recording& before, const Recording& now, const Alignments& alignments,
                                   std::span<const int> places, bool rotation) {
  constexpr std::size_t kRowsForTest = 200;  // Of each recording.
  const std::vector<std::size_t> some = evenlyPlaced(now.rows, kRowsForTest);
  std::vector<int> some_places;
  for (const std::size_t i : some) some_places.push_back(places[i]);
  const identify::FieldReadings earlier = identify::readingsOf(*before.search, alignments.before, rotation);
  const identify::FieldReadings later = identify::readingsOf(*now.search, alignments.now, rotation);
  return identify::joined(earlier.only(evenlyPlaced(before.rows, kRowsForTest)), later.only(some), some_places);
}

namespace {

/// A small move: metres, then radians about the tracker's origin.
Pose moveBy(const Eigen::Matrix<double, 6, 1>& by) { return {by.head<3>(), rotationFromVector(by.tail<3>())}; }

identify::GapAlignment withRigAt(const Recording& recording, identify::GapAlignment alignment,
                                 const Pose& tracker_from_reference) {
  alignment.tracker_from_reference = tracker_from_reference;
  if (!recording.rows.has_orientation) return alignment;
  const std::vector<Eigen::Quaterniond> mountings = identify::meanMountings(recording.rows, tracker_from_reference);
  for (std::size_t s = 0; s < mountings.size(); ++s) alignment.mount_from_sensor[s].orientation = mountings[s];
  return alignment;
}

class CommonAlignment {
 public:
  CommonAlignment(const Recording& before, const Recording& now, std::span<const int> places)
      : before_(before),
        now_(now),
        places_(places),
        found_{before.search->none().model.alignment, now.search->none().model.alignment} {}

  Alignments run() {
    begin();
    settleRig();
    if (before_.rows.has_orientation && now_.rows.has_orientation) settleMounts();
    return found_;
  }

 private:
  static constexpr int kRounds = 12;
  static constexpr double kSettled = 1e-4;  // Metres, radians.

  identify::FieldReadings readings(const Alignments& alignments, bool rotation) const {
    return someOfBoth(before_, now_, alignments, places_, rotation);
  }

  /// The rig where the earlier recording had it, or where the later one alone would put it.
  void begin() {
    const Alignments as_before{found_.before, withRigAt(now_, found_.now, found_.before.tracker_from_reference)};
    const identify::FieldReadings one = readings(found_, false);
    identify::SharedLaw law;
    law.field.length_m = 0.5;
    law.field.by_place = std::sqrt(one.values.squaredNorm() / static_cast<double>(one.values.size()));
    if (identify::SharedField(readings(as_before, false), law).logEvidence() >
        identify::SharedField(one, law).logEvidence())
      found_ = as_before;
  }

  void settleRig() {
    const identify::SharedLaw law = identify::likeliestSharedLaw(readings(found_, false), {});
    Eigen::VectorXd so_far;
    for (int round = 0; round < kRounds; ++round) {
      const auto [of_before, of_now] = step(law, false, so_far);
      for (const auto& [recording, alignment, by] :
           {std::tuple(&before_, &found_.before, &of_before), std::tuple(&now_, &found_.now, &of_now)}) {
        moveLevers(by->tail(by->size() - 6), *alignment);
        *alignment = withRigAt(*recording, *alignment, moveBy(by->head<6>()) * alignment->tracker_from_reference);
      }
      if (std::max(of_before.norm(), of_now.norm()) < kSettled) break;
    }
  }

  void settleMounts() {
    const bool several = before_.rows.several_orientations || now_.rows.several_orientations;
    const identify::SharedLaw law = identify::likeliestSharedLaw(readings(found_, true), {.turn = several});
    Eigen::VectorXd so_far;
    for (int round = 0; round < kRounds; ++round) {
      const auto [of_before, of_now] = step(law, true, so_far);
      turnMounts(of_before, before_, found_.before);
      turnMounts(of_now, now_, found_.now);
      if (std::max(of_before.norm(), of_now.norm()) < kSettled) break;
    }
  }

  /// What the earlier and the later alignment still have to move by.
  /// @param so_far what they moved by since the start, about which the prior is: else what no reading tells would drift
  std::pair<Eigen::VectorXd, Eigen::VectorXd> step(const identify::SharedLaw& law, bool rotation,
                                                   Eigen::VectorXd& so_far) const {
    identify::FieldReadings both = readings(found_, rotation);
    const std::size_t columns = both.free.size();
    if (so_far.size() == 0) so_far = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(columns));
    for (std::size_t c = 0; c < columns; ++c) both.values += so_far[static_cast<Eigen::Index>(c)] * both.free[c];
    const Eigen::VectorXd all = identify::SharedField(both, law).refitted();
    const Eigen::VectorXd by = all - so_far;
    so_far = all;
    const auto first = static_cast<Eigen::Index>(both.free_of_earlier);
    return {by.head(first), by.tail(by.size() - first)};
  }

  /// @param by a shift of each sensor, its own frame
  static void moveLevers(const Eigen::VectorXd& by, identify::GapAlignment& alignment) {
    for (Eigen::Index s = 0; 3 * s < by.size(); ++s) {
      Pose& mount = alignment.mount_from_sensor[static_cast<std::size_t>(s)];
      mount.position_m += mount.orientation * by.segment<3>(3 * s);
    }
  }

  /// @param by a turn of all readings, then one of each sensor in its own frame; with one orientation alone, where the
  /// two are the same, the first only
  static void turnMounts(const Eigen::VectorXd& by, const Recording& recording, identify::GapAlignment& alignment) {
    const Eigen::Quaterniond tracker_from_mount =
        alignment.tracker_from_reference.orientation * recording.rows.rows.front().reference_from_sensor.orientation;
    for (std::size_t s = 0; s < alignment.mount_from_sensor.size(); ++s) {
      Eigen::Quaterniond& mount = alignment.mount_from_sensor[s].orientation;
      const Eigen::Vector3d turn = recording.rows.several_orientations
                                       ? by.segment<3>(3 + 3 * static_cast<Eigen::Index>(s))
                                       : (tracker_from_mount * mount).conjugate() * by.head<3>();
      mount = (mount * rotationFromVector(turn)).normalized();
    }
  }

  const Recording& before_;
  const Recording& now_;
  std::span<const int> places_;
  Alignments found_;
};

}  // namespace

Alignments alignedTogether(const Recording& before, const Recording& now, std::span<const int> places) {
  return CommonAlignment(before, now, places).run();
}

}  // namespace fieldtrue::gap
