#include "calib/identify/structure.h"

#include <Eigen/QR>
#include <QTest>
#include <cmath>

#include "calib/identify/origin.h"
#include "tests/calib/identify/noisy_rows.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::identify;
using namespace fieldtrue::testing;

namespace {

Eigen::Matrix3d ofRoom(const Pose& pose, const Eigen::Matrix3d& /*undisturbed*/) {
  return field::dipoleField(pose.position_m - Eigen::Vector3d(1.8, 0.3, 0.2), 1.0) *
         Eigen::Vector3d(0.02, -0.01, 0.015).asDiagonal();
}

Eigen::Matrix3d ofTransmitter(const Pose& /*pose*/, const Eigen::Matrix3d& undisturbed) {
  return undisturbed * Eigen::Vector3d(0.03, -0.02, 0.01).asDiagonal();
}

Eigen::Matrix3d ofSensor(const Pose& pose, const Eigen::Matrix3d& undisturbed) {
  const Eigen::Matrix3d R = pose.orientation.toRotationMatrix();
  return R * Eigen::Vector3d(0.03, -0.02, 0.01).asDiagonal() * R.transpose() * undisturbed;
}

struct Found {
  Structure structure;
  double planted = 0.0;  ///< Sum of squares of the residuals beside the alignment, in noise variances.
};

/// @param stated how much smaller than the truth the noise is said to be
Found findIn(const NoisyRows& options, unsigned seed, double stated = 1.0, bool with_origin = false) {
  const GapRows rows = noisyRows(options, seed);
  const GapPhysics physics(rows, {});
  const Whitening whitening = makeWhitening(rows, options.sd_m / stated, options.sd_rad / stated);
  const Linearized at(physics, {}, whitening, octantBlocks(rows));
  const Eigen::VectorXd x = at.nuisance().colPivHouseholderQr().solve(at.residual());
  return {findStructure(at, rows, with_origin), (at.residual() - at.nuisance() * x).squaredNorm()};
}

}  // namespace

class GapStructureTest : public QObject {
  Q_OBJECT
 private slots:
  /// Gradients of harmonic functions: free of curl and of divergence, and as many as the degree allows.
  void gradientsAreOfHarmonicFunctions_data() {
    QTest::addColumn<int>("degree");
    for (const int degree : {1, 2, 3, 4}) QTest::addRow("degree %d", degree) << degree;
  }
  void gradientsAreOfHarmonicFunctions() {
    QFETCH(int, degree);
    RandomGeometry random(3);
    for (int trial = 0; trial < 5; ++trial) {
      const Eigen::Vector3d p = random.pointInCube_m(1.0);
      constexpr double kStep = 1e-3;
      std::array<Eigen::Matrix3Xd, 3> slope;
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
        slope[static_cast<std::size_t>(axis)] =
            (harmonicGradients(p + step, degree) - harmonicGradients(p - step, degree)) / (2.0 * kStep);
      }
      QCOMPARE(slope[0].cols(), degree * (degree + 2));
      for (Eigen::Index j = 0; j < slope[0].cols(); ++j) {
        FT_VERIFY_MATCH(near(slope[0](0, j) + slope[1](1, j) + slope[2](2, j), 0.0, 1e-3));
        FT_VERIFY_MATCH(near(slope[0](1, j), slope[1](0, j), 1e-3));
        FT_VERIFY_MATCH(near(slope[0](2, j), slope[2](0, j), 1e-3));
        FT_VERIFY_MATCH(near(slope[1](2, j), slope[2](1, j), 1e-3));
      }
    }
  }

  void pureNoiseGivesUniformPValues_data() {
    QTest::addColumn<int>("turns");
    QTest::newRow("one orientation") << 1;
    QTest::newRow("two orientations") << 2;
  }
  void pureNoiseGivesUniformPValues() {
    QFETCH(int, turns);
    std::vector<double> p_values;
    for (unsigned seed = 1; seed <= 200; ++seed)
      p_values.push_back(findIn({.per_axis = 4, .turns = turns, .change = {}}, seed).structure.p_value);
    const double distance = distanceFromUniform(p_values);
    QVERIFY2(distance < kFarFromUniform200, qPrintable(QString::number(distance)));
  }

  /// No noise level enters: said to be half of what it is, the p-value stays and the scale says so.
  void needsNoNoiseLevel() {
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const Structure right = findIn({.per_axis = 5, .change = {}}, seed).structure;
      const Structure half = findIn({.per_axis = 5, .change = {}}, seed, 2.0).structure;
      FT_VERIFY_MATCH(near(half.p_value, right.p_value, 1e-6));
      FT_VERIFY_MATCH(near(right.scale.position, 1.0, 0.15));
      FT_VERIFY_MATCH(near(right.scale.rotation, 1.0, 0.15));
      FT_VERIFY_MATCH(near(half.scale.position, 2.0 * right.scale.position, 1e-6));
    }
  }

  /// What is left of each row, squared, is on the mean its noise squared, whatever its law: with one row of sixteen six
  /// times as wrong as the others, and where positions alone leave the fit half as many parameters as numbers.
  void noiseIsThatOfTheReadings_data() {
    QTest::addColumn<bool>("has_orientation");
    QTest::addColumn<double>("slip");
    QTest::newRow("poses") << true << 1.0;
    QTest::newRow("positions") << false << 1.0;
    QTest::newRow("poses, slips") << true << 6.0;
    QTest::newRow("positions, slips") << false << 6.0;
  }
  void noiseIsThatOfTheReadings() {
    QFETCH(bool, has_orientation);
    QFETCH(double, slip);
    const NoisyRows options{.per_axis = 4, .change = {}};
    double told = 0.0;
    double planted = 0.0;
    for (unsigned seed = 1; seed <= 100; ++seed) {
      std::vector<Node> nodes = noisyNodes(options, seed);
      for (Node& node : nodes) {
        const Eigen::Vector3d at_m = node.reference_from_sensor.position_m;
        Eigen::Vector3d noise_m = node.tracker_from_sensor.position_m - at_m;
        if (node.node % 16 == 5) noise_m *= slip;
        node.tracker_from_sensor.position_m = at_m + noise_m;
        node.has_orientation = has_orientation;
        planted += noise_m.squaredNorm() / (options.sd_m * options.sd_m);
      }
      const GapRows rows = makeGapRows(nodes, {}).value();
      const GapPhysics physics(rows, {});
      const Linearized at(physics, {}, makeWhitening(rows, options.sd_m, options.sd_rad), octantBlocks(rows));
      for (const Vector6d& one : findStructure(at, rows, false).noise) told += one.head<3>().squaredNorm();
    }
    // A slip draws the fit a little, and is found that much smaller.
    FT_VERIFY_MATCH(near(told / planted, 1.0, slip > 1.0 ? 0.04 : 0.02));
  }

  void saysWhereItComesFrom_data() {
    QTest::addColumn<int>("source");
    QTest::addColumn<int>("turns");
    QTest::newRow("room") << 0 << 1;
    QTest::newRow("room, sensor turned") << 0 << 3;
    QTest::newRow("transmitter, sensor turned") << 1 << 3;
    QTest::newRow("sensor, sensor turned") << 2 << 3;
  }
  void saysWhereItComesFrom() {
    QFETCH(int, source);
    QFETCH(int, turns);
    const std::array<FieldChange, 3> changes{ofRoom, ofTransmitter, ofSensor};
    const Structure found =
        findIn({.turns = turns, .change = changes[static_cast<std::size_t>(source)]}, 3, 1.0, true).structure;
    QVERIFY(found.p_value < 1e-20);
    const GapOrigin& origin = found.origin;
    const std::array<double, 4> shares{origin.room, origin.transmitter, origin.sensor, origin.jig_or_time};
    FT_VERIFY_MATCH(near(shares[0] + shares[1] + shares[2] + shares[3], 1.0, 1e-9));
    const auto most = std::max_element(shares.begin(), shares.end()) - shares.begin();
    QCOMPARE(static_cast<int>(most), source);
  }

  /// With one orientation the transmitter's coil errors and the sensor's are nearly one thing, and get equal shares.
  void cannotTellTransmitterFromSensorAtOneOrientation() {
    for (const FieldChange& change : {FieldChange(ofTransmitter), FieldChange(ofSensor)}) {
      const GapOrigin origin = findIn({.change = change}, 3, 1.0, true).structure.origin;
      FT_VERIFY_MATCH(near(origin.transmitter, origin.sensor, 0.05));
    }
  }

  /// What it explains is what was planted: the residuals' sum of squares less what noise alone leaves.
  void energyIsWhatWasPlanted() {
    const Found found = findIn({.turns = 3, .change = ofTransmitter}, 5);
    const double n_rows = 4 * 4 * 4 * 3 * 6;
    const double expected = found.planted - n_rows;
    const double sd = found.structure.energy_sd + 2.0 * std::sqrt(n_rows);
    QVERIFY(expected > 20.0 * sd);
    FT_VERIFY_MATCH(near(found.structure.energy, expected, 0.1 * expected));
  }
};

FIELDTRUE_TEST(GapStructureTest)
#include "structure_test.moc"
