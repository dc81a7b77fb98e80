#include "calib/identify/structure.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "calib/effects/course.h"
#include "calib/field/dipole_field.h"
#include "calib/identify/origin.h"
#include "calib/identify/traces.h"

namespace fieldtrue::identify {
namespace {

constexpr int kGroups = 4;  // Room, transmitter, sensor, jig or time.
constexpr double kRidge = 1e-7;

/// Values of the regular solid harmonics of degree 1 to `degree`, by the Legendre recurrences in Cartesian form.
Eigen::VectorXd harmonics(const Eigen::Vector3d& p, int degree) {
  const double r2 = p.squaredNorm();
  Eigen::VectorXd values(degree * (degree + 2));
  double a = 1.0;  // Real and imaginary part of (x + iy)^m.
  double b = 0.0;
  for (int m = 0; m <= degree; ++m) {
    double before = 0.0;
    double legendre = 1.0;
    for (int l = m; l <= degree; ++l) {
      if (l > m) {
        const double next = ((2 * l - 1) * p.z() * legendre - (l + m - 1) * r2 * before) / (l - m);
        before = legendre;
        legendre = next;
      }
      if (l == 0) continue;
      const int first = l * l - 1;
      values[first + (m == 0 ? 0 : 2 * m - 1)] = legendre * a;
      if (m > 0) values[first + 2 * m] = legendre * b;
    }
    const double next_a = a * p.x() - b * p.y();
    b = a * p.y() + b * p.x();
    a = next_a;
  }
  return values;
}

struct Basis {
  Eigen::MatrixXd columns;
  std::array<Eigen::Index, kGroups + 1> begin{};
};

class BasisBuilder {
 public:
  BasisBuilder(const Linearized& at, const GapRows& rows) : at_(at), rows_(rows) {
    const auto settings = at.settings();
    for (const field::SensorSetting& s : settings) box_.extend(s.tracker_from_sensor.position_m);
    for (const field::SensorSetting& s : settings) {
      rig_.extend(inRig(s));
      first_s_ = std::min(first_s_, s.time_s);
      last_s_ = std::max(last_s_, s.time_s);
    }
    // Half of the residuals at most: what is left must tell the noise.
    const auto budget = static_cast<int>(at.size() / 2 - at.nuisance().cols());
    while (degree_ > 1 && 3 * degree_ * (degree_ + 2) + 60 > budget) --degree_;
    has_bend_ = 3 * degree_ * (degree_ + 2) + 60 <= budget;
    const std::vector<std::size_t> stretches = effects::stretchesFor(settings.size());
    if (!stretches.empty() && last_s_ > first_s_) course_.emplace(first_s_, last_s_, stretches.back());
  }

  /// No columns at all where these would leave next to nothing of so few rows: what is left would not tell the noise.
  Basis build() const {
    Basis basis = whole();
    const auto most = static_cast<Eigen::Index>(kMostOfResiduals * static_cast<double>(at_.size()));
    if (basis.columns.cols() + at_.nuisance().cols() <= most) return basis;
    basis.columns.resize(at_.size(), 0);
    basis.begin = {};
    return basis;
  }

 private:
  static constexpr double kMostOfResiduals = 0.9;

  Basis whole() const {
    Basis basis;
    std::vector<std::vector<field::EffectResponse>> groups(kGroups);
    std::array<std::size_t, kGroups> counts{};
    for (std::size_t k = 0; k < at_.settings().size(); ++k) {
      for (std::size_t g = 0; g < kGroups; ++g) {
        const std::vector<field::EffectResponse> own = responses(g, at_.settings()[k]);
        counts[g] = own.size();
        groups[g].insert(groups[g].end(), own.begin(), own.end());
      }
    }
    Eigen::Index total = 0;
    for (std::size_t g = 0; g < kGroups; ++g) {
      basis.begin[g] = total;
      total += static_cast<Eigen::Index>(counts[g]);
    }
    basis.begin[kGroups] = total;
    basis.columns.resize(at_.size(), total);
    for (std::size_t g = 0; g < kGroups; ++g) {
      const auto count = static_cast<Eigen::Index>(counts[g]);
      if (count > 0) basis.columns.middleCols(basis.begin[g], count) = at_.columnsOf(groups[g], count);
    }
    return basis;
  }

  static Eigen::Vector3d inRig(const field::SensorSetting& s) {
    return inverse(s.tracker_from_reference) * s.tracker_from_sensor.position_m;
  }

  std::vector<field::EffectResponse> responses(std::size_t group, const field::SensorSetting& s) const {
    switch (group) {
      case 0:
        return ofRoom(s);
      case 1:
        return ofTransmitter(s);
      case 2:
        return ofSensor(s);
      default:
        return ofJigAndTime(s);
    }
  }

  std::vector<field::EffectResponse> ofRoom(const field::SensorSetting& s) const {
    const double length_m = 0.5 * box_.sizes().maxCoeff();
    const Eigen::Matrix3Xd gradients =
        harmonicGradients((s.tracker_from_sensor.position_m - box_.center()) / length_m, degree_);
    std::vector<field::EffectResponse> list;
    for (Eigen::Index j = 0; j < gradients.cols(); ++j) {
      for (int coil = 0; coil < 3; ++coil) {
        field::EffectResponse response;
        response.field_per_m3.col(coil) = gradients.col(j);
        list.push_back(response);
      }
    }
    return list;
  }

  static std::vector<field::EffectResponse> ofTransmitter(const field::SensorSetting& s) {
    const Eigen::Matrix3d G = field::dipoleField(s.tracker_from_sensor.position_m, 1.0);
    std::vector<field::EffectResponse> list(9);
    std::size_t next = 0;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) list[next++].field_per_m3.col(b) = G.col(a);
    return list;
  }

  static std::vector<field::EffectResponse> ofSensor(const field::SensorSetting& s) {
    const Eigen::Matrix3d G = field::dipoleField(s.tracker_from_sensor.position_m, 1.0);
    const Eigen::Matrix3d R = s.tracker_from_sensor.orientation.toRotationMatrix();
    std::vector<field::EffectResponse> list(9);
    std::size_t next = 0;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) list[next++].field_per_m3 = R.col(a) * (R.col(b).transpose() * G);
    return list;
  }

  std::vector<field::EffectResponse> ofJigAndTime(const field::SensorSetting& s) const {
    std::vector<field::EffectResponse> list;
    const Eigen::Vector3d half_m = (0.5 * rig_.sizes()).cwiseMax(1e-3);
    const Eigen::Vector3d c = (inRig(s) - rig_.center()).cwiseQuotient(half_m);
    std::vector<double> shapes{c.x(), c.y(), c.z()};
    if (has_bend_) {
      for (const double bent :
           {c.x() * c.x(), c.y() * c.y(), c.z() * c.z(), c.x() * c.y(), c.x() * c.z(), c.y() * c.z()})
        shapes.push_back(bent);
    }
    for (const double shape : shapes) {
      for (int axis = 0; axis < 3; ++axis) {
        field::EffectResponse response;
        response.shift_m = shape * (s.tracker_from_reference.orientation * Eigen::Vector3d::Unit(axis));
        list.push_back(response);
      }
    }
    if (!rows_.has_times || last_s_ <= first_s_) return list;
    const double t = 2.0 * (s.time_s - first_s_) / (last_s_ - first_s_) - 1.0;
    const Eigen::Matrix3d G = field::dipoleField(s.tracker_from_sensor.position_m, 1.0);
    std::vector<double> courses{t, t * t, t * t * t};
    if (course_) {
      courses.assign(course_->times_s().size() - 1, 0.0);  // What is level at first is the transmitter's.
      course_->weigh(s.time_s, [&](std::size_t k, double share) {
        if (k > 0) courses[k - 1] = share;
      });
    }
    for (const double shape : courses) {
      field::EffectResponse gain;
      gain.field_per_m3 = shape * G;
      list.push_back(gain);
    }
    for (int axis = 0; axis < 3; ++axis) {
      field::EffectResponse wander;
      wander.shift_m = t * Eigen::Vector3d::Unit(axis);
      list.push_back(wander);
    }
    return list;
  }

  const Linearized& at_;
  const GapRows& rows_;
  Eigen::AlignedBox3d box_;
  Eigen::AlignedBox3d rig_;
  double first_s_ = std::numeric_limits<double>::infinity();
  double last_s_ = -std::numeric_limits<double>::infinity();
  std::optional<effects::Course> course_;  ///< Of the gain, where there are rows enough.
  int degree_ = 3;
  bool has_bend_ = true;
};

/// Normal equations of [nuisance, basis] with columns of unit length.
struct Normal {
  Eigen::MatrixXd columns;
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;
};

Normal normalOf(const Linearized& at, const Eigen::MatrixXd& basis, const Eigen::VectorXd& weight) {
  const Eigen::Index q = at.nuisance().cols();
  Normal normal;
  normal.columns.resize(at.size(), q + basis.cols());
  normal.columns.leftCols(q) = at.nuisance();
  normal.columns.rightCols(basis.cols()) = basis;
  normal.columns = weight.asDiagonal() * normal.columns;
  for (Eigen::Index j = 0; j < normal.columns.cols(); ++j) {
    const double norm = normal.columns.col(j).norm();
    if (norm > 0.0) normal.columns.col(j) /= norm;
  }
  normal.matrix = normal.columns.transpose() * normal.columns;
  normal.right = normal.columns.transpose() * (weight.asDiagonal() * at.residual());
  return normal;
}

struct SubsetFit {
  double explained = 0.0;
  double n_effective = 0.0;  ///< Parameters that count, as the trace of the hat matrix.
  Eigen::VectorXd x;
};

SubsetFit fitSubset(const Normal& normal, const std::vector<Eigen::Index>& columns) {
  const auto n = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd matrix(n, n);
  Eigen::VectorXd right(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    right[i] = normal.right[columns[static_cast<std::size_t>(i)]];
    for (Eigen::Index j = 0; j < n; ++j)
      matrix(i, j) = normal.matrix(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)]);
  }
  Eigen::MatrixXd ridged = matrix;
  ridged.diagonal().array() += kRidge;
  const Eigen::LLT<Eigen::MatrixXd> factor(ridged);
  SubsetFit fit;
  fit.x = factor.solve(right);
  fit.explained = 2.0 * fit.x.dot(right) - fit.x.dot(matrix * fit.x);
  fit.n_effective = factor.solve(matrix).trace();
  return fit;
}

/// Leverage of every channel in the fit of all columns.
Eigen::VectorXd leverageIn(const Normal& normal) {
  Eigen::MatrixXd ridged = normal.matrix;
  ridged.diagonal().array() += kRidge;
  const Eigen::LLT<Eigen::MatrixXd> factor(ridged);
  return factor.matrixL().solve(normal.columns.transpose()).colwise().squaredNorm();
}

std::vector<Eigen::Index> columnsOfGroups(const Basis& basis, Eigen::Index q, unsigned groups) {
  std::vector<Eigen::Index> columns;
  for (Eigen::Index j = 0; j < q; ++j) columns.push_back(j);
  for (std::size_t g = 0; g < kGroups; ++g) {
    if ((groups >> g & 1U) == 0) continue;
    for (Eigen::Index j = basis.begin[g]; j < basis.begin[g + 1]; ++j) columns.push_back(q + j);
  }
  return columns;
}

/// Shares of the explained energy by Shapley's rule: each group's gain averaged over the orders of adding.
GapOrigin originOf(const Normal& normal, const Basis& basis, Eigen::Index q, double variance) {
  std::array<double, 1 << kGroups> value{};
  const SubsetFit none = fitSubset(normal, columnsOfGroups(basis, q, 0));
  for (unsigned groups = 1; groups < value.size(); ++groups) {
    const SubsetFit fit = fitSubset(normal, columnsOfGroups(basis, q, groups));
    value[groups] = std::max(0.0, fit.explained - none.explained - (fit.n_effective - none.n_effective) * variance);
  }
  constexpr std::array<double, kGroups> kWeight{1.0 / 4.0, 1.0 / 12.0, 1.0 / 12.0, 1.0 / 4.0};  // |S|! (3 - |S|)! / 4!
  std::array<double, kGroups> share{};
  for (unsigned g = 0; g < kGroups; ++g) {
    for (unsigned others = 0; others < value.size(); ++others) {
      if ((others >> g & 1U) != 0) continue;
      share[g] += kWeight[static_cast<std::size_t>(std::popcount(others))] * (value[others | 1U << g] - value[others]);
    }
    share[g] = std::max(0.0, share[g]);
  }
  const double sum = share[0] + share[1] + share[2] + share[3];
  if (!(sum > 0.0)) return {};
  return {share[0] / sum, share[1] / sum, share[2] / sum, share[3] / sum};
}

/// Under a normal law the t scale with 8 degrees of freedom is 0.915 of the SD.
constexpr double kScaleOfNormal = 0.915;

/// @param leverage of every channel
void setNoise(const Eigen::VectorXd& left, const Eigen::VectorXd& leverage, const Linearized& at,
              Structure& structure) {
  constexpr double kMostLeverage = 0.9;  // More is the fit's word for the row, not the row's.
  structure.noise.assign(at.order().size(), Vector6d::Zero());
  for (std::size_t k = 0; k < at.order().size(); ++k) {
    for (Eigen::Index part = 0; part < at.channels(); part += 3) {
      const Eigen::Index first = static_cast<Eigen::Index>(k) * at.channels() + part;
      const double free = 1.0 - std::min(kMostLeverage, leverage.segment<3>(first).mean());
      structure.noise[at.order()[k]].segment<3>(part) = left.segment<3>(first) / std::sqrt(free);
    }
  }
}

void setScales(const Eigen::VectorXd& left, const Linearized& at, double inflate, bool both, Structure& structure) {
  structure.left.assign(at.order().size(), Vector6d::Zero());
  for (std::size_t k = 0; k < at.order().size(); ++k) {
    structure.left[at.order()[k]].head(at.channels()) =
        left.segment(static_cast<Eigen::Index>(k) * at.channels(), at.channels()) * inflate;
  }
  structure.scale = devianceOf(structure.left, both, {8.0}).scale;
  structure.scale.position /= kScaleOfNormal;
  structure.scale.rotation /= kScaleOfNormal;
}

}  // namespace

double normalScaleOf(std::span<const Vector6d> left) {
  return devianceOf(left, false, {8.0}).scale.position / kScaleOfNormal;
}

Eigen::Matrix3Xd harmonicGradients(const Eigen::Vector3d& p, int degree) {
  constexpr double kStep = 1e-4;  // Central differences of polynomials of degree 4: exact to 1e-8.
  Eigen::Matrix3Xd gradients(3, degree * (degree + 2));
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
    gradients.row(axis) = ((harmonics(p + step, degree) - harmonics(p - step, degree)) / (2.0 * kStep)).transpose();
  }
  return gradients;
}

Structure findStructure(const Linearized& at, const GapRows& rows, bool with_origin) {
  const Basis basis = BasisBuilder(at, rows).build();
  const Eigen::Index q = at.nuisance().cols();
  const auto n_rows = static_cast<Eigen::Index>(at.order().size());
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(at.size());
  Structure structure;
  Normal normal;
  SubsetFit full;
  SubsetFit none;
  Eigen::VectorXd left;
  for (int round = 0; round < 2; ++round) {
    normal = normalOf(at, basis.columns, weight);
    full = fitSubset(normal, columnsOfGroups(basis, q, (1U << kGroups) - 1));
    none = fitSubset(normal, columnsOfGroups(basis, q, 0));
    left = weight.asDiagonal() * at.residual() - normal.columns * full.x;
    if (round == 0) weight = robustWeights(left, n_rows, at.channels());
  }
  const double count = static_cast<double>(n_rows * at.channels());
  const double freedom = std::max(1.0, count - full.n_effective);
  const double variance = std::max(1e-12, left.squaredNorm() / freedom);
  const double extra = std::max(1.0, full.n_effective - none.n_effective);
  const double explained = std::max(0.0, full.explained - none.explained);
  structure.n_parameters = static_cast<int>(std::lround(extra));
  structure.energy = explained / variance - extra;
  structure.energy_sd = std::sqrt(2.0 * extra * (1.0 + extra / freedom));
  structure.p_value = tailOfF(explained / extra / variance, extra, freedom);
  if (with_origin) structure.origin = originOf(normal, basis, q, variance);
  setNoise(left.cwiseQuotient(weight), leverageIn(normal), at, structure);
  setScales(left.cwiseQuotient(weight), at, std::sqrt(count / freedom), at.channels() == 6, structure);
  return structure;
}

}  // namespace fieldtrue::identify
