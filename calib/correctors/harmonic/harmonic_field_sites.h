#pragma once

#include <Eigen/Core>
#include <vector>

namespace fieldtrue::correctors {

/// A box of true positions, transmitter frame [m].
struct Box {
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();

  double extent_m() const { return (high_m - low_m).maxCoeff(); }
  double distance_m(const Eigen::Vector3d& p_m) const;
};

/// A place where a source may stand.
struct Site {
  Eigen::Vector3d at_m = Eigen::Vector3d::Zero();
  double reach_m = 0.0;  ///< Half the way to its neighbours; 0: not to be refined.
};

/// Whether a source may stand there: not among the places nor close to the transmitter, but at it is allowed.
bool isAllowedSite(const Site& site, const Box& box);

/// Places on the surfaces of three boxes around the measured one, 0.16, 0.4 and 1 of its extent away, each with a pitch
/// of about one and a half such distances; and the transmitter itself, for what is wrong with its coils. A field that
/// is harmonic inside can be made by sources on any one such surface; three tell near metal from far.
std::vector<Site> candidateSites(const Box& box);

/// The six neighbours of a site, half its reach away: how a source finds its place between candidates.
std::vector<Site> refinedSites(const Site& site, const Box& box);

}  // namespace fieldtrue::correctors
