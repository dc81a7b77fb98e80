#include "calib/gap/next_measurement.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>

#include "calib/core/file_io.h"
#include "calib/effects/registry.h"

namespace fieldtrue::gap {
namespace {

/// A set of additional measurements that an operator could make.
struct Proposal {
  std::string text;
  std::vector<identify::GapRow> rows;
};

std::string rounded(double value, int digits) {
  const double scale = std::pow(10.0, digits);
  return formatNumber(std::round(value * scale) / scale + 0.0);  // Never minus nothing.
}

/// Up to `count` rows spread evenly over the table.
std::vector<identify::GapRow> spreadRows(const identify::GapRows& table, std::size_t count) {
  std::vector<identify::GapRow> rows;
  for (std::size_t i = 0; i < count; ++i) rows.push_back(table.rows[(2 * i + 1) * table.rows.size() / (2 * count)]);
  return rows;
}

std::vector<int> nodesOf(const std::vector<identify::GapRow>& rows) {
  std::vector<int> nodes;
  for (const identify::GapRow& row : rows) nodes.push_back(row.node);
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

std::vector<Proposal> turnedProposals(const identify::GapRows& table, const PlaceNames& names) {
  std::vector<Proposal> proposals;
  const char* const kAxes[] = {"x", "y", "z"};
  for (int axis = 0; axis < 3 && table.has_orientation; ++axis) {
    Proposal proposal;
    proposal.rows = spreadRows(table, 6);
    const auto turn =
        Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d(Eigen::Vector3d::Unit(axis))));
    for (identify::GapRow& row : proposal.rows)
      row.reference_from_sensor.orientation = turn * row.reference_from_sensor.orientation;
    proposal.text = std::string("turn the sensor by 90 degrees about the rig's ") + kAxes[axis] + " axis and measure " +
                    names.list(nodesOf(proposal.rows)) + " again";
    proposals.push_back(std::move(proposal));
  }
  return proposals;
}

std::vector<Proposal> outerProposals(const identify::GapRows& table, double pitch_m, const PlaceNames& names) {
  std::vector<Proposal> proposals;
  const char* const kSides[] = {"-x", "+x", "-y", "+y", "-z", "+z"};
  for (int side = 0; side < 6; ++side) {
    const int axis = side / 2;
    const double sign = side % 2 == 0 ? -1.0 : 1.0;
    std::vector<std::size_t> order(table.rows.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return sign * table.rows[a].reference_from_sensor.position_m[axis] >
             sign * table.rows[b].reference_from_sensor.position_m[axis];
    });
    const double face_m = table.rows[order.front()].reference_from_sensor.position_m[axis];
    std::vector<std::size_t> face;  // A row of each place.
    std::set<std::size_t> places;
    for (const std::size_t i : order)
      if (std::abs(table.rows[i].reference_from_sensor.position_m[axis] - face_m) < 0.3 * pitch_m &&
          places.insert(table.rows[i].place).second)
        face.push_back(i);
    Proposal proposal;
    const std::size_t count = std::min<std::size_t>(6, face.size());
    for (std::size_t k = 0; k < count; ++k) {
      identify::GapRow row = table.rows[face[(2 * k + 1) * face.size() / (2 * count)]];
      row.reference_from_sensor.position_m[axis] += sign * pitch_m;
      proposal.rows.push_back(row);
    }
    proposal.text = "measure " + std::to_string(count) + (count == 1 ? " more place" : " more places") + " one step (" +
                    rounded(pitch_m, 2) + " m) beyond " + names.list(nodesOf(proposal.rows)) + ", towards " +
                    kSides[side];
    proposals.push_back(std::move(proposal));
  }
  return proposals;
}

std::vector<Proposal> laterProposals(const identify::GapRows& table, const effects::FitDesign& design,
                                     const PlaceNames& names) {
  if (!table.has_times) return {};
  Proposal proposal;
  std::vector<identify::GapRow> first = table.rows;
  std::stable_sort(first.begin(), first.end(),
                   [](const identify::GapRow& a, const identify::GapRow& b) { return a.time_s < b.time_s; });
  first.resize(std::min<std::size_t>(6, first.size()));
  proposal.rows = first;
  for (identify::GapRow& row : proposal.rows) row.time_s = design.end_s + 60.0;
  proposal.text = "measure the first places again, now at the end: " + names.list(nodesOf(proposal.rows));
  return {proposal};
}

/// Mean squared difference of two models' predictions at proposed rows, in noise variances.
double separation(const identify::GapSearch& search, const Proposal& proposal, const identify::GapModel& a,
                  const identify::GapModel& b) {
  identify::GapRows rows = search.physics().rows();
  rows.rows = proposal.rows;
  const identify::GapPhysics physics = search.physics().at(rows);
  const std::vector<Pose> pa = physics.predictions(a);
  const std::vector<Pose> pb = physics.predictions(b);
  double sum = 0.0;
  for (std::size_t i = 0; i < pa.size(); ++i) {
    const identify::Matrix6d noise = identify::noiseOf(rows.rows[i], search.placingSd_m(), search.placingSd_rad());
    const Eigen::Vector3d d_m = pa[i].position_m - pb[i].position_m;
    sum += std::min(1e4, d_m.dot(noise.topLeftCorner<3, 3>().inverse() * d_m));
    if (rows.has_orientation)
      sum += std::min(1e4, std::pow(angleBetween_rad(pa[i].orientation, pb[i].orientation), 2) / noise(3, 3));
  }
  return sum / static_cast<double>(pa.size());
}

const identify::TriedEffect* triedOf(const identify::GapSearch& search, const identify::EffectSelection& selection,
                                     const std::string& effect) {
  for (const identify::TriedEffect& tried : selection.alternatives)
    if (search.ways()[tried.way].effect->id == effect && tried.is_refined) return &tried;
  return nullptr;
}

/// What is to be told from the first candidate: what the sentence says cannot be told from it, else the next one, where
/// the evidence is not enough.
const GapCandidate* openRival(const std::vector<GapCandidate>& candidates, const identify::Thresholds& thresholds) {
  const GapCandidate& first = candidates.front();
  const auto is_alike = [&](const GapCandidate& c) {
    const auto& names = first.equivalents;
    return c.effect != first.effect && std::find(names.begin(), names.end(), c.effect) != names.end();
  };
  const auto alike = std::find_if(candidates.begin() + 1, candidates.end(), is_alike);
  if (alike != candidates.end()) return &*alike;
  const auto next =
      std::find_if(candidates.begin() + 1, candidates.end(), [](const auto& c) { return !isNameless(c.effect); });
  return next != candidates.end() && next->probability >= thresholds.open_cause ? &*next : nullptr;
}

/// The two effects that the evidence separates least, when it is not enough.
bool proposeSeparation(const identify::GapSearch& search, const identify::EffectSelection& selection,
                       GapReport& report) {
  if (report.candidates.empty() || isNameless(report.candidates.front().effect)) return false;
  const GapCandidate* rival = openRival(report.candidates, search.thresholds());
  if (rival == nullptr) return false;
  const GapCandidate& first = report.candidates.front();
  const GapCandidate& second = *rival;
  const identify::TriedEffect* a = triedOf(search, selection, first.effect);
  const identify::TriedEffect* b = triedOf(search, selection, second.effect);
  if (a == nullptr || b == nullptr) return false;
  std::vector<Proposal> proposals = turnedProposals(search.physics().rows(), report.names);
  for (auto* more : {&proposals}) {
    for (Proposal& p : outerProposals(search.physics().rows(), search.design().pitch_m, report.names))
      more->push_back(std::move(p));
    for (Proposal& p : laterProposals(search.physics().rows(), search.design(), report.names))
      more->push_back(std::move(p));
  }
  const Proposal* best = nullptr;
  double most = 0.0;
  for (const Proposal& proposal : proposals) {
    const double value = separation(search, proposal, a->model, b->model);
    if (value > most) {
      most = value;
      best = &proposal;
    }
  }
  if (best == nullptr || most < search.thresholds().least_separation) {
    report.next_measurement = "No extra place or turn of the sensor would tell " + effects::labelOf(first.effect) +
                              " from " + effects::labelOf(second.effect) +
                              ": check one of them by hand, for instance a long distance with a tape measure.";
  } else {
    report.next_measurement = "To tell " + effects::labelOf(first.effect) + " from " + effects::labelOf(second.effect) +
                              ", " + best->text + ".";
  }
  report.next_separates = {first.effect, second.effect};
  return true;
}

/// What the tracker would read were one selected effect taken away, and what gap that is: simulated by what stays and
/// aligned anew, as a recording made then will be.
class Removal {
 public:
  Removal(const identify::GapSearch& search, const identify::RefinedModel& refined, std::size_t term)
      : search_(search), refined_(refined), term_(term), rows_(search.physics().rows()) {
    rest_ = identify::withoutTerm(refined.model, term);
    const std::vector<Pose> read = search.physics().predictions(rest_);
    for (std::size_t i = 0; i < read.size(); ++i) rows_.rows[i].tracker_from_sensor = read[i];
    const identify::GapPhysics physics = search.physics().at(rows_);
    identify::RefineOptions options;
    options.law = search.law();
    left_ =
        physics.residuals(identify::fitJointly(physics, {refined.model.alignment, {}}, search.whitening(), options));
  }

  /// RMS size of the gap to be read at a row [m], and its SD: by the noise of one row and by how well the effects that
  /// stay are known.
  struct Then {
    double size_m = 0.0;
    double sd_m = 0.0;
  };
  Then at(std::size_t row) const {
    const identify::Matrix6d noise =
        identify::noiseOf(search_.physics().rows().rows[row], search_.placingSd_m(), search_.placingSd_rad());
    const double noise_m2 = noise.topLeftCorner<3, 3>().trace();
    return {std::sqrt(left_[row].head<3>().squaredNorm() + noise_m2), std::sqrt(noise_m2 + varianceOfRest_m2(row))};
  }

 private:
  /// By the covariance of the parameters of each effect that stays, alignment as it is.
  double varianceOfRest_m2(std::size_t row) const {
    if (refined_.covariance.size() == 0) return 0.0;
    const Eigen::Vector3d as_it_is_m = rows_.rows[row].tracker_from_sensor.position_m;
    double variance_m2 = 0.0;
    for (std::size_t t = 0; t < rest_.terms.size(); ++t) {
      const Eigen::Index begin = identify::firstParameterOf(refined_, t < term_ ? t : t + 1);
      const Eigen::Index n_linear = rest_.terms[t].linear.size();
      Eigen::Matrix3Xd J(3, n_linear + rest_.terms[t].searched.size());
      for (Eigen::Index p = 0; p < J.cols(); ++p) {
        identify::GapModel moved = rest_;
        double& value = p < n_linear ? moved.terms[t].linear[p] : moved.terms[t].searched[p - n_linear];
        const double h = 1e-4 * std::max(1e-3, std::abs(value));
        value += h;
        J.col(p) = (search_.physics().predictions(moved)[row].position_m - as_it_is_m) / h;
      }
      const Eigen::MatrixXd covariance = refined_.covariance.block(begin, begin, J.cols(), J.cols());
      const double own_m2 = (J * covariance * J.transpose()).trace();
      if (std::isfinite(own_m2)) variance_m2 += std::max(0.0, own_m2);
    }
    return variance_m2;
  }

  const identify::GapSearch& search_;
  const identify::RefinedModel& refined_;
  std::size_t term_;
  identify::GapRows rows_;
  identify::GapModel rest_;
  std::vector<identify::Vector6d> left_;
};

/// Rows of which the causes take away most.
std::vector<std::size_t> mostTakenAway(const std::vector<GapNode>& nodes) {
  const auto taken_m2 = [&](std::size_t i) { return nodes[i].before_m.squaredNorm() - nodes[i].after_m.squaredNorm(); };
  std::vector<std::size_t> order(nodes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return taken_m2(a) > taken_m2(b); });
  order.resize(std::min<std::size_t>(3, order.size()));
  return order;
}

/// What taking away each selected body, plane or loop would change at the places of which the causes take most, the rig
/// aligned anew; as sure as the fit and the noise let it be. What would not fall by more than that is no prediction.
void predictRemoval(const identify::GapSearch& search, const identify::EffectSelection& selection, GapReport& report) {
  const std::vector<std::size_t> order = mostTakenAway(report.nodes);
  for (std::size_t t = 0; t < selection.ways.size(); ++t) {
    if (selection.model.model.terms[t].effect->body == nullptr) continue;
    const Removal removal(search, selection.model, t);
    for (const std::size_t i : order) {
      const Removal::Then then = removal.at(i);
      Prediction prediction;
      prediction.effect = report.selected[t].effect;
      prediction.selected = t;
      prediction.node = report.nodes[i].node;
      prediction.now_mm = 1e3 * report.nodes[i].before_m.norm();
      prediction.then_mm = 1e3 * then.size_m;
      prediction.then_sd_mm = 1e3 * then.sd_m;
      if (prediction.now_mm - prediction.then_mm > prediction.then_sd_mm) report.predictions.push_back(prediction);
    }
  }
}

/// "Compact metal body near (1.2, 0.3, -0.5) m from the transmitter".
std::string namedThing(const SelectedEffect& effect) {
  if (!effect.location_m) return effects::labelOf(effect.effect);
  const Eigen::Vector3d& p = *effect.location_m;
  return effects::labelOf(effect.effect) + ", near (" + rounded(p.x(), 2) + ", " + rounded(p.y(), 2) + ", " +
         rounded(p.z(), 2) + ") m from the transmitter";
}

/// Of the first effect that can be taken away with something to be seen.
std::string interventionText(const GapReport& report) {
  const Prediction& prediction = report.predictions.front();
  const SelectedEffect& first = report.selected[prediction.selected];
  return "Move or remove what is named " + namedThing(first) + ", and measure " + report.names.of(prediction.node) +
         " again: its gap should go from " + rounded(prediction.now_mm, 0) + " to " + rounded(prediction.then_mm, 0) +
         " +- " + rounded(prediction.then_sd_mm, 0) + " mm.";
}

}  // namespace

void suggestNext(const identify::GapSearch& search, const identify::EffectSelection& selection, GapReport& report) {
  if (!selection.ways.empty()) predictRemoval(search, selection, report);
  if (report.verdict == GapVerdict::kNoGap) {
    report.next_measurement =
        search.physics().rows().several_orientations
            ? "Nothing needs to be measured; repeat ten places on another day to see that it stays so."
            : "Nothing needs to be measured; to look deeper, repeat ten places with the sensor turned by 90 degrees.";
    return;
  }
  if (proposeSeparation(search, selection, report)) return;
  if (!report.predictions.empty()) {
    report.next_measurement = interventionText(report);
  } else if (!report.selected.empty()) {
    const SelectedEffect& first = report.selected.front();
    report.next_measurement = (first.location_m ? "Look for what is named " + namedThing(first) + "; move it"
                                                : "Check " + namedThing(first) + " at its source, put it right") +
                              " or add it to the simulation, and measure ten places again.";
  } else if (report.hotspot) {
    const Eigen::Vector3d& p = report.hotspot->center_m;
    report.next_measurement = "Measure more closely around (" + rounded(p.x(), 2) + ", " + rounded(p.y(), 2) + ", " +
                              rounded(p.z(), 2) + ") m from the transmitter, at half the step, and every place twice.";
  } else {
    report.next_measurement = "Measure ten places twice, setting the jig anew each time.";
  }
}

}  // namespace fieldtrue::gap
