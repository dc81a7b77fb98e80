#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"
#include "tests/calib/calibration/bent_table.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::calibration;
using namespace fieldtrue::testing;
using nlohmann::json;

namespace {

Result<Corrector> fitted(const std::string& position) {
  const CalibrationTable table = bentTable();
  return Corrector::fit(table.nodes, table.metadata, parseCorrectorChoice(position, "hmq_matrix").value(),
                        AlignMode::kRigid);
}

/// Tracked positions between the places, and some beside them.
std::vector<Eigen::Vector3d> trackedPoints(std::size_t count) {
  const CalibrationTable table = bentTable();
  std::mt19937_64 generator(77);
  std::uniform_real_distribution<double> share(0.0, 1.2);
  std::vector<Eigen::Vector3d> points_m;
  while (points_m.size() < count) {
    const Eigen::Vector3d from_m = table.nodes[generator() % table.nodes.size()].tracker_from_sensor.position_m;
    const Eigen::Vector3d to_m = table.nodes[generator() % table.nodes.size()].tracker_from_sensor.position_m;
    points_m.emplace_back(from_m + share(generator) * (to_m - from_m));
  }
  return points_m;
}

}  // namespace

/// A calibration with its position part baked.
class CorrectorBakingTest : public QObject {
  Q_OBJECT
 private slots:
  void everyMethodStaysWithinTheBoundOrSaysThatItCannot_data() {
    QTest::addColumn<QByteArray>("id");
    for (const correctors::PositionMethod& method : correctors::positionMethods()) {
#ifdef __SANITIZE_ADDRESS__  // Its dense lattice then takes a quarter of an hour: an inverse for each coefficient.
      if (method.id == "harmonic_field") continue;
#endif
      QTest::newRow(method.id.c_str()) << QByteArray::fromStdString(method.id);
    }
  }
  void everyMethodStaysWithinTheBoundOrSaysThatItCannot() {
    QFETCH(QByteArray, id);
    const auto original = fitted(id.toStdString());
    if (!original) {
      // The turned rig's grid stands askew in tracked space; only these two methods need a straight one.
      QVERIFY2(id == "trilinear" || id == "local_briggs", original.error().message.c_str());
      FT_VERIFY_MATCH(holdsAll(original.error().message, {"needs a grid along the tracker's axes"}));
      return;
    }
    constexpr double kBound_m = 3e-3;
    const auto baked = original->baked(kBound_m);
    if (!baked) {
      QCOMPARE(baked.error().code, ErrorCode::kUnsupported);
      FT_VERIFY_MATCH(holdsAll(baked.error().message, {"larger deviation"}));
      return;
    }
    int n_inside = 0;
    for (const Eigen::Vector3d& p_m : trackedPoints(3000)) {
      if (!original->covers(p_m)) continue;
      ++n_inside;
      QVERIFY(baked->covers(p_m));
      FT_VERIFY_MATCH(near(baked->correctPosition_m(p_m), original->correctPosition_m(p_m), kBound_m));
    }
    QVERIFY(n_inside > 100);
  }

  void coversWhatAGlobalMethodCovered() {
    const Corrector original = fitted("hmq").value();
    const auto baked = original.baked(100e-6);
    FT_VERIFY_OK(baked);
    for (const Eigen::Vector3d& p_m : trackedPoints(5000)) QCOMPARE(baked->covers(p_m), original.covers(p_m));
  }

  void fileHoldsTheLatticeAndReloadsToTheSameBits() {
    const auto baked = fitted("hmq")->baked(100e-6);
    FT_VERIFY_OK(baked);
    const std::string text = baked->toText();
    const json content = json::parse(text);
    QVERIFY(content.at("schema") == "fieldtrue.ftcal/2");
    QVERIFY(content.at("position").at("method") == "hmq");
    QVERIFY(!content.at("position").contains("parameters"));
    const auto reloaded = Corrector::fromText(text, "baked.ftcal.json");
    FT_VERIFY_OK(reloaded);
    QVERIFY(reloaded->isBaked());
    QCOMPARE(QByteArray::fromStdString(reloaded->toText()), QByteArray::fromStdString(text));
    for (const Eigen::Vector3d& p_m : trackedPoints(3000)) {
      const Pose tracked{p_m, rotationFromVector(3.0 * p_m)};
      FT_VERIFY_MATCH(sameBits(reloaded->correct(tracked), baked->correct(tracked)));
      QCOMPARE(reloaded->covers(p_m), baked->covers(p_m));
    }
  }

  void reportIsTheLatticesOwn() {
    const Corrector original = fitted("hmq").value();
    const auto baked = original.baked(100e-6);
    FT_VERIFY_OK(baked);
    // An interpolator passes through its places; its lattice misses them by up to the bound.
    QVERIFY(original.report().max_m < 1e-8);
    QVERIFY(baked->report().max_m > 1e-8 && baked->report().max_m <= 100e-6);
    QCOMPARE(baked->report().n_nodes, original.report().n_nodes);
    FT_VERIFY_MATCH(holdsAll(baked->report().notes.back(), {"Baked: lattice", "largest deviation"}));
    for (const Eigen::Vector3d& p_m : trackedPoints(20)) {
      const Pose tracked{p_m, rotationFromVector(3.0 * p_m)};
      QVERIFY(baked->correct(tracked).orientation.coeffs() == original.correct(tracked).orientation.coeffs());
    }
  }

  void wrongRequestsAreSaid() {
    const Corrector original = fitted("affine").value();
    for (const double bad : {0.0, -1e-6, std::nan(""), HUGE_VAL}) {
      const auto baked = original.baked(bad);
      QVERIFY(!baked && baked.error().code == ErrorCode::kBadInput);
    }
    const auto twice = original.baked(1e-4)->baked(1e-4);
    QVERIFY(!twice && twice.error().code == ErrorCode::kUnsupported);
    FT_VERIFY_MATCH(holdsAll(twice.error().message, {"baked already"}));
  }
};

FIELDTRUE_TEST(CorrectorBakingTest)
#include "corrector_baking_test.moc"
