#pragma once

#include <memory>

#include "calib/core/json_reader.h"
#include "calib/correctors/base/orientation_model.h"
#include "calib/correctors/base/position_model.h"

/// What rebuilds each method's model from the parameters it stored, declared apart from the rows: a program that only
/// applies calibrations links these and none of the fits. They throw as a JsonReader does.
namespace fieldtrue::correctors {

template <class Model>
using ModelReader = std::unique_ptr<Model> (*)(const JsonReader& parameters);

std::unique_ptr<PositionModel> readAutomaticPosition(const JsonReader& parameters);
std::unique_ptr<PositionModel> readBsplinePosition(const JsonReader& parameters);
std::unique_ptr<PositionModel> readGaussianProcessPosition(const JsonReader& parameters);
std::unique_ptr<PositionModel> readHarmonicFieldPosition(const JsonReader& parameters);
std::unique_ptr<PositionModel> readHexahedralShapePosition(const JsonReader& parameters);
std::unique_ptr<PositionModel> readHmqPosition(const JsonReader& parameters);
std::unique_ptr<PositionModel> readImportedPosition(const JsonReader& parameters);
std::unique_ptr<PositionModel> readLocalPosition(const JsonReader& parameters);  ///< Of every local method.
std::unique_ptr<PositionModel> readNeuralNetworkPosition(const JsonReader& parameters);
std::unique_ptr<PositionModel> readNonePosition(const JsonReader& parameters);
std::unique_ptr<PositionModel> readPhysicsResidualPosition(const JsonReader& parameters);
std::unique_ptr<PositionModel> readPolynomialPosition(const JsonReader& parameters);  ///< And of the affine map.
std::unique_ptr<PositionModel> readRbfPosition(const JsonReader& parameters);
std::unique_ptr<PositionModel> readRigidPosition(const JsonReader& parameters);
std::unique_ptr<PositionModel> readTetrahedralPosition(const JsonReader& parameters);
std::unique_ptr<PositionModel> readTrilinearPosition(const JsonReader& parameters);

std::unique_ptr<OrientationModel> readGaussianProcessOrientation(const JsonReader& parameters);
std::unique_ptr<OrientationModel> readHmqMatrixOrientation(const JsonReader& parameters);
std::unique_ptr<OrientationModel> readImportedOrientation(const JsonReader& parameters);
std::unique_ptr<OrientationModel> readLocalQuaternionOrientation(const JsonReader& parameters);
std::unique_ptr<OrientationModel> readNoneOrientation(const JsonReader& parameters);
std::unique_ptr<OrientationModel> readPolynomialEulerOrientation(const JsonReader& parameters);
std::unique_ptr<OrientationModel> readPolynomialQuaternionOrientation(const JsonReader& parameters);
std::unique_ptr<OrientationModel> readRigidOrientation(const JsonReader& parameters);
std::unique_ptr<OrientationModel> readSlerpTrilinearOrientation(const JsonReader& parameters);
std::unique_ptr<OrientationModel> readTetrahedralQuaternionOrientation(const JsonReader& parameters);

}  // namespace fieldtrue::correctors
