#include "calib/correctors/baked/turning_lattices.h"

#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/core/json_reader.h"
#include "calib/correctors/baked/baked_position.h"
#include "tests/calib/correctors/cell_fixtures.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

/// Corrections that take orientation, put on lattices: held against what they were made of, at poses drawn here.
using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

constexpr double kBound_m = 50e-6;

/// Places of a shaken grid, each in some orientations or, with none, in one of its own; a field that does not turn with
/// the sensor, one that does, and 0.1 mm of noise.
FitData turnedData(int orientations) {
  RandomGeometry random(5);
  std::vector<Eigen::Quaterniond> turns;
  for (int i = 0; i < std::max(1, orientations); ++i) turns.push_back(random.rotation());
  FitData data;
  int node = 0;
  for (const Eigen::Vector3d& p_m : shakenGrid({4, 4, 3}, 0.2, 0.03)) {
    for (const Eigen::Quaterniond& turn : turns) {
      const Eigen::Quaterniond q = orientations > 0 ? turn : random.rotation();
      const Eigen::Vector3d field(std::sin(5.0 * p_m.x()), std::cos(4.0 * p_m.y()), std::sin(3.0 * p_m.z()));
      const Eigen::Vector3d in_sensor(1.0, 0.5 * std::sin(3.0 * p_m.x()), 0.0);
      data.p_tracked_m.push_back(p_m);
      data.p_true_m.push_back(p_m + 0.003 * field + 0.005 * (q * in_sensor) +
                              1e-4 * Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
      data.q_tracked.push_back(q);
      data.q_true.push_back(q);
      data.node.push_back(node);
    }
    ++node;
  }
  return data;
}

struct Case {
  FitData data;
  std::unique_ptr<PositionModel> exact;
  Region region;
};

Case fittedCase(int orientations, const Given& settings) {
  Case made{turnedData(orientations), {}, {}};
  made.exact = testing::fitted("gaussian_process", made.data, settings);
  made.region = Region::around(made.data.p_tracked_m, 3, 0.02);
  return made;
}

std::vector<Pose> posesOf(const Case& made, std::size_t n) {
  RandomGeometry random(77);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p_m : made.data.p_tracked_m) box.extend(p_m);
  std::vector<Pose> poses;
  while (poses.size() < n) {
    const Pose pose{box.sample(), random.rotation()};
    if (made.region.contains(pose.position_m)) poses.push_back(pose);
  }
  return poses;
}

}  // namespace

class TurningLatticesTest : public QObject {
  Q_OBJECT
 private slots:
  void staysWithinTheBound_data() {
    QTest::addColumn<int>("orientations");
    QTest::addColumn<QString>("coils");
    QTest::newRow("three, process over poses") << 3 << "none";
    QTest::newRow("each place at random, process over poses") << 0 << "none";
    QTest::newRow("three, coils") << 3 << "auto";
  }
  void staysWithinTheBound() {
    QFETCH(int, orientations);
    QFETCH(QString, coils);
    const Case made = fittedCase(orientations, {{"inputs", "pose"}, {"sensor_coils", coils.toStdString()}});
    const auto baked = bakePosition(*made.exact, made.region, made.data.p_tracked_m, made.data.q_tracked, kBound_m, {});
    FT_VERIFY_OK(baked);
    QVERIFY((*baked)->takesOrientation());
    const std::vector<Pose> poses = posesOf(made, 3000);
    std::vector<Eigen::Vector3d> at_once(poses.size());
    (*baked)->correctPoses(poses, at_once);
    double worst_m = 0.0, turns_m = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Eigen::Vector3d exact_m = made.exact->displacementAt_m(poses[i]);
      worst_m = std::max(worst_m, ((*baked)->displacementAt_m(poses[i]) - exact_m).norm());
      turns_m = std::max(turns_m, (exact_m - made.exact->displacement_m(poses[i].position_m)).norm());
      QVERIFY((at_once[i] - poses[i].position_m - (*baked)->displacementAt_m(poses[i])).norm() < 1e-9);
      // Without an orientation both are the mean over those fitted.
      const Eigen::Vector3d mean_m = made.exact->displacement_m(poses[i].position_m);
      QVERIFY(((*baked)->displacement_m(poses[i].position_m) - mean_m).norm() < 2.0 * kBound_m);
    }
    QVERIFY2(worst_m < kBound_m, std::to_string(1e6 * worst_m).c_str());
    // There is something to follow: a hundred times the bound.
    QVERIFY2(turns_m > 2e-3, std::to_string(1e6 * turns_m).c_str());
  }

  void reloadsToTheSameBits() {
    const Case made = fittedCase(3, {{"inputs", "pose"}, {"sensor_coils", "none"}});
    const auto baked = bakePosition(*made.exact, made.region, made.data.p_tracked_m, made.data.q_tracked, kBound_m, {});
    FT_VERIFY_OK(baked);
    const nlohmann::json stored = nlohmann::json::parse((*baked)->parameters().dump());
    const auto reloaded = readBaked(JsonReader(stored, "baked"));
    for (const Pose& pose : posesOf(made, 200)) {
      QVERIFY(reloaded->displacementAt_m(pose) == (*baked)->displacementAt_m(pose));
      QVERIFY(reloaded->displacement_m(pose.position_m) == (*baked)->displacement_m(pose.position_m));
      QVERIFY(reloaded->jacobian(pose.position_m) == (*baked)->jacobian(pose.position_m));
      QCOMPARE(reloaded->uncertaintyAt_m(pose).has_value(), made.exact->uncertaintyAt_m(pose).has_value());
    }
  }

  void theDerivativeIsThatOfTheMean() {
    const Case made = fittedCase(3, {{"inputs", "pose"}, {"sensor_coils", "none"}});
    const auto baked = bakePosition(*made.exact, made.region, made.data.p_tracked_m, made.data.q_tracked, kBound_m, {});
    FT_VERIFY_OK(baked);
    for (const Pose& pose : posesOf(made, 20)) {
      Eigen::Matrix3d numeric = Eigen::Matrix3d::Identity();
      constexpr double kStep_m = 1e-3;
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(axis);
        numeric.col(axis) +=
            ((*baked)->displacement_m(pose.position_m + step_m) - (*baked)->displacement_m(pose.position_m - step_m)) /
            (2.0 * kStep_m);
      }
      QVERIFY(((*baked)->jacobian(pose.position_m) - numeric).norm() < 1e-3);
    }
  }

  void damagedOnesAreRefused() {
    const Case made = fittedCase(3, {{"inputs", "pose"}, {"sensor_coils", "none"}});
    const auto baked = bakePosition(*made.exact, made.region, made.data.p_tracked_m, made.data.q_tracked, kBound_m, {});
    FT_VERIFY_OK(baked);
    const nlohmann::json good = (*baked)->parameters();
    const auto refuses = [&](const nlohmann::json& json) {
      return !readJson<int>(json, "baked", [](const JsonReader& reader) {
        readBaked(reader);
        return 0;
      });
    };
    QVERIFY(!refuses(good));
    nlohmann::json fewer = good, empty = good, many = good;
    fewer["turning"].erase(fewer["turning"].begin());
    QVERIFY(refuses(fewer));
    empty["basis"]["mean"] = nlohmann::json::array();
    QVERIFY(refuses(empty));
    while (many["basis"]["centers_wxyz"].size() <= TurnBasis::kMostCenters)
      many["basis"]["centers_wxyz"].push_back({1.0, 0.0, 0.0, 0.0});
    QVERIFY(refuses(many));
  }
};

FIELDTRUE_TEST(TurningLatticesTest)
#include "turning_lattices_test.moc"
