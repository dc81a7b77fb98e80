#include "calib/correctors/automatic_blend.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "calib/core/json_reader.h"
#include "calib/correctors/readers.h"

namespace fieldtrue::correctors {
namespace {

constexpr std::size_t kMostMembers = 4;
constexpr double kLeastWeight = 0.01;
constexpr double kLeastBlendGain = 0.05;
constexpr double kMostly = 1.645;  ///< SDs of signed ranks: one-sided 95 %.
constexpr double kRidge = 1e-12;   ///< Of the mean square, so that candidates that are the same can be told apart.

/// Sums of products of the candidates' held-out errors, a place counting once; of skipped ones nothing is used [m2].
using Gram = Eigen::MatrixXd;

struct Weighted {
  std::vector<std::size_t> members;
  Eigen::VectorXd weights;
};

/// The sum-to-one weights of least square over these members, or nothing where one is negative.
std::optional<Eigen::VectorXd> weightsOver(const Gram& gram, const std::vector<std::size_t>& members) {
  const auto n = static_cast<Eigen::Index>(members.size());
  Eigen::MatrixXd system(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      system(i, j) = gram(static_cast<Eigen::Index>(members[static_cast<std::size_t>(i)]),
                          static_cast<Eigen::Index>(members[static_cast<std::size_t>(j)]));
  system.diagonal().array() += kRidge * system.diagonal().mean();
  const Eigen::VectorXd solved = system.ldlt().solve(Eigen::VectorXd::Ones(n));
  if (!solved.allFinite() || !(solved.sum() > 0.0)) return std::nullopt;
  const Eigen::VectorXd weights = solved / solved.sum();
  if (weights.minCoeff() < 0.0) return std::nullopt;
  return weights;
}

double squareOf(const Gram& gram, const Weighted& blend) {
  double sum = 0.0;
  for (std::size_t i = 0; i < blend.members.size(); ++i)
    for (std::size_t j = 0; j < blend.members.size(); ++j)
      sum += blend.weights[static_cast<Eigen::Index>(i)] * blend.weights[static_cast<Eigen::Index>(j)] *
             gram(static_cast<Eigen::Index>(blend.members[i]), static_cast<Eigen::Index>(blend.members[j]));
  return sum;
}

/// The best candidate of each of the methods that err least, ascending.
std::vector<std::size_t> bestOfMethods(const std::vector<AutomaticCandidate>& candidates,
                                       const std::vector<InnerScore>& scores, const Gram& gram) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (!scores[i].skipped) order.push_back(i);
  const auto square = [&gram](std::size_t i) {
    return gram(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i));
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return square(a) < square(b); });
  std::set<std::string> methods;
  std::vector<std::size_t> best;
  for (const std::size_t i : order)
    if (best.size() < kMostMembers && methods.insert(candidates[i].method->id).second) best.push_back(i);
  std::sort(best.begin(), best.end());
  return best;
}

/// The blend of least square. So few members may be tried in every subset, which no start or tolerance decides.
Weighted leastSquares(const Gram& gram, const std::vector<std::size_t>& from) {
  Weighted best;
  double least = HUGE_VAL;
  for (unsigned subset = 1; subset < (1U << from.size()); ++subset) {
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < from.size(); ++i)
      if ((subset >> i) & 1U) members.push_back(from[i]);
    const auto weights = weightsOver(gram, members);
    if (!weights || (members.size() > 1 && weights->minCoeff() < kLeastWeight)) continue;
    Weighted tried = {members, *weights};
    const double square = squareOf(gram, tried);
    if (square >= least) continue;
    least = square;
    best = std::move(tried);
  }
  return best;
}

/// Products of held-out errors in every fold. @param shares of the region, by row
std::vector<Gram> gramsOf(const std::vector<InnerScore>& scores, const InnerFolds& folds,
                          const std::vector<double>& shares) {
  const auto n = static_cast<Eigen::Index>(scores.size());
  std::vector<Gram> grams;
  for (const auto& fold : folds.rows) {
    Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(fold.size()), n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const InnerScore& score = scores[static_cast<std::size_t>(i)];
      if (score.skipped) continue;
      for (std::size_t k = 0; k < fold.size(); ++k)
        errors.block<3, 1>(3 * static_cast<Eigen::Index>(k), i) =
            std::sqrt(shares[fold[k]]) * score.row_residual_m[fold[k]];
    }
    grams.emplace_back(errors.transpose() * errors);
  }
  return grams;
}

Eigen::Vector3d residualOf(const Weighted& blend, const std::vector<InnerScore>& scores, std::size_t row) {
  Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < blend.members.size(); ++i)
    sum_m += blend.weights[static_cast<Eigen::Index>(i)] * scores[blend.members[i]].row_residual_m[row];
  return sum_m;
}

class BlendModel : public PositionModel {
 public:
  explicit BlendModel(std::vector<BlendMember> members) : members_(std::move(members)) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return mean<Eigen::Vector3d>([&](const PositionModel& model) { return model.displacement_m(p_tracked_m); });
  }
  bool takesOrientation() const override {
    return std::any_of(members_.begin(), members_.end(),
                       [](const BlendMember& member) { return member.model->takesOrientation(); });
  }
  Eigen::Vector3d displacementAt_m(const Pose& tracked) const override {
    return mean<Eigen::Vector3d>([&](const PositionModel& model) { return model.displacementAt_m(tracked); });
  }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override {
    return mean<Eigen::Matrix3d>([&](const PositionModel& model) { return model.jacobian(p_tracked_m); });
  }
  std::optional<double> uncertainty_m(const Eigen::Vector3d& p_tracked_m) const override {
    return uncertaintyOf([&](const PositionModel& model) { return model.uncertainty_m(p_tracked_m); });
  }
  std::optional<double> uncertaintyAt_m(const Pose& tracked) const override {
    return uncertaintyOf([&](const PositionModel& model) { return model.uncertaintyAt_m(tracked); });
  }
  bool covers(const Eigen::Vector3d& p_tracked_m) const override {
    return std::all_of(members_.begin(), members_.end(),
                       [&](const BlendMember& member) { return member.model->covers(p_tracked_m); });
  }
  std::string note() const override {
    std::string notes;
    for (const BlendMember& member : members_) {
      const std::string own = member.model->note();
      if (own.empty()) continue;
      notes += notes.empty() ? "" : " ";
      notes += member.method;
      notes += ": ";
      notes += own;
    }
    return notes;
  }
  nlohmann::json parameters() const override {
    nlohmann::json members = nlohmann::json::array();
    for (const BlendMember& member : members_)
      members.push_back({{"method", member.method},
                         {"settings", member.settings},
                         {"weight", member.weight},
                         {"model", member.model->parameters()}});
    return {{"members", std::move(members)}};
  }

 private:
  template <class Value, class Of>
  Value mean(const Of& of) const {
    Value sum = Value::Zero();
    for (const BlendMember& member : members_) sum += member.weight * of(*member.model);
    return sum;
  }
  template <class Of>
  std::optional<double> uncertaintyOf(const Of& of) const {
    double sum_m = 0.0;
    for (const BlendMember& member : members_) {
      const std::optional<double> own_m = of(*member.model);
      if (!own_m) return std::nullopt;
      sum_m += member.weight * *own_m;
    }
    return sum_m;
  }

  std::vector<BlendMember> members_;
};

}  // namespace

std::optional<Blend> blendCandidates(const std::vector<AutomaticCandidate>& candidates,
                                     const std::vector<InnerScore>& scores, const FitData& data,
                                     const InnerFolds& folds) {
  const std::vector<std::size_t> slots = placeSlots(data);
  std::vector<double> n_rows(1 + *std::max_element(slots.begin(), slots.end()), 0.0);
  for (const std::size_t slot : slots) n_rows[slot] += 1.0;
  std::vector<double> row_shares;
  for (const std::size_t slot : slots) row_shares.push_back(folds.shares[slot] / n_rows[slot]);
  const std::vector<Gram> grams = gramsOf(scores, folds, row_shares);
  const auto n = static_cast<Eigen::Index>(scores.size());
  const Gram all = std::accumulate(grams.begin(), grams.end(), Gram(Gram::Zero(n, n)));

  const Weighted chosen = leastSquares(all, bestOfMethods(candidates, scores, all));
  if (chosen.members.size() < 2) return std::nullopt;
  Blend blend;
  blend.members = chosen.members;
  blend.weights.assign(chosen.weights.data(), chosen.weights.data() + chosen.weights.size());
  blend.score.dimension = data.dimension;
  blend.score.shares = folds.shares;
  blend.score.squares_m2.assign(n_rows.size(), 0.0);
  blend.score.residual_m.assign(n_rows.size(), Eigen::Vector3d::Zero());
  blend.score.row_residual_m.assign(data.size(), Eigen::Vector3d::Zero());
  for (std::size_t k = 0; k < folds.rows.size(); ++k) {
    const Gram others = all - grams[k];
    const Weighted without = leastSquares(others, bestOfMethods(candidates, scores, others));
    for (const std::size_t row : folds.rows[k])
      blend.score.add(slots[row], row, residualOf(without, scores, row), 1.0 / n_rows[slots[row]]);
  }
  return blend;
}

bool isWorthBlending(const InnerScore& blend, const InnerScore& chosen) {
  return blend.rms_m() <= (1.0 - kLeastBlendGain) * chosen.rms_m() && errsLessMostly(blend, chosen) > kMostly;
}

std::unique_ptr<PositionModel> makeBlend(std::vector<BlendMember> members) {
  FT_CHECK(!members.empty());
  return std::make_unique<BlendModel>(std::move(members));
}

std::unique_ptr<PositionModel> readBlend(const JsonReader& parameters) {
  std::vector<BlendMember> members;
  double sum = 0.0;
  const JsonReader stored_members = parameters["members"];
  for (const JsonReader& stored : stored_members.entries()) {
    BlendMember member;
    member.method = stored["method"].text();
    const auto read = stored["method"].valueOf(findPositionReader(member.method));
    if (read == &readAutomaticPosition) stored["method"].refuse("another one: a blend cannot hold an automatic choice");
    member.settings = stored["settings"].object();
    member.weight = stored["weight"].number();
    if (!(member.weight > 0.0 && member.weight <= 1.0)) stored["weight"].refuse("a number above 0 and at most 1");
    sum += member.weight;
    member.model = read(stored["model"]);
    members.push_back(std::move(member));
  }
  if (std::abs(sum - 1.0) > 1e-9) stored_members.refuse("weights that sum to 1");
  return makeBlend(std::move(members));
}

}  // namespace fieldtrue::correctors
