#include "calib/correctors/network/feed_forward_network.h"

#include <cmath>
#include <random>

#include "calib/core/json_reader.h"

namespace fieldtrue::correctors {
namespace {

using Nodes = FeedForwardNetwork::Nodes;

Nodes logistic(const Nodes& s) { return (1.0 + (-s.array()).exp()).inverse().matrix(); }

/// df/ds of the logistic function, from its value.
Nodes slopeOf(const Nodes& f) { return (f.array() * (1.0 - f.array())).matrix(); }

/// d output / d input of the nodes of a layer; takes no memory from the heap.
using Gradients = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, FeedForwardNetwork::kMostHidden>;

/// The same numbers on every platform, which std::uniform_real_distribution does not promise.
class Uniform {
 public:
  explicit Uniform(std::uint64_t seed) : generator_(seed) {}
  double within(double half_width) {
    constexpr double kStep = 1.0 / 9007199254740992.0;  // 2^-53
    return half_width * (2.0 * static_cast<double>(generator_() >> 11) * kStep - 1.0);
  }

 private:
  std::mt19937_64 generator_;
};

}  // namespace

FeedForwardNetwork::FeedForwardNetwork(int n_first, int n_second)
    : n_first_(n_first), n_second_(n_second), weights_(Weights::Zero(weightCount(n_first, n_second))) {}

int FeedForwardNetwork::weightCount(int n_first, int n_second) {
  return (3 + 1) * n_first + (n_first + 1) * n_second + (n_second + 1) * 3;
}

void FeedForwardNetwork::setRandomWeights(std::uint64_t seed) {
  Uniform uniform(seed);
  const auto fill = [&](Eigen::Index start, Eigen::Index count, double half_width) {
    for (Eigen::Index i = 0; i < count; ++i) weights_[start + i] = uniform.within(half_width);
  };
  constexpr double kLogistic = 4.0;
  fill(0, secondStart(), kLogistic * std::sqrt(6.0 / static_cast<double>(3 + n_first_)));
  fill(secondStart(), thirdStart() - secondStart(),
       kLogistic * std::sqrt(6.0 / static_cast<double>(n_first_ + n_second_)));
  fill(thirdStart(), weights_.size() - thirdStart(), std::sqrt(6.0 / static_cast<double>(n_second_ + 3)));
}

void FeedForwardNetwork::setWeights(const Weights& weights) {
  FT_CHECK(weights.size() == weights_.size());
  weights_ = weights;
}

FeedForwardNetwork::Activity FeedForwardNetwork::activity(const Eigen::Vector3d& x) const {
  Activity a;
  a.first = biases(3 * n_first_, n_first_);
  a.first.noalias() += layer(0, n_first_, 3) * x;
  a.first = logistic(a.first);
  a.second = biases(secondStart() + n_first_ * n_second_, n_second_);
  a.second.noalias() += layer(secondStart(), n_second_, n_first_) * a.first;
  a.second = logistic(a.second);
  return a;
}

Eigen::Vector3d FeedForwardNetwork::outputOf(const Activity& a) const {
  return layer(thirdStart(), 3, n_second_) * a.second + biases(thirdStart() + 3 * n_second_, 3);
}

Eigen::Vector3d FeedForwardNetwork::output(const Eigen::Vector3d& x) const { return outputOf(activity(x)); }

Eigen::Matrix3d FeedForwardNetwork::gradient(const Eigen::Vector3d& x) const {
  const Activity a = activity(x);
  const Gradients to_second = layer(thirdStart(), 3, n_second_) * slopeOf(a.second).asDiagonal();
  Gradients to_first = to_second.lazyProduct(layer(secondStart(), n_second_, n_first_));
  to_first *= slopeOf(a.first).asDiagonal();
  return to_first * layer(0, n_first_, 3);
}

Eigen::Vector3d FeedForwardNetwork::outputWithWeightJacobian(const Eigen::Vector3d& x, WeightJacobian& jacobian) const {
  const Activity a = activity(x);
  // d output / d input of the nodes of each hidden layer; of the outputs it is the identity.
  const Gradients to_second = layer(thirdStart(), 3, n_second_) * slopeOf(a.second).asDiagonal();
  Gradients to_first = to_second.lazyProduct(layer(secondStart(), n_second_, n_first_));
  to_first *= slopeOf(a.first).asDiagonal();
  jacobian.setZero(3, weights_.size());
  for (Eigen::Index node = 0; node < n_first_; ++node)
    jacobian.middleCols<3>(3 * node) = to_first.col(node) * x.transpose();
  jacobian.middleCols(3 * n_first_, n_first_) = to_first;
  for (Eigen::Index node = 0; node < n_second_; ++node)
    jacobian.middleCols(secondStart() + node * n_first_, n_first_) = to_second.col(node) * a.first.transpose();
  jacobian.middleCols(secondStart() + n_first_ * n_second_, n_second_) = to_second;
  for (int k = 0; k < 3; ++k) {
    jacobian.row(k).segment(thirdStart() + k * n_second_, n_second_) = a.second.transpose();
    jacobian(k, thirdStart() + 3 * n_second_ + k) = 1.0;
  }
  return outputOf(a);
}

nlohmann::json FeedForwardNetwork::toJson() const {
  return {{"hidden", {n_first_, n_second_}},
          {"weights", std::vector<double>(weights_.data(), weights_.data() + weights_.size())}};
}

FeedForwardNetwork FeedForwardNetwork::fromJson(const JsonReader& json) {
  const auto hidden = json["hidden"].integers();
  if (hidden.size() != 2 || hidden[0] < 1 || hidden[0] > kMostHidden || hidden[1] < 1 || hidden[1] > kMostHidden)
    json["hidden"].refuse("two layers of 1 to " + std::to_string(kMostHidden) + " nodes");
  const auto weights = json["weights"].numbers();
  FeedForwardNetwork network(hidden[0], hidden[1]);
  if (static_cast<Eigen::Index>(weights.size()) != network.weights_.size())
    json["weights"].refuse(std::to_string(network.weights_.size()) + " numbers");
  network.weights_ = Eigen::Map<const Eigen::VectorXd>(weights.data(), network.weights_.size());
  return network;
}

}  // namespace fieldtrue::correctors
