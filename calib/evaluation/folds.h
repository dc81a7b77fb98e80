#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "calib/evaluation/comparison.h"

namespace fieldtrue::evaluation {

/// One hold-out: the rows fitted to, and the rows scored. No place is in both, and none where another sensor stood at
/// the true position of one that is scored is fitted.
struct Fold {
  std::vector<std::size_t> fitted;
  std::vector<std::size_t> scored;
  std::vector<std::size_t> unused;  ///< Neither fitted nor scored, where all rows may be fitted.
};

/// The rows that a fold's fit does not see, ascending, where all others may be fitted.
std::vector<std::size_t> leftOut(const Fold& fold);

/// Splits rows by place.
/// @param nodes rows that count (skipped ones left out)
/// @error kBadInput when the table has no rows with the roles that `role` needs; kTooFewNodes when nothing can be held
/// out
Result<std::vector<Fold>> makeFolds(std::span<const Node> nodes, const Validation& validation, std::uint64_t seed);

/// Place numbers in order of first appearance.
std::vector<int> placesOf(std::span<const Node> nodes);

}  // namespace fieldtrue::evaluation
