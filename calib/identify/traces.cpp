#include "calib/identify/traces.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "calib/core/chi_square.h"
#include "calib/core/file_io.h"
#include "calib/field/dipole_field.h"

namespace fieldtrue::identify {
namespace {

using Responses = std::vector<field::EffectResponse>;  ///< Per setting and parameter, the parameter running fastest.

field::EffectResponse shifted(const Eigen::Vector3d& shift_m) {
  field::EffectResponse response;
  response.shift_m = shift_m;
  return response;
}

field::EffectResponse changed(const Eigen::Matrix3d& field_per_m3) {
  field::EffectResponse response;
  response.field_per_m3 = field_per_m3;
  return response;
}

/// Tests added regressors against what a model leaves.
class TraceTest {
 public:
  explicit TraceTest(const Linearized& at) : at_(at) {
    const auto n_rows = static_cast<Eigen::Index>(at.order().size());
    weight_ = Eigen::VectorXd::Ones(at.size());
    weight_.head(n_rows * at.channels()) =
        robustWeights(at.residual().head(n_rows * at.channels()), n_rows, at.channels());
    basis_ = spanOf(weight_.asDiagonal() * at.nuisance());
    left_ = projected(weight_.cwiseProduct(at.residual()));
  }

  Trace run(const std::string& text, const Responses& responses) const {
    const auto parameters = static_cast<Eigen::Index>(responses.size() / at_.settings().size());
    return run(text, at_.columnsOf(responses, parameters));
  }

  Trace run(const std::string& text, const Eigen::MatrixXd& added) const {
    Eigen::MatrixXd columns = projected(weight_.asDiagonal() * added);
    for (Eigen::Index j = 0; j < columns.cols(); ++j) {
      const double norm = columns.col(j).norm();
      if (norm > 1e-9) columns.col(j) /= norm;
    }
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
    qr.setThreshold(1e-5);
    Trace trace;
    trace.text = text;
    const auto d1 = static_cast<double>(qr.rank());
    const double d2 = static_cast<double>(left_.size() - basis_.cols()) - d1;
    if (d1 < 1.0 || d2 < 10.0) return trace;
    const Eigen::VectorXd turned = qr.householderQ().adjoint() * left_;
    const double explained = turned.head(qr.rank()).squaredNorm();
    const double variance = std::max(1e-12, (left_.squaredNorm() - explained) / d2);
    trace.p_value = tailOfF(explained / d1 / variance, d1, d2);
    trace.explained = std::max(0.0, explained - d1 * variance);
    return trace;
  }

 private:
  Eigen::MatrixXd projected(const Eigen::MatrixXd& m) const { return m - basis_ * (basis_.transpose() * m); }

  const Linearized& at_;
  Eigen::VectorXd weight_;
  Eigen::MatrixXd basis_;
  Eigen::VectorXd left_;
};

/// The likeliest of several places of one kind; its significance pays for having looked at all of them.
Trace likeliest(const std::vector<Trace>& traces) {
  if (traces.empty()) return {};
  const auto by_p = [](const Trace& a, const Trace& b) { return a.p_value < b.p_value; };
  Trace best = *std::min_element(traces.begin(), traces.end(), by_p);
  best.p_value = std::min(1.0, best.p_value * static_cast<double>(traces.size()));
  return best;
}

Trace ofLayers(const TraceTest& test, const Linearized& at) {
  constexpr std::size_t kMostLayers = 12;
  std::vector<Trace> traces;
  for (int axis = 0; axis < 3; ++axis) {
    std::map<long, std::vector<std::size_t>> layers;
    std::vector<Eigen::Vector3d> q_m;
    for (const field::SensorSetting& s : at.settings())
      q_m.push_back(inverse(s.tracker_from_reference) * s.tracker_from_sensor.position_m);
    for (std::size_t k = 0; k < q_m.size(); ++k) layers[std::lround(q_m[k][axis] / 0.02)].push_back(k);
    if (layers.size() < 2 || layers.size() > kMostLayers) continue;
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    for (const auto& [height, members] : layers) {
      if (members.size() < 6) continue;
      Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
      for (const std::size_t k : members) center_m += q_m[k] / static_cast<double>(members.size());
      Responses responses(6 * q_m.size());
      for (const std::size_t k : members) {
        const Eigen::Matrix3d R = at.settings()[k].tracker_from_reference.orientation.toRotationMatrix();
        const double shapes[] = {1.0, q_m[k][u] - center_m[u], q_m[k][v] - center_m[v]};
        for (std::size_t s = 0; s < 3; ++s) {
          responses[6 * k + 2 * s] = shifted(shapes[s] * R.col(u));
          responses[6 * k + 2 * s + 1] = shifted(shapes[s] * R.col(v));
        }
      }
      traces.push_back(test.run("one layer of the rig is not where its numbers say, within its own plane", responses));
    }
  }
  return likeliest(traces);
}

std::vector<std::size_t> inTime(const Linearized& at) {
  std::vector<std::size_t> order(at.settings().size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return at.settings()[a].time_s < at.settings()[b].time_s; });
  return order;
}

/// The couplings of the place before, as the sensor then saw them, added to those of now.
Trace ofMemory(const TraceTest& test, const Linearized& at) {
  const std::vector<std::size_t> order = inTime(at);
  Responses responses(at.settings().size());
  for (std::size_t i = 1; i < order.size(); ++i) {
    const field::SensorSetting& before = at.settings()[order[i - 1]];
    const field::SensorSetting& now = at.settings()[order[i]];
    const Eigen::Matrix3d seen = before.tracker_from_sensor.orientation.toRotationMatrix().transpose() *
                                 field::dipoleField(before.tracker_from_sensor.position_m, 1.0);
    responses[order[i]] = changed(now.tracker_from_sensor.orientation.toRotationMatrix() * seen);
  }
  return test.run("the sensor remembers the place before", responses);
}

struct Span {
  double begin_s = 0.0;
  double length_s = 0.0;
};

Span spanOf(const Linearized& at) {
  const auto by_time = [](const field::SensorSetting& a, const field::SensorSetting& b) { return a.time_s < b.time_s; };
  const auto [first, last] = std::minmax_element(at.settings().begin(), at.settings().end(), by_time);
  return {first->time_s, last->time_s - first->time_s};
}

Trace ofDriftingCoils(const TraceTest& test, const Linearized& at) {
  const Span span = spanOf(at);
  Responses responses;
  for (const field::SensorSetting& s : at.settings()) {
    const double t = 2.0 * (s.time_s - span.begin_s) / span.length_s - 1.0;
    const Eigen::Matrix3d G = field::dipoleField(s.tracker_from_sensor.position_m, 1.0);
    const Eigen::Matrix3d R = s.tracker_from_sensor.orientation.toRotationMatrix();
    for (const double shape : {t, t * t}) {
      for (int coil = 0; coil < 3; ++coil) {
        responses.push_back(changed(shape * R.col(coil) * (R.col(coil).transpose() * G)));
        Eigen::Matrix3d of_transmitter = Eigen::Matrix3d::Zero();
        of_transmitter.col(coil) = shape * G.col(coil);
        responses.push_back(changed(of_transmitter));
      }
    }
  }
  return test.run("the gain of single coils changes during the session", responses);
}

Trace ofChangedSensor(const TraceTest& test, const Linearized& at) {
  const std::vector<std::size_t> order = inTime(at);
  std::vector<Trace> traces;
  for (const double share : {0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8}) {
    Responses responses(10 * order.size());
    for (auto i = static_cast<std::size_t>(share * static_cast<double>(order.size())); i < order.size(); ++i) {
      const field::SensorSetting& s = at.settings()[order[i]];
      const Eigen::Matrix3d G = field::dipoleField(s.tracker_from_sensor.position_m, 1.0);
      const Eigen::Matrix3d R = s.tracker_from_sensor.orientation.toRotationMatrix();
      for (int k = 0; k < 3; ++k) {
        const std::size_t first = 10 * order[i] + static_cast<std::size_t>(k);
        responses[first] = changed(R.col(k) * (R.col(k).transpose() * G));
        responses[first + 3] = shifted(R.col(k));
        responses[first + 6].turn_rad = R.col(k);
      }
      responses[10 * order[i] + 9] = changed(G);
    }
    traces.push_back(test.run("the sensor, or its holder, changed during the session", responses));
  }
  return likeliest(traces);
}

/// Whether each part of the session saw places over most of the region: else what follows the time follows the place.
bool seesTheRegion(const std::vector<std::vector<Eigen::Vector3d>>& parts_m) {
  constexpr double kLeastShare = 0.5;  // Of the variance.
  const auto varianceOf = [](const std::vector<Eigen::Vector3d>& places_m) {
    Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
    double square_m2 = 0.0;
    for (const Eigen::Vector3d& p_m : places_m) mean_m += p_m / static_cast<double>(places_m.size());
    for (const Eigen::Vector3d& p_m : places_m)
      square_m2 += (p_m - mean_m).squaredNorm() / static_cast<double>(places_m.size());
    return square_m2;
  };
  std::vector<Eigen::Vector3d> all_m;
  for (const auto& part_m : parts_m) all_m.insert(all_m.end(), part_m.begin(), part_m.end());
  const double least_m2 = kLeastShare * varianceOf(all_m);
  return std::all_of(parts_m.begin(), parts_m.end(),
                     [&](const auto& part_m) { return part_m.size() > 1 && varianceOf(part_m) > least_m2; });
}

/// A thing in the room that is named, with a strength of its own in each of a few parts of the session.
Trace ofStrengthInTime(const TraceTest& test, const Linearized& at, const GapTerm& term) {
  constexpr std::size_t kParts = 6;
  const std::vector<std::size_t> order = inTime(at);
  const Eigen::VectorXd signal = at.columns(*term.fit, term.searched) * term.linear;
  Eigen::MatrixXd in_part = Eigen::MatrixXd::Zero(signal.size(), kParts);
  std::vector<std::vector<Eigen::Vector3d>> places_m(kParts);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t part = kParts * i / order.size();
    const auto row = static_cast<Eigen::Index>(order[i]) * at.channels();
    in_part.col(static_cast<Eigen::Index>(part)).segment(row, at.channels()) = signal.segment(row, at.channels());
    places_m[part].push_back(at.settings()[order[i]].tracker_from_sensor.position_m);
  }
  if (!seesTheRegion(places_m)) return {};
  constexpr double kFaint = 0.01;  // Of the signal's square in the part where it is strongest.
  const double least = std::max(1e-12, kFaint * in_part.colwise().squaredNorm().maxCoeff());
  std::string strengths;
  for (Eigen::Index part = 0; part < in_part.cols(); ++part) {
    const auto shape = in_part.col(part);
    const double square = shape.squaredNorm();
    const double strength = std::round(10.0 * (1.0 + shape.dot(at.residual()) / std::max(least, square))) / 10.0;
    strengths += (strengths.empty() ? "" : ", ") + (square < least ? "none" : formatNumber(strength + 0.0));
  }
  return test.run("what is named (" + effects::labelOf(term.effect->id) +
                      ") did not stand there alike all the time; its strength in six equal parts of the session, 1 "
                      "as named: " +
                      strengths,
                  in_part);
}

Trace ofGainByPlace(const TraceTest& test, const Linearized& at) {
  Eigen::AlignedBox3d box;
  for (const field::SensorSetting& s : at.settings()) box.extend(s.tracker_from_sensor.position_m);
  const Eigen::Vector3d half_m = (0.5 * box.sizes()).cwiseMax(1e-3);
  Responses responses;
  for (const field::SensorSetting& s : at.settings()) {
    const Eigen::Vector3d c = (s.tracker_from_sensor.position_m - box.center()).cwiseQuotient(half_m);
    const Eigen::Matrix3d G = field::dipoleField(s.tracker_from_sensor.position_m, 1.0);
    for (const double shape : {c.x(), c.y(), c.z(), c.x() * c.x(), c.y() * c.y(), c.z() * c.z(), c.x() * c.y(),
                               c.x() * c.z(), c.y() * c.z()})
      responses.push_back(changed(shape * G));
  }
  return test.run("the gain follows the place, as when the cable lies differently", responses);
}

}  // namespace

Eigen::VectorXd robustWeights(const Eigen::VectorXd& left, Eigen::Index n_rows, int channels) {
  constexpr double kFullWeightBelow = 12.0;  // In squared scales.
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(left.size());
  for (Eigen::Index part = 0; part < channels / 3; ++part) {
    std::vector<double> d2;
    for (Eigen::Index i = 0; i < n_rows; ++i) d2.push_back(left.segment<3>(i * channels + 3 * part).squaredNorm());
    std::vector<double> sorted = d2;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
    const double s2 = std::max(1e-12, sorted[sorted.size() / 2] / kMedianOfChiSquare3);
    for (Eigen::Index i = 0; i < n_rows; ++i) {
      const double ratio = d2[static_cast<std::size_t>(i)] / s2;
      weight.segment<3>(i * channels + 3 * part)
          .setConstant(std::sqrt(std::min(1.0, kFullWeightBelow / std::max(ratio, 1e-9))));
    }
  }
  return weight;
}

double tailOfF(double f, double d1, double d2) {
  if (!(f > 0.0) || d1 < 1.0 || d2 < 3.0) return 1.0;
  const double a = 2.0 / (9.0 * d1);
  const double b = 2.0 / (9.0 * d2);
  const double root = std::cbrt(f);
  const double z = ((1.0 - b) * root - (1.0 - a)) / std::sqrt(b * root * root + a);
  return 0.5 * std::erfc(z / std::numbers::sqrt2);
}

std::vector<Trace> findTraces(const Linearized& at, const GapRows& rows, const GapModel& state) {
  const TraceTest test(at);
  std::vector<Trace> traces{ofLayers(test, at), ofGainByPlace(test, at)};
  if (rows.has_times && spanOf(at).length_s > 0.0) {
    traces.push_back(ofMemory(test, at));
    traces.push_back(ofDriftingCoils(test, at));
    traces.push_back(ofChangedSensor(test, at));
    for (const GapTerm& term : state.terms)
      if (term.effect->body != nullptr) traces.push_back(ofStrengthInTime(test, at, term));
  }
  std::stable_sort(traces.begin(), traces.end(), [](const Trace& a, const Trace& b) { return a.p_value < b.p_value; });
  return traces;
}

}  // namespace fieldtrue::identify
