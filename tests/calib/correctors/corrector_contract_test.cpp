#include <QTest>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "calib/core/pose.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

const Pose kMotion{{0.02, -0.03, 0.01}, rotationFromVector({0.02, -0.05, 0.03})};

Eigen::Vector3d cubic_m(const Eigen::Vector3d& p) {
  return {0.02 - 0.05 * p.x() * p.y() + 0.03 * p.z() * p.z() * p.z(), 0.04 * p.x() * p.x() * p.z() - 0.01 * p.y(),
          0.06 * p.x() * p.y() * p.z() + 0.02 * p.y() * p.y()};
}

Eigen::Vector3d affine_m(const Eigen::Vector3d& p) {
  return {0.01 + 0.03 * p.x() - 0.02 * p.z(), -0.02 + 0.01 * p.x() + 0.05 * p.y(), 0.04 * p.z() - 0.03 * p.y()};
}

Eigen::Vector3d rigid_m(const Eigen::Vector3d& p) { return kMotion * p - p; }

Eigen::Quaterniond constantError(const Eigen::Vector3d&) { return rotationFromVector({0.3, -0.2, 0.1}); }

Eigen::Quaterniond quadraticVectorPart(const Eigen::Vector3d& p) {
  const Eigen::Vector3d v(0.05 + 0.1 * p.x() * p.y(), -0.08 * p.z(), 0.06 * p.x() * p.x() - 0.03 * p.y());
  return {std::sqrt(1.0 - v.squaredNorm()), v.x(), v.y(), v.z()};
}

Eigen::Quaterniond quadraticEulerAngles(const Eigen::Vector3d& p) {
  return rotationFromEuler({0.1 - 0.2 * p.x() * p.y(), 0.1 * p.z() * p.z(), 0.15 * p.y() - 0.05 * p.x()});
}

Eigen::Quaterniond turningError(const Eigen::Vector3d& p) {
  return rotationFromVector(0.2 *
                            Eigen::Vector3d(std::sin(2.0 * p.x()), std::cos(1.5 * p.y()), std::sin(p.z() + p.x())));
}

Eigen::Quaterniond noError(const Eigen::Vector3d&) { return Eigen::Quaterniond::Identity(); }

/// What each method must recover: exactly everywhere, or (an interpolator) exactly at its own places.
struct Recovery {
  Displacement displacement_m;
  bool everywhere = true;
  double tolerance_m = 1e-9;  ///< Wider for what approximates and is chosen by what it foretells: a network.
};
const std::map<std::string, Recovery> kPositionRecoveries = {
    {"none", {nothing_m}},
    {"neural_network", {rigid_m, false, 2e-3}},
    {"rigid", {rigid_m}},
    {"affine", {affine_m}},
    {"polynomial", {cubic_m}},
    {"hmq", {cubic_m, false}},
    {"trilinear", {cubic_m, false}},
    {"hexahedral_shape", {cubic_m, false}},
    {"tetrahedral", {cubic_m, false}},
    {"local_linear", {cubic_m, false}},
    {"local_bump", {cubic_m, false}},
    {"local_kindratenko", {cubic_m, false}},
    {"local_briggs", {cubic_m, false}},
    {"rbf", {affine_m}},
    {"gaussian_process", {affine_m}},
    {"bspline", {affine_m}},
    {"harmonic_field", {rigid_m}},
    {"physics_residual", {rigid_m}},
    {"auto", {cubic_m}},
};

struct RotationRecovery {
  Rotation q_error;
  bool everywhere = true;
  double tolerance_rad = 1e-7;
};
const std::map<std::string, RotationRecovery> kOrientationRecoveries = {
    {"none", {noError}},
    {"rigid", {constantError}},
    {"polynomial_euler", {quadraticEulerAngles}},
    {"polynomial_quaternion", {quadraticVectorPart}},
    {"hmq_matrix", {turningError, false}},
    {"slerp_trilinear", {turningError, false}},
    {"tetrahedral_quaternion", {turningError, false}},
    {"local_quaternion", {turningError, false}},
    {"gaussian_process", {turningError, false, 1e-4}},
};

/// Methods that ask for a rectilinear grid in tracked space.
const std::set<std::string> kNeedTrackedGrid = {"trilinear", "local_briggs"};

std::vector<Eigen::Vector3d> usualPlaces(const std::string& id = {}) {
  return shakenGrid({5, 5, 4}, 0.2, kNeedTrackedGrid.contains(id) ? 0.0 : 0.02);
}

FitData usualData(const std::string& id = {}) { return fitDataOf(usualPlaces(id), cubic_m, turningError); }

/// Bad data by name, and the codes a method may answer with. No code at all: it must fit and stay finite.
struct BadCase {
  FitData data;
  std::vector<ErrorCode> allowed;
  bool may_fit = false;
};

FitData flattened(int dimension) {
  std::vector<Eigen::Vector3d> places = usualPlaces();
  const Eigen::Vector3d u = Eigen::Vector3d(1.0, 0.2, 0.1).normalized();
  const Eigen::Vector3d v = u.cross(Eigen::Vector3d::UnitZ()).normalized();
  for (Eigen::Vector3d& p : places)
    p = Eigen::Vector3d(u * u.dot(p) +
                        (dimension == 2 ? Eigen::Vector3d(v * v.dot(p)) : Eigen::Vector3d(Eigen::Vector3d::Zero())));
  FitData data = fitDataOf(places, affine_m, turningError);
  data.dimension = dimension;
  return data;
}

FitData repeated() {
  FitData data = fitDataOf(std::vector<Eigen::Vector3d>(40, Eigen::Vector3d(0.5, 0.1, 0.2)), cubic_m, turningError);
  for (std::size_t i = 0; i < data.size(); ++i)
    data.p_true_m[i] += 0.1 * Eigen::Vector3d(std::sin(double(i)), std::cos(double(i)), double(i % 3));
  return data;
}

FitData withNan(double bad) {
  FitData data = usualData();
  data.p_tracked_m[7].y() = bad;
  data.q_tracked[7].x() = bad;
  return data;
}

std::map<std::string, BadCase> badCases() {
  const std::vector<ErrorCode> degenerate = {ErrorCode::kTooFewNodes, ErrorCode::kDegenerate};
  return {
      {"empty", {FitData{}, {ErrorCode::kTooFewNodes}}},
      {"on one line", {flattened(1), degenerate, true}},
      {"in one plane", {flattened(2), degenerate, true}},
      {"all at one tracked position", {repeated(), degenerate, true}},
      {"not a number", {withNan(std::numeric_limits<double>::quiet_NaN()), {ErrorCode::kBadInput}}},
      {"infinite", {withNan(std::numeric_limits<double>::infinity()), {ErrorCode::kBadInput}}},
  };
}

bool isOneSentence(const std::string& message) {
  return message.size() > 20 && message.find('\n') == std::string::npos && message.back() != '.';
}

}  // namespace

/// The contract of every row of both registries.
class CorrectorContractTest : public QObject {
  Q_OBJECT
 private:
  void addPositionRows() {
    QTest::addColumn<QString>("id");
    for (const PositionMethod& method : positionMethods())
      QTest::newRow(method.id.c_str()) << QString::fromStdString(method.id);
  }
  void addOrientationRows() {
    QTest::addColumn<QString>("id");
    for (const OrientationMethod& method : orientationMethods())
      QTest::newRow(method.id.c_str()) << QString::fromStdString(method.id);
  }

 private slots:
  void rowsAreComplete() {
    std::set<std::string> ids;
    for (const PositionMethod& method : positionMethods()) {
      QVERIFY(!method.label.empty() && !method.source.empty() && method.fit && method.read);
      QVERIFY2(ids.insert(method.id).second, method.id.c_str());
      QVERIFY2(kPositionRecoveries.contains(method.id), "say in this test what the method must recover");
      FT_VERIFY_OK(resolveSettings(method.id, method.settings, {}));
    }
    ids.clear();
    for (const OrientationMethod& method : orientationMethods()) {
      QVERIFY(!method.label.empty() && !method.source.empty() && method.fit && method.read);
      QVERIFY2(ids.insert(method.id).second, method.id.c_str());
      QVERIFY2(kOrientationRecoveries.contains(method.id), "say in this test what the method must recover");
      FT_VERIFY_OK(resolveSettings(method.id, method.settings, {}));
    }
  }

  void unknownIdsNameTheKnownOnes() {
    const auto position = findPositionMethod("splines");
    QVERIFY(!position && position.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(position.error().message, {"splines", "polynomial", "hmq", "affine"}));
    const auto orientation = findOrientationMethod("euler");
    QVERIFY(!orientation && orientation.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(orientation.error().message, {"euler", "polynomial_quaternion", "hmq_matrix"}));
  }

  void positionRecovers_data() { addPositionRows(); }
  void positionRecovers() {
    QFETCH(QString, id);
    const Recovery& recovery = kPositionRecoveries.at(id.toStdString());
    const FitData data = fitDataOf(usualPlaces(id.toStdString()), recovery.displacement_m);
    const auto model = fitPosition(id.toStdString(), data);
    FT_VERIFY_OK(model);
    for (const Eigen::Vector3d& p_m : recovery.everywhere ? randomPoints(200) : data.p_tracked_m)
      FT_VERIFY_MATCH(near((*model)->displacement_m(p_m), recovery.displacement_m(p_m), recovery.tolerance_m));
  }

  void orientationRecovers_data() { addOrientationRows(); }
  void orientationRecovers() {
    QFETCH(QString, id);
    const RotationRecovery& recovery = kOrientationRecoveries.at(id.toStdString());
    const FitData data = fitDataOf(usualPlaces(), nothing_m, recovery.q_error, rotationFromVector({0.4, 1.1, -0.7}));
    const auto model = fitOrientation(id.toStdString(), data);
    FT_VERIFY_OK(model);
    // Fitted at one true orientation, tried at others.
    for (const Eigen::Vector3d& turn :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1.2, -0.4, 2.0), Eigen::Vector3d(-2.5, 0.3, 0.6)}) {
      const Eigen::Quaterniond q_true = rotationFromVector(turn);
      for (const Eigen::Vector3d& p_m : recovery.everywhere ? usualPlaces() : data.p_tracked_m)
        FT_VERIFY_MATCH(near((*model)->correct(p_m, recovery.q_error(p_m) * q_true), q_true, recovery.tolerance_rad));
    }
  }

  void positionIsTheSameTwiceAndAfterReloading_data() { addPositionRows(); }
  void positionIsTheSameTwiceAndAfterReloading() {
    QFETCH(QString, id);
    const auto first = fitPosition(id.toStdString(), usualData(id.toStdString()));
    const auto second = fitPosition(id.toStdString(), usualData(id.toStdString()));
    FT_VERIFY_OK(first);
    FT_VERIFY_OK(second);
    QVERIFY((*first)->parameters() == (*second)->parameters());
    const nlohmann::json stored = nlohmann::json::parse((*first)->parameters().dump());
    const auto reloaded = findPositionMethod(id.toStdString()).value()->load(stored);
    FT_VERIFY_OK(reloaded);
    QVERIFY((*reloaded)->parameters() == (*first)->parameters());
    QVERIFY((*reloaded)->note() == (*first)->note());
    for (const Eigen::Vector3d& p_m : randomPoints(3000)) {
      const Eigen::Vector3d expected_m = (*first)->displacement_m(p_m);
      const Eigen::Vector3d seen_m = (*reloaded)->displacement_m(p_m);
      for (int axis = 0; axis < 3; ++axis) FT_VERIFY_MATCH(sameBits(seen_m[axis], expected_m[axis]));
      QVERIFY((*reloaded)->uncertainty_m(p_m) == (*first)->uncertainty_m(p_m));
    }
  }

  void orientationIsTheSameTwiceAndAfterReloading_data() { addOrientationRows(); }
  void orientationIsTheSameTwiceAndAfterReloading() {
    QFETCH(QString, id);
    const auto first = fitOrientation(id.toStdString(), usualData());
    const auto second = fitOrientation(id.toStdString(), usualData());
    FT_VERIFY_OK(first);
    FT_VERIFY_OK(second);
    QVERIFY((*first)->parameters() == (*second)->parameters());
    const nlohmann::json stored = nlohmann::json::parse((*first)->parameters().dump());
    const auto reloaded = findOrientationMethod(id.toStdString()).value()->load(stored);
    FT_VERIFY_OK(reloaded);
    const Eigen::Quaterniond q_tracked = rotationFromVector({0.7, -0.2, 1.9});
    for (const Eigen::Vector3d& p_m : randomPoints(3000)) {
      const Pose expected{p_m, (*first)->correct(p_m, q_tracked)};
      FT_VERIFY_MATCH(sameBits(Pose{p_m, (*reloaded)->correct(p_m, q_tracked)}, expected));
    }
  }

  void batchAndJacobianAgreeWithTheDisplacement_data() { addPositionRows(); }
  void batchAndJacobianAgreeWithTheDisplacement() {
    QFETCH(QString, id);
    const auto model = fitPosition(id.toStdString(), usualData(id.toStdString()));
    FT_VERIFY_OK(model);
    const std::vector<Eigen::Vector3d> points_m = randomPoints(1000);
    std::vector<Eigen::Vector3d> apart_m(points_m.size());
    std::vector<Eigen::Vector3d> in_place_m = points_m;
    (*model)->correct(points_m, apart_m);
    (*model)->correct(in_place_m, in_place_m);
    for (std::size_t i = 0; i < points_m.size(); ++i) {
      const Eigen::Vector3d single_m = points_m[i] + (*model)->displacement_m(points_m[i]);
      for (int axis = 0; axis < 3; ++axis) {
        FT_VERIFY_MATCH(sameBits(apart_m[i][axis], single_m[axis]));
        FT_VERIFY_MATCH(sameBits(in_place_m[i][axis], single_m[axis]));
      }
      if (i % 50 != 0) continue;
      const Eigen::Matrix3d by_differences = (*model)->PositionModel::jacobian(points_m[i]);
      FT_VERIFY_MATCH(near(((*model)->jacobian(points_m[i]) - by_differences).cwiseAbs().maxCoeff(), 0.0, 1e-5));
    }
  }

  void resultsAreFinite_data() { addPositionRows(); }
  void resultsAreFinite() {
    QFETCH(QString, id);
    const auto model = fitPosition(id.toStdString(), usualData(id.toStdString()));
    FT_VERIFY_OK(model);
    for (const double far_m : {0.0, 1.0, 1e3, 1e6}) {
      QVERIFY((*model)->displacement_m({far_m, -far_m, 0.5 * far_m}).allFinite());
      QVERIFY((*model)->jacobian({far_m, -far_m, 0.5 * far_m}).allFinite());
    }
  }

  void orientationsAreUnit_data() { addOrientationRows(); }
  void orientationsAreUnit() {
    QFETCH(QString, id);
    const auto model = fitOrientation(id.toStdString(), usualData());
    FT_VERIFY_OK(model);
    for (const double far_m : {0.0, 1.0, 1e3, 1e6})
      FT_VERIFY_MATCH(
          near((*model)->correct({far_m, -far_m, 0.5 * far_m}, turningError({0, 0, 0})).norm(), 1.0, 1e-12));
  }

  void badPositionsGiveOneSentence_data() {
    QTest::addColumn<QString>("id");
    QTest::addColumn<QString>("data");
    for (const PositionMethod& method : positionMethods())
      for (const auto& [name, bad] : badCases())
        QTest::addRow("%s, %s", method.id.c_str(), name.c_str())
            << QString::fromStdString(method.id) << QString::fromStdString(name);
  }
  void badPositionsGiveOneSentence() {
    QFETCH(QString, id);
    QFETCH(QString, data);
    const BadCase bad = badCases().at(data.toStdString());
    const auto model = fitPosition(id.toStdString(), bad.data);
    const bool needs_spread = id != "none";
    if (model) {
      const bool may_fit = bad.may_fit && (!needs_spread || data == "in one plane");
      QVERIFY2(may_fit, "fitted to data that does not determine it");
      for (const Eigen::Vector3d& p_m : bad.data.p_tracked_m) QVERIFY((*model)->displacement_m(p_m).allFinite());
      if (needs_spread) FT_VERIFY_MATCH(holdsAll((*model)->note(), {"plane"}));
    } else {
      QVERIFY(std::count(bad.allowed.begin(), bad.allowed.end(), model.error().code) == 1);
      QVERIFY2(isOneSentence(model.error().message), model.error().message.c_str());
    }
  }

  void badOrientationsGiveOneSentence_data() {
    QTest::addColumn<QString>("id");
    for (const OrientationMethod& method : orientationMethods())
      if (method.id != "none") QTest::newRow(method.id.c_str()) << QString::fromStdString(method.id);
  }
  void badOrientationsGiveOneSentence() {
    QFETCH(QString, id);
    const std::map<std::string, BadCase> bad_cases = badCases();
    for (const std::string name : {"empty", "not a number", "infinite"}) {
      const auto model = fitOrientation(id.toStdString(), bad_cases.at(name).data);
      QVERIFY(!model);
      QCOMPARE(model.error().code, bad_cases.at(name).allowed.front());
      QVERIFY2(isOneSentence(model.error().message), model.error().message.c_str());
    }
    const auto without = fitOrientation(id.toStdString(), fitDataOf(usualPlaces(), cubic_m));
    QVERIFY(!without);
    QCOMPARE(without.error().code, ErrorCode::kUnsupported);
    FT_VERIFY_MATCH(holdsAll(without.error().message, {"orientation"}));
  }

  void damagedParametersAreRefused() {
    for (const PositionMethod& method : positionMethods()) {
      if (method.id == "none") continue;
      const nlohmann::json whole = fitPosition(method.id, usualData(method.id)).value()->parameters();
      for (const auto& [key, value] : whole.items()) {
        nlohmann::json damaged = whole;
        damaged.erase(key);
        QVERIFY2(!method.load(damaged), (method.id + " without " + key).c_str());
        damaged[key] = "text where numbers belong";
        if (!value.is_string()) QVERIFY2(!method.load(damaged), (method.id + ", wrong " + key).c_str());
      }
    }
    for (const OrientationMethod& method : orientationMethods()) {
      if (method.id == "none") continue;
      const nlohmann::json whole = fitOrientation(method.id, usualData()).value()->parameters();
      for (const auto& [key, value] : whole.items()) {
        nlohmann::json damaged = whole;
        damaged.erase(key);
        QVERIFY2(!method.load(damaged), (method.id + " without " + key).c_str());
      }
    }
  }
};

FIELDTRUE_TEST(CorrectorContractTest)
#include "corrector_contract_test.moc"
