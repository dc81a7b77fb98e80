#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "tests/blind/session.h"

namespace blind {

/// How the shape of an effect departs from what was drawn: a number for each of Drawn::scales, or none at all.
using ShapeChange = std::span<const double>;

inline double changeAt(ShapeChange change, std::size_t at) { return change.empty() ? 0.0 : change[at]; }
inline Vector3d vectorAt(ShapeChange change, std::size_t first) {
  return {changeAt(change, first), changeAt(change, first + 1), changeAt(change, first + 2)};
}

/// An effect drawn for one session whose size is still open.
struct Drawn {
  std::string id;
  std::string kind;
  double smallest = 0.1, largest = 1;  ///< believable range of `size`
  std::function<void(World&, double size, ShapeChange)> apply;
  std::function<void(double size, nlohmann::json& effect)> describe;
  std::vector<double> scales = {};  ///< a telling difference of each number of its shape, in the number's own unit
};

/// A drawn effect at the size that the session wished for.
struct Placed {
  Drawn drawn;
  double size = 1;
  double rho = 0;
};

/// A course in time of about unit size: warming up along an exponential, a random walk on top. Its change is a straight
/// line between six moments spread over the session.
std::function<double(double time_s, ShapeChange)> wanderingCourse(const Setup& setup, Random& random);
inline constexpr int kMomentsOfCourse = 6;

/// A vector as truth.json has it.
inline nlohmann::json listed(const Vector3d& v) { return nlohmann::json::array({v.x(), v.y(), v.z()}); }

/// A kind of effect and how one of it is drawn. The registry of this program.
struct Kind {
  std::string id;
  double weight = 1;
  Drawn (*draw)(const Setup&, Random&);
  /// What the design must have for the effect to be drawn.
  enum class Needs { kNothing, kRigAxes, kLayers } needs = Needs::kNothing;

  /// A table stated in the transmitter's axes has lost those of the rig; scattered places have no layers.
  bool fits(const Setup& setup) const {
    return needs == Needs::kNothing || (!setup.alignment_known && !(needs == Needs::kLayers && setup.scattered));
  }
};

/// Effects of the catalogue that change the mean pose.
const std::vector<Kind>& catalogueKinds();

/// Effects that need the alignment to be known.
const std::vector<Kind>& alignedKinds();

/// Effects that stand in no catalogue.
const std::vector<Kind>& foreignKinds();

/// What goes wrong in a laboratory, as somebody thought of who knew neither the catalogue nor the diagnosis: a batch
/// for each time that the diagnosis was frozen, the oldest first. What one set has shown is foreseen in the next.
std::span<const std::vector<Kind>> unforeseenBatches();

/// Effects that only raw samples show.
const std::vector<std::string>& signalIds();

// Drawing rules of metal and wire, in generate_metal.cpp.
Drawn drawCompactMetal(const Setup& setup, Random& random);
Drawn drawMetalPlane(const Setup& setup, Random& random);
Drawn drawFinitePlate(const Setup& setup, Random& random);
Drawn drawClosedLoop(const Setup& setup, Random& random);
Drawn drawMetalMoved(const Setup& setup, Random& random);
Drawn drawOpposedBodies(const Setup& setup, Random& random);
Drawn drawFerriteAtTransmitter(const Setup& setup, Random& random);

}  // namespace blind
