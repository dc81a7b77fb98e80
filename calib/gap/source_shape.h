#pragma once

#include <optional>

#include "calib/gap/report.h"
#include "calib/identify/selection.h"

namespace fieldtrue::gap {

/// How the thing in the room that bends the readings most answers the transmitter's field along each of its axes: one
/// dipole of a general symmetric polarizability, fitted beside nothing else. A ball answers alike along all three; a
/// flat sheet that conducts, and a loop, along the normal alone; a bar of iron along its length. It decides nothing.
/// @return nothing where no thing in the room stands out, a plane is named or explains as much, or one dipole takes
/// less than Thresholds::least_share of what the named causes take
/// @source principal polarizabilities of a buried body: Bell, Barrow, Miller 2001, IEEE Trans. Geosci. Remote Sens. 39
/// 1286; of thin sheets and loops: Baum 1999, Detection and Identification of Visually Obscured Targets, chapter 6
std::optional<SourceShape> sourceShapeOf(const identify::GapSearch& search, const identify::EffectSelection& selection);

/// The shape that three principal polarizabilities with these SDs allow.
/// @param values_m3 largest size first
/// @param silent_axis share of the strongest below which an axis does not answer
Shape shapeOf(const Eigen::Vector3d& values_m3, const Eigen::Vector3d& sds_m3, double silent_axis);

/// A sentence for a reader: "What bends the readings near (0.5, 0.2, 1) m answers ...".
std::string sourceShapeText(const SourceShape& shape);

}  // namespace fieldtrue::gap
