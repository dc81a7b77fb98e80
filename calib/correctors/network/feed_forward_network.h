#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>

#include "calib/core/json_reader.h"

namespace fieldtrue::correctors {

/// A network of 3 linear inputs, two hidden layers of logistic nodes f(s) = 1/(1 + e^-s) and 3 linear outputs, with a
/// bias to every hidden and output node.
/// @source Saleh, Kindratenko, Sherman, On Using Neural Networks to Calibrate Electromagnetic Tracking Systems; survey
/// by Kindratenko, section 3.6
class FeedForwardNetwork {
 public:
  using Weights = Eigen::VectorXd;
  static constexpr int kMostHidden = 64;  ///< Of each layer.
  /// One number a node of a layer; takes no memory from the heap.
  using Nodes = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostHidden, 1>;
  using WeightJacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;

  FeedForwardNetwork() = default;
  /// All weights zero.
  FeedForwardNetwork(int n_first, int n_second);

  static int weightCount(int n_first, int n_second);

  /// Uniform weights of the width at which logistic nodes neither saturate nor stay linear; the same for a seed on
  /// every platform.
  /// @source Glorot, Bengio 2010, eq. 16, four times wider for the logistic function
  void setRandomWeights(std::uint64_t seed);

  Eigen::Vector3d output(const Eigen::Vector3d& x) const;
  /// d output / d x.
  Eigen::Matrix3d gradient(const Eigen::Vector3d& x) const;
  /// The output, and d output / d weights in the order of weights(): of each layer its matrix by rows, then its biases.
  /// @param jacobian 3 x weightCount
  Eigen::Vector3d outputWithWeightJacobian(const Eigen::Vector3d& x, WeightJacobian& jacobian) const;

  const Weights& weights() const { return weights_; }
  void setWeights(const Weights& weights);
  int firstHidden() const { return static_cast<int>(n_first_); }
  int secondHidden() const { return static_cast<int>(n_second_); }

  nlohmann::json toJson() const;
  static FeedForwardNetwork fromJson(const JsonReader& json);

 private:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  using Layer = Eigen::Map<const RowMajor>;
  using Biases = Eigen::Map<const Eigen::VectorXd>;
  /// What the hidden nodes put out.
  struct Activity {
    Nodes first;
    Nodes second;
  };

  Layer layer(Eigen::Index start, Eigen::Index rows, Eigen::Index columns) const {
    return {weights_.data() + start, rows, columns};
  }
  Biases biases(Eigen::Index start, Eigen::Index count) const { return {weights_.data() + start, count}; }
  Eigen::Index secondStart() const { return 4 * n_first_; }
  Eigen::Index thirdStart() const { return secondStart() + n_second_ * (n_first_ + 1); }
  Activity activity(const Eigen::Vector3d& x) const;
  Eigen::Vector3d outputOf(const Activity& activity) const;

  Eigen::Index n_first_ = 0;
  Eigen::Index n_second_ = 0;
  Weights weights_;
};

}  // namespace fieldtrue::correctors
