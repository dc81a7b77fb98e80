#pragma once

#include <optional>

#include "tests/blind/generate_effects.h"

namespace blind::unforeseen {

using nlohmann::json;

/// Where the session stands in the tracker frame.
struct Scene {
  Vector3d middle_m = Vector3d::Zero();
  Vector3d up = Vector3d::UnitZ();     ///< third axis of the jig
  double lowest_m = 0, highest_m = 0;  ///< of places and transmitter along `up`
  double duration_s = 1;
  std::vector<SolvedPose> poses;
};
Scene sceneOf(const Setup& setup);

/// Where the places lie in the jig frame.
struct Span {
  Vector3d low_m = Vector3d::Constant(1e9);
  Vector3d high_m = Vector3d::Constant(-1e9);

  Vector3d middle_m() const { return 0.5 * (low_m + high_m); }
  Vector3d length_m() const { return high_m - low_m; }
  int longSide() const { return length_m().x() > length_m().y() ? 0 : 1; }
};
Span spanOf(const Setup& setup);

/// How far the places reach from their middle along a direction [m].
double extent_m(const Scene& scene, const Vector3d& toward);
/// A point outside of the hull of the places, and at least half a metre from the transmitter.
Vector3d beside(const Scene& scene, const Vector3d& toward, double clearance_m);
/// A unit vector normal to `up`.
Vector3d level(Random& random, const Vector3d& up);
/// The same point, or the nearest one that keeps a distance from the origin.
Vector3d keptAway(const Vector3d& p_m, double distance_m);
/// The value below which a share of the values lies.
double quantile(std::vector<double> values, double share);

double middleTime_s(const Row& row);
/// Number of given instants that have passed.
int passed(const std::vector<double>& instants_s, double time_s);
/// Instants that divide the session, each drawn within its part of it.
std::vector<double> instants(Random& random, const Scene& scene, int count);

/// Where the sensor was in the order of time.
struct Course {
  std::vector<double> start_s;
  std::vector<SolvedPose> poses;

  /// Index of the last recording that began before a row; at first the first.
  std::size_t before(const Row& row) const;
};
Course courseOf(const Setup& setup);

/// Field at p of metal at one point of given polarizability, per unit moment of each transmitter coil.
Matrix3d echo(const Vector3d& at_m, const Matrix3d& polarizability_m3, const Vector3d& p_m);
void addField(const SolvedPose& pose, const Matrix3d& field, Matrix3d& couplings);
void turnAbout(const Vector3d& pivot_m, const Vector3d& rotation_rad, Vector3d& p_m, Quaterniond& attitude);

/// What truth.json tells of one instance.
struct Story {
  std::string words, phrase, size_name;
  double smallest = 1, largest = 1;
  json parameters = json::object();
  std::optional<Vector3d> location_m = std::nullopt;
};
Drawn drawnOf(const Story& story, std::function<void(World&, double size)> apply);

Drawn drawDoor(const Setup& setup, Random& random);
Drawn drawTouchingCarts(const Setup& setup, Random& random);
Drawn drawCoiledCable(const Setup& setup, Random& random);
Drawn drawPedestals(const Setup& setup, Random& random);
Drawn drawCeilingGrid(const Setup& setup, Random& random);
Drawn drawBlind(const Setup& setup, Random& random);
Drawn drawStepStool(const Setup& setup, Random& random);
Drawn drawEddyTail(const Setup& setup, Random& random);

Drawn drawFoldedBoard(const Setup& setup, Random& random);
Drawn drawEccentricWheel(const Setup& setup, Random& random);
Drawn drawCreepingArm(const Setup& setup, Random& random);
Drawn drawTautCable(const Setup& setup, Random& random);
Drawn drawLooseHolder(const Setup& setup, Random& random);
Drawn drawFloatingFloor(const Setup& setup, Random& random);
Drawn drawParallax(const Setup& setup, Random& random);
Drawn drawSwayingTransmitter(const Setup& setup, Random& random);
Drawn drawBacklash(const Setup& setup, Random& random);
Drawn drawSecondPage(const Setup& setup, Random& random);
Drawn drawTwistingPost(const Setup& setup, Random& random);

Drawn drawRangeSwitch(const Setup& setup, Random& random);
Drawn drawDeadZone(const Setup& setup, Random& random);
Drawn drawCableLoop(const Setup& setup, Random& random);
Drawn drawUnsettledFilter(const Setup& setup, Random& random);
Drawn drawMultiplexer(const Setup& setup, Random& random);
Drawn drawSaggingSupply(const Setup& setup, Random& random);
Drawn drawCoarseTable(const Setup& setup, Random& random);
Drawn drawClippedCoordinate(const Setup& setup, Random& random);
Drawn drawBiasedCore(const Setup& setup, Random& random);
Drawn drawPhaseSlip(const Setup& setup, Random& random);
Drawn drawFusedCompass(const Setup& setup, Random& random);
Drawn drawHandover(const Setup& setup, Random& random);

// The second batch.
Drawn drawWristwatch(const Setup& setup, Random& random);
Drawn drawRisingFrame(const Setup& setup, Random& random);
Drawn drawTrackerNextDoor(const Setup& setup, Random& random);
Drawn drawLeakToPipe(const Setup& setup, Random& random);
Drawn drawWheelchair(const Setup& setup, Random& random);
Drawn drawTunedGate(const Setup& setup, Random& random);
Drawn drawLongBeam(const Setup& setup, Random& random);
Drawn drawAirJet(const Setup& setup, Random& random);
Drawn drawDraggedLamp(const Setup& setup, Random& random);

Drawn drawCuppedBoard(const Setup& setup, Random& random);
Drawn drawScrews(const Setup& setup, Random& random);
Drawn drawChainedHoles(const Setup& setup, Random& random);
Drawn drawBentHook(const Setup& setup, Random& random);
Drawn drawSquaredByEye(const Setup& setup, Random& random);
Drawn drawShortCountdown(const Setup& setup, Random& random);
Drawn drawWedgedSpacers(const Setup& setup, Random& random);
Drawn drawCheckerboard(const Setup& setup, Random& random);
Drawn drawWoundCable(const Setup& setup, Random& random);
Drawn drawPuckeredTemplate(const Setup& setup, Random& random);

Drawn drawForeignMap(const Setup& setup, Random& random);
Drawn drawHeldOutput(const Setup& setup, Random& random);
Drawn drawBrokenStrand(const Setup& setup, Random& random);
Drawn drawCutBits(const Setup& setup, Random& random);
Drawn drawSlowRelease(const Setup& setup, Random& random);
Drawn drawHemisphereGuard(const Setup& setup, Random& random);
Drawn drawSlippedCoil(const Setup& setup, Random& random);

// The third batch.
Drawn drawSweepingDrive(const Setup& setup, Random& random);
Drawn drawLift(const Setup& setup, Random& random);
Drawn drawStimulator(const Setup& setup, Random& random);
Drawn drawCompressor(const Setup& setup, Random& random);
Drawn drawCounterweight(const Setup& setup, Random& random);
Drawn drawCarbonPosts(const Setup& setup, Random& random);
Drawn drawCleaningRobot(const Setup& setup, Random& random);
Drawn drawCableReel(const Setup& setup, Random& random);

Drawn drawWarmGlue(const Setup& setup, Random& random);
Drawn drawDentedCork(const Setup& setup, Random& random);
Drawn drawLostTurns(const Setup& setup, Random& random);
Drawn drawResin(const Setup& setup, Random& random);
Drawn drawSlopingSight(const Setup& setup, Random& random);
Drawn drawTiredArm(const Setup& setup, Random& random);
Drawn drawCastors(const Setup& setup, Random& random);
Drawn drawTurnedBlock(const Setup& setup, Random& random);

Drawn drawScreenCurrent(const Setup& setup, Random& random);
Drawn drawLastRange(const Setup& setup, Random& random);
Drawn drawWrongBit(const Setup& setup, Random& random);
Drawn drawCarrierHops(const Setup& setup, Random& random);
Drawn drawSlackCable(const Setup& setup, Random& random);
Drawn drawShortPi(const Setup& setup, Random& random);
Drawn drawUnlikeHalves(const Setup& setup, Random& random);
Drawn drawShortedTurn(const Setup& setup, Random& random);
Drawn drawSlippingWindow(const Setup& setup, Random& random);

}  // namespace blind::unforeseen
