#include "calib/correctors/readers.h"

#include <span>
#include <string>
#include <utility>

namespace fieldtrue::correctors {
namespace {

template <class Model>
using ReaderRow = std::pair<std::string_view, ModelReader<Model>>;

constexpr ReaderRow<PositionModel> kPositionReaders[] = {{"none", readNonePosition},
                                                         {"rigid", readRigidPosition},
                                                         {"affine", readPolynomialPosition},
                                                         {"trilinear", readTrilinearPosition},
                                                         {"hexahedral_shape", readHexahedralShapePosition},
                                                         {"tetrahedral", readTetrahedralPosition},
                                                         {"local_linear", readLocalPosition},
                                                         {"local_bump", readLocalPosition},
                                                         {"local_kindratenko", readLocalPosition},
                                                         {"local_briggs", readLocalPosition},
                                                         {"polynomial", readPolynomialPosition},
                                                         {"hmq", readHmqPosition},
                                                         {"neural_network", readNeuralNetworkPosition},
                                                         {"rbf", readRbfPosition},
                                                         {"gaussian_process", readGaussianProcessPosition},
                                                         {"bspline", readBsplinePosition},
                                                         {"harmonic_field", readHarmonicFieldPosition},
                                                         {"physics_residual", readPhysicsResidualPosition},
                                                         {"auto", readAutomaticPosition},
                                                         {"imported", readImportedPosition}};

constexpr ReaderRow<OrientationModel> kOrientationReaders[] = {
    {"none", readNoneOrientation},
    {"rigid", readRigidOrientation},
    {"slerp_trilinear", readSlerpTrilinearOrientation},
    {"tetrahedral_quaternion", readTetrahedralQuaternionOrientation},
    {"local_quaternion", readLocalQuaternionOrientation},
    {"polynomial_euler", readPolynomialEulerOrientation},
    {"polynomial_quaternion", readPolynomialQuaternionOrientation},
    {"hmq_matrix", readHmqMatrixOrientation},
    {"gaussian_process", readGaussianProcessOrientation},
    {"imported", readImportedOrientation}};

template <class Model>
Result<ModelReader<Model>> findReader(std::span<const ReaderRow<Model>> rows, const std::string& kind,
                                      std::string_view id) {
  std::string known;
  for (const auto& [known_id, reader] : rows) {
    if (known_id == id) return reader;
    if (!known.empty()) known += ", ";
    known += known_id;
  }
  return fail(ErrorCode::kBadInput, "No " + kind + " method is called '" + std::string(id) + "'; there are: " + known);
}

}  // namespace

Result<ModelReader<PositionModel>> findPositionReader(std::string_view id) {
  return findReader<PositionModel>(kPositionReaders, "position", id);
}

Result<ModelReader<OrientationModel>> findOrientationReader(std::string_view id) {
  return findReader<OrientationModel>(kOrientationReaders, "orientation", id);
}

}  // namespace fieldtrue::correctors
