#pragma once

#include <Eigen/Core>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "calib/calibration/alignment.h"

namespace fieldtrue::calibration {

/// Rows of sensors that ride on one jig, each with the true position of its own.
struct PlacedSensors {
  std::vector<Node> nodes;
  std::map<int, Eigen::Vector3d> offsets_m;  ///< Of each sensor from the first, in the jig's turned frame; else empty.

  /// A sentence with the distances; "" where nothing was found.
  std::string note() const;
};

/// Sensors recorded in one take have one true pose, the jig's, though no two can stand at one point: how far each
/// stands from the first is found beside the alignment by least squares, from all rows at once, and added to its true
/// positions. Rows of sensors whose true positions differ are left as they are: there the rig says where each stands.
/// What the tracker errs by in the mean at one sensor cannot be told from where that sensor sits.
/// Where no alignment can be found nothing is placed, and the fit itself tells why.
PlacedSensors placedSensors(std::span<const Node> nodes, AlignMode align);

}  // namespace fieldtrue::calibration
