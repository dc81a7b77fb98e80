#pragma once

#include "calib/correctors/base/method.h"

/// The row of every correction method, declared; each is defined in the file of its method, and registry.cpp orders
/// them.
namespace fieldtrue::correctors {

PositionMethod automaticPosition();
PositionMethod affinePosition();
PositionMethod nonePosition();
PositionMethod rigidPosition();
PositionMethod hexahedralShapePosition();
PositionMethod hmqPosition();
PositionMethod localBriggsPosition();
PositionMethod localBumpPosition();
PositionMethod localKindratenkoPosition();
PositionMethod localLinearPosition();
PositionMethod tetrahedralPosition();
PositionMethod trilinearPosition();
PositionMethod gaussianProcessPosition();
PositionMethod harmonicFieldPosition();
PositionMethod neuralNetworkPosition();
PositionMethod physicsResidualPosition();
PositionMethod polynomialPosition();
PositionMethod rbfPosition();
PositionMethod bsplinePosition();
PositionMethod importedPosition();

OrientationMethod noneOrientation();
OrientationMethod rigidOrientation();
OrientationMethod localQuaternionOrientation();
OrientationMethod slerpTrilinearOrientation();
OrientationMethod tetrahedralQuaternionOrientation();
OrientationMethod hmqMatrixOrientation();
OrientationMethod gaussianProcessOrientation();
OrientationMethod polynomialEulerOrientation();
OrientationMethod polynomialQuaternionOrientation();
OrientationMethod importedOrientation();

}  // namespace fieldtrue::correctors
