#include "calib/gap/isolability.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>

#include "calib/core/file_io.h"
#include "calib/core/statistics.h"

namespace fieldtrue::gap {
namespace {

/// Takes the alignment out of columns.
class AlignmentProjector {
 public:
  explicit AlignmentProjector(const identify::Linearized& at)
      : basis_(identify::spanOf(at.nuisance().leftCols(at.nAlignment()))) {}
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& m) const { return m - basis_ * (basis_.transpose() * m); }

 private:
  Eigen::MatrixXd basis_;
};

constexpr int kNowhere = -1;

/// An effect at one of its starts.
struct Imitation {
  const effects::EffectFit* fit = nullptr;
  Eigen::VectorXd start;
  Eigen::MatrixXd columns;  ///< Alignment taken out.
  int place = kNowhere;     ///< Which of the common places it stands at; kNowhere: it stands at none.
};

/// What one effect does on this design.
struct Signature {
  std::string effect;
  std::vector<Imitation> imitations;
  Eigen::MatrixXd typical;  ///< Unit columns.
  std::vector<int> typical_places;
};

std::vector<Eigen::VectorXd> someStarts(const effects::EffectFit& fit, std::size_t count) {
  std::vector<Eigen::VectorXd> all = fit.starts();
  std::erase_if(all, [&](const Eigen::VectorXd& start) { return !fit.allows(start); });
  if (all.size() <= count) return all;
  std::vector<Eigen::VectorXd> some;
  for (std::size_t i = 0; i < count; ++i) some.push_back(all[i * all.size() / count]);
  return some;
}

/// Where things in the room are taken to stand: near the places of the sensor, where they show, and all of them at the
/// same ones, so that one may imitate another.
std::vector<Eigen::Vector3d> commonCenters_m(std::span<const identify::EffectWay> ways,
                                             std::span<const field::SensorSetting> settings, std::size_t count) {
  std::vector<Eigen::Vector3d> centers_m;
  const auto placed =
      std::find_if(ways.begin(), ways.end(), [](const identify::EffectWay& way) { return way.fit->searchesPlace(); });
  if (placed == ways.end()) return centers_m;
  std::vector<std::pair<double, Eigen::Vector3d>> near_m;
  for (const Eigen::VectorXd& start : placed->fit->starts()) {
    if (!placed->fit->allows(start)) continue;
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const field::SensorSetting& setting : settings)
      nearest_m = std::min(nearest_m, (setting.tracker_from_sensor.position_m - start.head<3>()).norm());
    near_m.emplace_back(nearest_m, start.head<3>());
  }
  std::stable_sort(near_m.begin(), near_m.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  near_m.resize((near_m.size() + 2) / 3);
  for (std::size_t i = 0; i < std::min(count, near_m.size()); ++i)
    centers_m.push_back(near_m[i * near_m.size() / std::min(count, near_m.size())].second);
  return centers_m;
}

std::vector<Eigen::VectorXd> startsFor(const effects::EffectFit& fit, std::span<const Eigen::Vector3d> centers_m,
                                       std::size_t count) {
  if (!fit.searchesPlace()) return someStarts(fit, count);
  std::vector<Eigen::VectorXd> starts = identify::startsAt(fit, centers_m);
  std::erase_if(starts, [&](const Eigen::VectorXd& start) { return !fit.allows(start); });
  return starts;
}

std::vector<int> placesOf(const effects::EffectFit& fit, std::span<const Eigen::VectorXd> starts,
                          std::span<const Eigen::Vector3d> centers_m) {
  std::vector<int> places(starts.size(), kNowhere);
  if (!fit.searchesPlace()) return places;
  for (std::size_t i = 0; i < starts.size(); ++i)
    for (std::size_t c = 0; c < centers_m.size(); ++c)
      if (starts[i].head<3>() == centers_m[c]) places[i] = static_cast<int>(c);
  return places;
}

/// Unit columns that stand for an effect: each of its linear parameters at a few of its starts; none where it shows
/// nothing.
void setTypical(Signature& signature) {
  const std::vector<Imitation>& all = signature.imitations;
  constexpr std::size_t kMost = 8;
  const std::size_t used = std::min(kMost, all.size());
  std::vector<Eigen::VectorXd> list;
  for (std::size_t i = 0; i < used; ++i) {
    const Imitation& chosen = all[i * all.size() / used];
    const Eigen::MatrixXd& m = chosen.columns;
    Eigen::VectorXd mixed = Eigen::VectorXd::Zero(m.rows());
    for (Eigen::Index j = 0; j < m.cols(); ++j) {
      const double norm = m.col(j).norm();
      if (!(norm > 0.0)) continue;
      if (used == 1) list.emplace_back(m.col(j) / norm);
      mixed += m.col(j) / norm * (j % 2 == 0 ? 1.0 : -0.6);
    }
    if (used > 1 && mixed.norm() > 0.0) list.emplace_back(mixed.normalized());
    signature.typical_places.resize(list.size(), chosen.place);
  }
  signature.typical.resize(all.front().columns.rows(), static_cast<Eigen::Index>(list.size()));
  for (std::size_t i = 0; i < list.size(); ++i) signature.typical.col(static_cast<Eigen::Index>(i)) = list[i];
}

/// Share of each unit column that the columns of `by` make.
Eigen::VectorXd imitated(const Eigen::MatrixXd& typical, const Eigen::MatrixXd& by) {
  Eigen::MatrixXd unit = by;
  for (Eigen::Index j = 0; j < unit.cols(); ++j) {
    const double norm = unit.col(j).norm();
    if (norm > 0.0) unit.col(j) /= norm;
  }
  Eigen::MatrixXd normal = unit.transpose() * unit;
  normal.diagonal().array() += 1e-8;
  const Eigen::MatrixXd right = unit.transpose() * typical;
  const Eigen::MatrixXd x = normal.llt().solve(right);
  return right.cwiseProduct(x).colwise().sum();
}

bool isPlaced(const Signature& signature) { return signature.imitations.front().place != kNowhere; }

/// Share of a signal that an imitator makes once its place and shape are fitted to it.
/// @param strength norm of the signal, so that what is believable of the imitator counts
double fittedShare(const identify::Linearized& at, const Eigen::VectorXd& unit, double strength, const Imitation& by) {
  const identify::Linearized signal = at.withResidual(strength * unit);
  const identify::LocalFit fitted = identify::LocalFitter(signal).from(*by.fit, by.start);
  return fitted.gain / (strength * strength);
}

/// How the shares of a's typical signals that b can make are found.
class Imitator {
 public:
  Imitator(const identify::Linearized& at, Imitators kind) : at_(at), is_fitted_(kind == Imitators::kFitted) {}

  /// Of each typical signal of a, the largest share that b makes.
  std::vector<double> shares(const Signature& a, const Signature& b) const {
    std::vector<double> best(static_cast<std::size_t>(a.typical.cols()), 0.0);
    std::vector<std::vector<std::pair<double, std::size_t>>> tried(best.size());
    for (std::size_t k = 0; k < b.imitations.size(); ++k) {
      const Eigen::VectorXd made = imitated(a.typical, b.imitations[k].columns);
      for (std::size_t i = 0; i < best.size(); ++i) {
        const int place = a.typical_places[i];
        const int other = b.imitations[k].place;
        if (place != kNowhere && other != kNowhere && place != other) continue;
        const double share = made[static_cast<Eigen::Index>(i)];
        tried[i].emplace_back(share, k);
        best[i] = std::max(best[i], share);
      }
    }
    if (!is_fitted_ || !isPlaced(a) || !isPlaced(b)) return best;
    for (std::size_t i = 0; i < best.size(); ++i) {
      const Eigen::VectorXd unit = a.typical.col(static_cast<Eigen::Index>(i));
      for (const std::size_t k : mostAlikeOfEachWay(tried[i], b))
        best[i] = std::max(best[i], fittedShare(at_, unit, strength(), b.imitations[k]));
    }
    return best;
  }

 private:
  /// What is most alike on the coarse grid need not be once it is fitted: iron may pass for copper there.
  static std::vector<std::size_t> mostAlikeOfEachWay(std::vector<std::pair<double, std::size_t>> tried,
                                                     const Signature& by) {
    std::sort(tried.rbegin(), tried.rend());
    std::vector<std::size_t> most;
    for (const auto& one : tried) {
      const effects::EffectFit* way = by.imitations[one.second].fit;
      const auto is_of_way = [&](std::size_t other) { return by.imitations[other].fit == way; };
      if (std::none_of(most.begin(), most.end(), is_of_way)) most.push_back(one.second);
    }
    return most;
  }
  /// Of a signal as large as the noise.
  double strength() const { return std::sqrt(static_cast<double>(at_.order().size()) * at_.channels()); }

  const identify::Linearized& at_;
  bool is_fitted_;
};

/// Signal over noise from which two signals, of which the other makes such a share, are taken for each other once in
/// fifty: half their distance is then 2.05 SDs of the noise along it.
std::optional<double> toldApartFrom(double share, double count) {
  constexpr double kDistance2 = 4.0 * 2.05 * 2.05;
  constexpr double kSame = 1e-6;
  if (1.0 - share < kSame) return std::nullopt;
  return std::sqrt(kDistance2 / ((1.0 - share) * count));
}

IsolabilityPair pairOf(const Signature& a, const Signature& b, const Imitator& imitator, std::optional<double> count) {
  constexpr double kMostPlaces = 0.9;
  const std::vector<double> a_by_b = imitator.shares(a, b);
  const std::vector<double> b_by_a = imitator.shares(b, a);
  IsolabilityPair pair{a.effect, b.effect, std::clamp(std::min(median(a_by_b), median(b_by_a)), 0.0, 1.0), {}};
  if (count)
    pair.told_apart_from =
        toldApartFrom(std::min(quantile(a_by_b, kMostPlaces), quantile(b_by_a, kMostPlaces)), *count);
  return pair;
}

std::vector<std::string> adviceFor(const Isolability& isolability, const identify::GapRows& rows,
                                   const identify::Thresholds& thresholds) {
  std::vector<std::string> advice;
  std::string same;
  for (const IsolabilityPair& pair : isolability.pairs)
    if (pair.r2 > thresholds.same_on_design) same += (same.empty() ? "" : ", ") + pair.a + " from " + pair.b;
  if (!same.empty()) advice.push_back("This grid cannot tell " + same + ".");
  if (!rows.several_orientations) {
    advice.push_back(
        "One orientation only: repeat some places with the sensor turned by 90 degrees, so that errors of the "
        "transmitter's coils can be told from those of the sensor's, and a lever arm from a displaced transmitter.");
  }
  if (!rows.has_times) {
    advice.push_back("No times are stated: drift and moved metal cannot be found.");
    return advice;
  }
  bool in_order = true;
  double last_s = -1e300;
  std::size_t climbs = 0;
  double last_z = -1e300;
  double first_z = rows.rows.empty() ? 0.0 : rows.rows.front().reference_from_sensor.position_m.z();
  bool has_layers = false;
  for (const identify::GapRow& row : rows.rows) {
    in_order = in_order && row.time_s >= last_s;
    last_s = row.time_s;
    climbs += row.reference_from_sensor.position_m.z() >= last_z - 1e-6 ? 1 : 0;
    last_z = row.reference_from_sensor.position_m.z();
    has_layers = has_layers || std::abs(last_z - first_z) > 1e-6;
  }
  if (has_layers && in_order && climbs + rows.rows.size() / 10 >= rows.rows.size())
    advice.push_back("The places are visited layer by layer: in random order drift can be told from a leaning rig.");
  std::map<std::size_t, std::map<std::size_t, int>> visits;  // Of each place by each sensor.
  for (const identify::GapRow& row : rows.rows) ++visits[row.place][row.sensor];
  const auto isAgain = [](const auto& of_sensor) { return of_sensor.second > 1; };
  const auto revisited = std::count_if(visits.begin(), visits.end(), [&](const auto& of_place) {
    return std::any_of(of_place.second.begin(), of_place.second.end(), isAgain);
  });
  if (revisited < 10)
    advice.push_back("Set the jig anew at ten places or more: only that measures how well it is placed.");
  return advice;
}

}  // namespace

Isolability isolabilityOf(const identify::GapSearch& search, std::size_t starts_each, Imitators imitators,
                          const RunControl& control) {
  const std::vector<int> one_block(search.physics().size(), 0);
  const identify::Linearized at(search.physics(), search.none().model, search.whitening(), one_block);
  const AlignmentProjector projected(at);
  const std::vector<Eigen::Vector3d> centers_m = commonCenters_m(search.ways(), at.settings(), starts_each / 2);
  std::vector<Signature> signatures;
  for (const identify::EffectWay& way : search.ways()) {
    const std::vector<Eigen::VectorXd> starts = startsFor(*way.fit, centers_m, starts_each);
    const std::vector<int> places = placesOf(*way.fit, starts, centers_m);
    std::vector<Imitation> imitations(starts.size());
    control.parallel_for(starts.size(), [&](std::size_t i) {
      if (control.stop.stop_requested()) return;
      imitations[i] = {way.fit.get(), starts[i], projected(at.columns(*way.fit, starts[i])), places[i]};
    });
    if (control.stop.stop_requested() || imitations.empty()) continue;
    const auto found = std::find_if(signatures.begin(), signatures.end(),
                                    [&](const Signature& s) { return s.effect == way.effect->id; });
    if (found == signatures.end()) {
      Signature signature{way.effect->id, std::move(imitations), {}, {}};
      setTypical(signature);
      if (signature.typical.cols() > 0) signatures.push_back(std::move(signature));
    } else {
      std::move(imitations.begin(), imitations.end(), std::back_inserter(found->imitations));
    }
  }
  Isolability isolability;
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a < signatures.size(); ++a)
    for (std::size_t b = a + 1; b < signatures.size(); ++b) pairs.emplace_back(a, b);
  isolability.pairs.resize(pairs.size());
  const Imitator imitator(at, imitators);
  std::optional<double> count;
  if (imitators == Imitators::kFitted) count = static_cast<double>(at.order().size()) * at.channels();
  control.parallel_for(pairs.size(), [&](std::size_t i) {
    if (control.stop.stop_requested()) return;
    isolability.pairs[i] = pairOf(signatures[pairs[i].first], signatures[pairs[i].second], imitator, count);
  });
  std::stable_sort(isolability.pairs.begin(), isolability.pairs.end(),
                   [](const IsolabilityPair& a, const IsolabilityPair& b) { return a.r2 > b.r2; });
  isolability.warnings = adviceFor(isolability, search.physics().rows(), search.thresholds());
  return isolability;
}

std::vector<SmallestDetectable> smallestDetectable(const identify::GapSearch& search) {
  const std::vector<int> one_block(search.physics().size(), 0);
  const identify::Linearized at(search.physics(), search.none().model, search.whitening(), one_block);
  const AlignmentProjector projected(at);
  const double count = static_cast<double>(at.order().size()) * at.channels();
  std::vector<SmallestDetectable> list;
  for (const identify::EffectWay& way : search.ways()) {
    if (!list.empty() && list.back().effect == way.effect->id) continue;
    std::vector<double> sizes;
    const std::vector<effects::FitParameter> linear = way.fit->linear();
    for (const Eigen::VectorXd& start : someStarts(*way.fit, 12)) {
      const Eigen::MatrixXd columns = projected(at.columns(*way.fit, start));
      const double norm = columns.col(0).norm();
      const double parameters = static_cast<double>(linear.size()) + static_cast<double>(start.size());
      if (norm > 0.0)
        sizes.push_back(std::sqrt(parameters * std::log(count) + search.thresholds().least_gain_first) / norm);
    }
    if (sizes.empty()) continue;
    list.push_back({way.effect->id, linear.front().name, median(std::move(sizes)), linear.front().unit});
  }
  return list;
}

}  // namespace fieldtrue::gap
