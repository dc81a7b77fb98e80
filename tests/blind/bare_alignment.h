#pragma once

#include "tests/blind/pose_solver.h"
#include "tests/blind/session_table.h"

namespace blind {

/// Rotation and position of one frame in another: p -> orientation * p + position.
SolvedPose composed(const SolvedPose& a, const SolvedPose& b);
SolvedPose inverse(const SolvedPose& pose);

/// Where the rig stands in the tracker's frame and the sensor on its mount, as a recording without any effect would
/// have them: the start that every shrinkage is counted from.
struct BareAlignment {
  SolvedPose tracker_from_jig;
  SolvedPose mount_from_sensor;

  SolvedPose reported(const SolvedPose& jig_from_mount) const;
};

/// Weighted least squares over all rows of a node table, positions and, where there are any, orientations; the identity
/// where the table says that the alignment is known, for then it is what the simulation believes.
/// @error std::runtime_error when the table lacks a column or has fewer than three rows
BareAlignment bareAlignment(const SessionTable& nodes);

/// The pose in the columns x_true_m.., or x_m.., of one row; without orientation columns it is not turned.
SolvedPose truePose(const SessionTable& table, const std::vector<std::string>& row);
SolvedPose trackedPose(const SessionTable& table, const std::vector<std::string>& row);

/// Of the turn that takes b to a [rad], in the frame both are in.
Vector3d rotationBetween(const Quaterniond& a, const Quaterniond& b);

}  // namespace blind
