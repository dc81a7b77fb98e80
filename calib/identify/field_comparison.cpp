#include "calib/identify/field_comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include "calib/core/statistics.h"

namespace fieldtrue::identify {
namespace {

double evidenceOf(const FieldReadings& readings, const SharedLaw& law) {
  return SharedField(readings, law).logEvidence();
}

double extentOf(const FieldReadings& readings) {
  Eigen::AlignedBox3d box;
  for (const FieldPoint& point : readings.points) box.extend(point.place_m);
  return std::max(1e-3, box.sizes().norm());
}

/// Each figure in turn over its ladder, until none is better.
class LawClimb {
 public:
  LawClimb(const FieldReadings& readings, const SmoothParts& parts) : readings_(readings), parts_(parts) {
    extent_m_ = extentOf(readings);
    unit_ = std::sqrt(readings.values.squaredNorm() / static_cast<double>(3 * readings.size()));
    for (std::size_t i = 0; i < readings.size(); ++i) {
      repeats_ = repeats_ || std::count(readings.places.begin(), readings.places.end(), readings.places[i]) > 1;
      has_later_ = has_later_ || readings.is_later[i] != 0;
    }
  }

  SharedLaw run() {
    constexpr int kRounds = 4;
    constexpr double kWorthARound = 0.1;  // Nats.
    SharedLaw best;
    best.field.length_m = 0.5 * extent_m_;
    best.field.by_place = unit_;
    double most = evidenceOf(readings_, best);
    for (int round = 0; round < kRounds; ++round) {
      const double before = most;
      const auto ladder = [&](std::span<const double> steps, const auto& set) {
        const SharedLaw from = best;
        for (const double step : steps) {
          SharedLaw tried = from;
          set(tried, step);
          const double evidence = evidenceOf(readings_, tried);
          if (evidence <= most) continue;
          most = evidence;
          best = tried;
        }
      };
      ladder(kLengths, [&](SharedLaw& law, double step) { law.field.length_m = step * extent_m_; });
      ladder(kSizes, [&](SharedLaw& law, double step) { law.field.by_place = step * unit_; });
      if (parts_.turn) ladder(kSizes, [&](SharedLaw& law, double step) { law.field.by_turn = step * unit_; });
      ladder(kNoise, [&](SharedLaw& law, double step) { law.noise_factor[0] = step; });
      if (has_later_) ladder(kNoise, [&](SharedLaw& law, double step) { law.noise_factor[1] = step; });
      if (repeats_) ladder(kShares, [&](SharedLaw& law, double step) { law.rig_share = step; });
      if (most - before < kWorthARound) break;
    }
    return best;
  }

 private:
  static constexpr std::array<double, 6> kLengths = {0.125, 0.25, 0.5, 1.0, 2.0, 4.0};
  static constexpr std::array<double, 7> kSizes = {0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0};
  static constexpr std::array<double, 10> kNoise = {0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0};
  static constexpr std::array<double, 5> kShares = {0.0, 0.5, 0.8, 0.95, 0.99};

  const FieldReadings& readings_;
  SmoothParts parts_;
  double extent_m_ = 1.0;
  double unit_ = 1.0;
  bool repeats_ = false;
  bool has_later_ = false;
};

/// The changes that are tried, each as likely as the other beforehand: everywhere, and about the middle of each octant.
std::vector<ChangeLaw> changesTried(const FieldReadings& readings, const SmoothParts& parts, double pitch_m) {
  constexpr double kNarrowest = 1.5;  // Pitches.
  constexpr double kReach = 0.25;     // Of the region's diagonal.
  Eigen::AlignedBox3d box;
  std::vector<double> variances;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (readings.is_later[i] == 0) continue;
    box.extend(readings.points[i].place_m);
    variances.push_back(readings.variances[static_cast<Eigen::Index>(i)]);
  }
  const double noise = std::sqrt(median(std::move(variances)));
  const auto width_m = [&](double of_box) { return std::max(of_box * box.sizes().norm(), kNarrowest * pitch_m); };
  std::vector<ChangeLaw> tried;
  for (const double width : {0.25, 0.5, 1.0}) {
    for (const double size : {0.5, 1.5, 5.0, 15.0, 50.0}) {
      tried.push_back({{.length_m = width_m(width), .by_place = size * noise}});
      if (parts.turn) tried.push_back({{.length_m = width_m(width), .by_turn = size * noise}});
    }
  }
  for (int octant = 0; octant < 8; ++octant) {
    const Eigen::Vector3d corner = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(octant));
    for (const double size : {1.5, 5.0, 15.0, 50.0})
      tried.push_back(
          {{.length_m = width_m(kReach), .by_place = size * noise}, 0.5 * (corner + box.center()), width_m(kReach)});
  }
  return tried;
}

/// log((e^a + e^b + ...) / n)
double logMean(std::span<const double> logs) {
  const double most = *std::max_element(logs.begin(), logs.end());
  double sum = 0.0;
  for (const double value : logs) sum += std::exp(value - most);
  return most + std::log(sum / static_cast<double>(logs.size()));
}

/// The smallest size of a change as wide as half the region that is to be expected to show: directions of visibility s
/// bring log odds of (s - log(1 + s)) / 2 each, in three components.
double leastShown(const SharedField& unchanged, double length_m, double noise, double log_odds) {
  constexpr double kStep = 1.1;
  const Eigen::ArrayXd of_one = unchanged.visibilityOf({{.length_m = length_m, .by_place = 1.0}});
  double size = 0.1 * noise;
  for (; size < 1e3 * noise; size *= kStep) {
    const Eigen::ArrayXd s = size * size * of_one;
    if (1.5 * (s - (1.0 + s).log()).sum() >= log_odds) break;
  }
  return size;
}

/// The same readings, each dealt anew to those that see a change and those that do not; of two readings of one place
/// one each, as it was. A field that no law here fits well looks changed however it is dealt.
FieldReadings dealt(const FieldReadings& readings, std::mt19937& draw) {
  FieldReadings anew = readings;
  std::map<int, std::vector<std::size_t>> by_place;
  for (std::size_t i = 0; i < readings.size(); ++i) by_place[readings.places[i]].push_back(i);
  std::vector<std::size_t> alone;
  for (const auto& [place, rows] : by_place) {
    const auto sees = [&](std::size_t i) { return readings.sees_change[i] != 0; };
    if (std::all_of(rows.begin(), rows.end(), sees) || std::none_of(rows.begin(), rows.end(), sees)) {
      alone.insert(alone.end(), rows.begin(), rows.end());
    } else if (std::uniform_int_distribution<int>(0, 1)(draw) != 0) {
      for (const std::size_t i : rows) anew.sees_change[i] = sees(i) ? 0 : 1;
    }
  }
  std::vector<char> marks;
  for (const std::size_t i : alone) marks.push_back(readings.sees_change[i]);
  std::shuffle(marks.begin(), marks.end(), draw);
  for (std::size_t k = 0; k < alone.size(); ++k) anew.sees_change[alone[k]] = marks[k];
  return anew;
}

/// Odds of each change tried, against none.
std::vector<double> oddsOf(const FieldReadings& readings, std::span<const SharedLaw> laws,
                           std::span<const ChangeLaw> changes, double none, const RunControl& control) {
  std::vector<double> odds(laws.size() * changes.size());
  control.parallel_for(odds.size(), [&](std::size_t k) {
    odds[k] = SharedField(readings, laws[k / changes.size()], changes[k % changes.size()]).logEvidence() - none;
  });
  return odds;
}

}  // namespace

SharedLaw likeliestSharedLaw(const FieldReadings& readings, const SmoothParts& parts) {
  return LawClimb(readings, parts).run();
}

FieldComparison compareFields(const FieldReadings& readings, const SmoothParts& parts, double pitch_m,
                              const Thresholds& thresholds, const RunControl& control) {
  constexpr int kDeals = 8;
  constexpr unsigned kSeed = 1;
  FieldComparison found;
  std::vector<std::size_t> earlier;
  for (std::size_t i = 0; i < readings.size(); ++i)
    if (readings.is_later[i] == 0) earlier.push_back(i);
  found.law = likeliestSharedLaw(readings, parts);
  // Had something changed, the earlier recording alone would tell the field better than both.
  found.earlier = likeliestSharedLaw(readings.only(earlier), parts);
  found.earlier.noise_factor[1] = found.law.noise_factor[1];
  found.earlier.rig_share = found.law.rig_share;
  const SharedField unchanged(readings, found.law);
  const double none = std::max(unchanged.logEvidence(), SharedField(readings, found.earlier).logEvidence());
  const std::vector<ChangeLaw> changes = changesTried(readings, parts, pitch_m);
  const std::array<SharedLaw, 2> laws = {found.law, found.earlier};
  const std::vector<double> odds = oddsOf(readings, laws, changes, none, control);
  const auto best = static_cast<std::size_t>(std::distance(odds.begin(), std::max_element(odds.begin(), odds.end())));
  found.change = changes[best % changes.size()];
  found.log_odds = logMean(odds);
  if (found.log_odds > 0.0) {
    std::mt19937 draw(kSeed);
    double by_chance = 0.0;
    for (int deal = 0; deal < kDeals && !control.stop.stop_requested(); ++deal)
      by_chance = std::max(by_chance, logMean(oddsOf(dealt(readings, draw), laws, changes, none, control)));
    found.log_odds -= by_chance;
  }
  found.least_shown = leastShown(unchanged, 0.5 * extentOf(readings), std::sqrt(readings.variances.mean()),
                                 thresholds.sure_of_change + std::log(static_cast<double>(odds.size())));
  return found;
}

}  // namespace fieldtrue::identify
