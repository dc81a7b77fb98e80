#pragma once

#include <Eigen/Core>
#include <vector>

namespace fieldtrue::correctors {

/// The sources that the steps of a fit chose, in the order of the steps, and what each choice left.
class HarmonicChoices {
 public:
  /// @param places_m where the sources stand, in any order
  /// @param misfit_m2 mean square that they leave, per axis
  void add(std::vector<Eigen::Vector3d> places_m, double misfit_m2);

  /// Whether going on brings nothing better than the last choice: the choices go round, or wander.
  bool isLastFinal() const { return goesRound() || wanders(); }

 private:
  bool goesRound() const;
  bool wanders() const;

  struct Choice {
    std::vector<Eigen::Vector3d> places_m;  ///< In an order of their own.
    double misfit_m2 = 0.0;
  };
  std::vector<Choice> choices_;
};

}  // namespace fieldtrue::correctors
