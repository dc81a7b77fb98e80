#include "widgets/compare/node_facts.h"

#include <algorithm>
#include <cmath>

#include "calib/core/statistics.h"
#include "calib/core/units.h"
#include "widgets/style/unit_texts.h"

namespace fieldtrue::widgets {
namespace {

QString roleText(NodeRole role) {
  switch (role) {
    case NodeRole::kFit:
      return QObject::tr("fit");
    case NodeRole::kValidation:
      return QObject::tr("validation");
    case NodeRole::kSkipped:
      break;
  }
  return QObject::tr("skipped");
}

QString scatterText(const Node& node) {
  if (!node.covariance_m2) return QObject::tr("not stated");
  const Eigen::Vector3d sd_mm = 1000.0 * node.covariance_m2->diagonal().cwiseMax(0.0).cwiseSqrt();
  const double all_mm = sd_mm.norm();
  return QObject::tr("%1 mm a sample (x %2, y %3, z %4); %5 mm the mean")
      .arg(threeFigures(all_mm), threeFigures(sd_mm.x()), threeFigures(sd_mm.y()), threeFigures(sd_mm.z()),
           threeFigures(all_mm / std::sqrt(std::max(1.0, node.n_effective))));
}

QString driftText(const TakeDrift& drift) {
  return QObject::tr("%1 mm in %2 s; scatter alone gives about %3 mm")
      .arg(threeFigures(drift.change_mm), threeFigures(drift.duration_s), threeFigures(drift.chance_sd_mm));
}

template <class Label>
std::vector<PlaceResidual> residualsOf(const evaluation::Comparison& comparison, int node,
                                       const std::vector<evaluation::MethodScore>& scores,
                                       const std::vector<double>& before, Label label) {
  const auto at = std::find(comparison.places.begin(), comparison.places.end(), node);
  const auto place = static_cast<std::size_t>(at - comparison.places.begin());
  if (at == comparison.places.end() || place >= before.size()) return {};
  std::vector<PlaceResidual> residuals = {{QObject::tr("Before"), before[place], true, true, 0}};
  for (std::size_t row = 0; row < scores.size(); ++row) {
    const evaluation::MethodScore& score = scores[row];
    if (score.skipped || score.method == "none" || place >= score.place_errors.size()) continue;
    const bool covered = place >= score.place_covered.size() || score.place_covered[place];
    residuals.push_back({label(score), score.place_errors[place], covered, false, row});
  }
  std::stable_sort(residuals.begin(), residuals.end(),
                   [](const PlaceResidual& a, const PlaceResidual& b) { return a.error < b.error; });
  return residuals;
}

}  // namespace

std::optional<TakeDrift> takeDrift(const SampleTable& samples, int node, int visit, int sensor, double n_effective) {
  std::vector<Sample> all;
  for (const SampleRow& row : samples.rows)
    if (row.node == node && row.visit == visit && row.sample.sensor == sensor) all.push_back(row.sample);
  const auto averaged = averageSamples(all);
  if (!averaged) return std::nullopt;
  std::vector<bool> rejected(all.size(), false);
  for (const Rejection& rejection : averaged->rejections) rejected[rejection.sample] = true;
  std::vector<const Sample*> taken;
  for (std::size_t k = 0; k < all.size(); ++k)
    if (!rejected[k]) taken.push_back(&all[k]);
  if (taken.size() < 3) return std::nullopt;
  const double n = static_cast<double>(taken.size());
  double mean_s = 0.0, first_s = taken.front()->time_s, last_s = first_s;
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  for (const Sample* sample : taken) {
    mean_s += sample->time_s / n;
    mean_m += sample->tracker_from_sensor.position_m / n;
    first_s = std::min(first_s, sample->time_s);
    last_s = std::max(last_s, sample->time_s);
  }
  double spread_s2 = 0.0;
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  for (const Sample* sample : taken) {
    spread_s2 += (sample->time_s - mean_s) * (sample->time_s - mean_s);
    moved += (sample->time_s - mean_s) * (sample->tracker_from_sensor.position_m - mean_m);
  }
  if (!(spread_s2 > 0.0)) return std::nullopt;
  const Eigen::Vector3d slope = moved / spread_s2;
  double left_m2 = 0.0;
  for (const Sample* sample : taken)
    left_m2 += (sample->tracker_from_sensor.position_m - mean_m - (sample->time_s - mean_s) * slope).squaredNorm();
  const double duration_s = last_s - first_s;
  // Samples that resemble their neighbours tell less of a slope, by the same factor as of a mean.
  const double variance = left_m2 / (n - 2.0) / spread_s2 * n / std::clamp(n_effective, 1.0, n);
  return TakeDrift{1000.0 * slope.norm() * duration_s, 1000.0 * std::sqrt(variance) * duration_s, duration_s,
                   taken.size()};
}

std::vector<Fact> nodeFacts(const Node& node, const SampleTable& samples) {
  std::vector<Fact> facts;
  const auto add = [&facts](const QString& name, const QString& value) { facts.push_back({name, value}); };
  QString role = roleText(node.role);
  if (node.index)
    role += QObject::tr(", grid %1 %2 %3").arg((*node.index)[0]).arg((*node.index)[1]).arg((*node.index)[2]);
  add(QObject::tr("Role"), role);
  add(QObject::tr("True"), positionText(node.reference_from_sensor.position_m));
  add(QString(), turnText(node.reference_from_sensor.orientation));
  add(QObject::tr("Tracked"), positionText(node.tracker_from_sensor.position_m));
  add(QString(),
      node.has_orientation ? turnText(node.tracker_from_sensor.orientation) : QObject::tr("no orientation reported"));
  add(QObject::tr("Samples"), QObject::tr("%1 used, %2 rejected, worth %3 independent ones")
                                  .arg(node.n_used)
                                  .arg(node.n_rejected)
                                  .arg(threeFigures(node.n_effective)));
  add(QObject::tr("SD"), scatterText(node));
  if (node.sd_rot_rad)
    add(QObject::tr("SD of turn"), QObject::tr("%1\u00b0 a sample").arg(threeFigures(*node.sd_rot_rad * kDegPerRad)));
  const auto drift = takeDrift(samples, node.node, node.visit, node.sensor, node.n_effective);
  add(QObject::tr("Drift"), drift ? driftText(*drift) : QObject::tr("the samples are not at hand"));
  return facts;
}

std::vector<PlaceResidual> positionResiduals(const evaluation::Comparison& comparison, int node) {
  return residualsOf(comparison, node, comparison.position, comparison.before_place_mm,
                     [](const evaluation::MethodScore& score) { return positionLabel(score); });
}

std::vector<PlaceResidual> orientationResiduals(const evaluation::Comparison& comparison, int node) {
  return residualsOf(comparison, node, comparison.orientation, comparison.before_place_deg,
                     [](const evaluation::MethodScore& score) { return orientationLabel(score); });
}

}  // namespace fieldtrue::widgets
