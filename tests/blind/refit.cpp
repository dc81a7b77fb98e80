#include "tests/blind/refit.h"

#include <algorithm>
#include <cmath>

namespace blind {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kAlignmentScale_m = 0.01, kAlignmentScale_rad = 0.01;
constexpr double kSizeScale = 0.3;  ///< As a share of the size.
constexpr double kFarthest = 5;     ///< In scales: farther from where it was drawn no shape is believable.
constexpr double kDifference = 1e-3;

/// Twice the negative log likelihood of a whitened residual, and its weight among squares.
struct Loss {
  double cost = 0, weight = 1;
};

Loss lossOf(double residual, bool has_heavy_tails) {
  const double square = residual * residual;
  if (!has_heavy_tails) return {square, 1};
  // Student's t of 4 degrees of freedom at unit variance: density ~ (1 + r^2 / 2)^(-5/2).
  return {5 * std::log1p(square / 2), 5 / (2 + square)};
}

double costOf(const VectorXd& residuals, bool has_heavy_tails) {
  double sum = 0;
  for (const double residual : residuals) sum += lossOf(residual, has_heavy_tails).cost;
  return sum;
}

class Problem {
 public:
  Problem(const Setup& setup, const std::vector<Placed>& effects, std::vector<RefittedEffect> start,
          std::span<const SolvedPose> readings)
      : setup_(setup),
        effects_(effects),
        start_(std::move(start)),
        readings_(readings),
        whitening_(setup),
        mounting_(setup.position_only ? 0 : 3),
        lever_(setup.orientations > 1 || setup.alignment_known ? 3 : 0) {
    for (const Placed& effect : effects) shape_unknowns_ += 1 + static_cast<Eigen::Index>(effect.drawn.scales.size());
  }

  Eigen::Index alignmentUnknowns() const { return 6 + mounting_ + lever_; }
  Eigen::Index unknowns() const { return alignmentUnknowns() + shape_unknowns_; }
  bool hasHeavyTails() const { return setup_.heavy_tails; }

  Setup setupAt(const VectorXd& at) const {
    Setup moved = setup_;
    const Vector3d turn_rad = kAlignmentScale_rad * at.segment<3>(3);
    moved.tracker_from_jig = turned(turn_rad, setup_.tracker_from_jig);
    moved.jig_in_tracker_m =
        turned(turn_rad, Quaterniond::Identity()) * setup_.jig_in_tracker_m + kAlignmentScale_m * at.head<3>();
    if (mounting_ > 0)
      moved.mounting = setup_.mounting * turned(kAlignmentScale_rad * at.segment<3>(6), Quaterniond::Identity());
    if (lever_ > 0) moved.lever_m += kAlignmentScale_m * at.segment<3>(6 + mounting_);
    return moved;
  }

  std::vector<RefittedEffect> effectsAt(const VectorXd& at) const {
    std::vector<RefittedEffect> effects = start_;
    Eigen::Index next = alignmentUnknowns();
    for (std::size_t e = 0; e < effects.size(); ++e) {
      effects[e].size *= 1 + kSizeScale * at[next++];
      for (std::size_t k = 0; k < effects[e].change.size(); ++k)
        effects[e].change[k] += effects_[e].drawn.scales[k] * at[next++];
    }
    return effects;
  }

  World worldAt(const VectorXd& at) const {
    World world;
    const std::vector<RefittedEffect> effects = effectsAt(at);
    for (std::size_t e = 0; e < effects.size(); ++e) effects_[e].drawn.apply(world, effects[e].size, effects[e].change);
    return world;
  }

  VectorXd residuals(const VectorXd& at, const World& world) const {
    const Setup setup = setupAt(at);
    const Eigen::Index channels = whitening_.channels();
    const auto rows = static_cast<Eigen::Index>(setup.rows.size());
    VectorXd left(rows * channels + knownUnknowns());
    for (Eigen::Index r = 0; r < rows; ++r) {
      const auto row = static_cast<std::size_t>(r);
      const SolvedPose pose = reported(setup, world, setup.rows[row]);
      Eigen::Matrix<double, 6, 1> change;
      change << pose.position_m - readings_[row].position_m,
          rotationVector(pose.orientation * readings_[row].orientation.conjugate());
      left.segment(r * channels, channels) = whitening_.whitenedPose(static_cast<int>(r), change);
    }
    for (Eigen::Index u = 0; u < knownUnknowns(); ++u) {
      const bool is_length = u < 3 || u >= 6 + mounting_;
      left[rows * channels + u] =
          at[u] * (is_length ? kAlignmentScale_m / setup_.alignment_m : kAlignmentScale_rad / setup_.alignment_rad);
    }
    return left;
  }

  /// @param free how many unknowns may change, the alignment's first
  MatrixXd jacobian(const VectorXd& at, const World& world, const VectorXd& left, Eigen::Index free) const {
    MatrixXd derivative(left.size(), free);
    for (Eigen::Index k = 0; k < free; ++k) {
      VectorXd beside = at;
      beside[k] += kDifference;
      const bool moves_world = k >= alignmentUnknowns();
      derivative.col(k) = (residuals(beside, moves_world ? worldAt(beside) : world) - left) / kDifference;
    }
    return derivative;
  }

  /// Keeps shapes believable.
  VectorXd within(VectorXd at) const {
    auto shape = at.tail(shape_unknowns_).array();
    shape = shape.cwiseMax(-kFarthest).cwiseMin(kFarthest);
    return at;
  }

 private:
  Eigen::Index knownUnknowns() const { return setup_.alignment_known ? alignmentUnknowns() : 0; }

  const Setup& setup_;
  const std::vector<Placed>& effects_;
  std::vector<RefittedEffect> start_;
  std::span<const SolvedPose> readings_;
  Alignment whitening_;
  Eigen::Index mounting_, lever_;
  Eigen::Index shape_unknowns_ = 0;
};

/// What no row tells stays where it is: the least norm, by a weak pull.
VectorXd dampedStep(const MatrixXd& derivative, const VectorXd& left, bool has_heavy_tails, double damping) {
  constexpr double kWeak = 1e-12;
  VectorXd weights(left.size());
  for (Eigen::Index i = 0; i < left.size(); ++i) weights[i] = lossOf(left[i], has_heavy_tails).weight;
  MatrixXd normal = derivative.transpose() * weights.asDiagonal() * derivative;
  normal.diagonal() *= 1 + damping;
  normal.diagonal().array() += kWeak * normal.diagonal().maxCoeff();
  return normal.ldlt().solve(-derivative.transpose() * weights.cwiseProduct(left));
}

struct Found {
  VectorXd at;
  World world;
  VectorXd left;
  double cost = 0;
};

Found foundAt(const Problem& problem, const VectorXd& at) {
  Found found{at, problem.worldAt(at), {}, 0};
  found.left = problem.residuals(at, found.world);
  found.cost = costOf(found.left, problem.hasHeavyTails());
  return found;
}

/// Goes down from `best` in the first `free` unknowns.
Found descended(const Problem& problem, Found best, Eigen::Index free) {
  constexpr int kSteps = 40, kTries = 12;
  constexpr double kSettled = 1e-7;
  double damping = 1e-4;
  bool is_settled = false;
  for (int step = 0; step < kSteps && !is_settled; ++step) {
    const MatrixXd derivative = problem.jacobian(best.at, best.world, best.left, free);
    is_settled = true;
    for (int attempt = 0; attempt < kTries; ++attempt, damping *= 8) {
      VectorXd next = best.at;
      next.head(free) += dampedStep(derivative, best.left, problem.hasHeavyTails(), damping);
      Found found = foundAt(problem, problem.within(next));
      if (!(found.cost < best.cost)) continue;
      is_settled = best.cost - found.cost < kSettled * best.cost;
      best = std::move(found);
      damping = std::max(1e-9, damping / 10);
      break;
    }
  }
  return best;
}

}  // namespace

Refit refitted(const Setup& setup, const std::vector<Placed>& effects, std::vector<RefittedEffect> start,
               std::span<const SolvedPose> readings, bool fits_effects) {
  const Problem problem(setup, effects, std::move(start), readings);
  Found found = foundAt(problem, VectorXd::Zero(problem.unknowns()));
  found = descended(problem, std::move(found), problem.alignmentUnknowns());
  if (fits_effects) found = descended(problem, std::move(found), problem.unknowns());
  return {problem.setupAt(found.at), problem.effectsAt(found.at), std::move(found.world), found.cost};
}

std::vector<RefittedEffect> asDrawn(const std::vector<Placed>& effects) {
  std::vector<RefittedEffect> drawn;
  for (const Placed& effect : effects)
    drawn.push_back({effect.size, std::vector<double>(effect.drawn.scales.size(), 0.0)});
  return drawn;
}

}  // namespace blind
