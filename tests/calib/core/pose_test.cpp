#include "calib/core/pose.h"

#include <QTest>
#include <cmath>
#include <stdexcept>

#include "calib/core/units.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {
const double kHalf = std::sqrt(0.5);
}  // namespace

class PoseTest : public QObject {
  Q_OBJECT

 private slots:
  void composesAndInverts() {
    // b is a turned by 90 deg about z and moved by (1, 0, 0): the point (1, 0, 0) of a is at (1, 1, 0) in b.
    const Pose b_from_a{{1.0, 0.0, 0.0}, Eigen::Quaterniond(kHalf, 0.0, 0.0, kHalf)};
    FT_VERIFY_MATCH(near(b_from_a * Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::Vector3d(1.0, 1.0, 0.0), 1e-15));
    FT_VERIFY_MATCH(near(inverse(b_from_a) * Eigen::Vector3d(1.0, 1.0, 0.0), Eigen::Vector3d(1.0, 0.0, 0.0), 1e-15));
    const Pose c_from_b{{0.0, 2.0, 0.0}, Eigen::Quaterniond(kHalf, 0.0, 0.0, kHalf)};
    const Pose expected{{0.0, 3.0, 0.0}, Eigen::Quaterniond(0.0, 0.0, 0.0, 1.0)};
    FT_VERIFY_MATCH(near(c_from_b * b_from_a, expected, 1e-15, 1e-15));
    FT_VERIFY_MATCH(near(inverse(b_from_a) * b_from_a, Pose{}, 1e-15, 1e-15));
  }

  void canonicalFormIsUnique_data() {
    QTest::addColumn<QVector<double>>("seen");
    QTest::addColumn<QVector<double>>("expected");
    QTest::newRow("negative w") << QVector<double>{-2, 0, 0, 0} << QVector<double>{1, 0, 0, 0};
    QTest::newRow("scaled") << QVector<double>{3, 0, 4, 0} << QVector<double>{0.6, 0, 0.8, 0};
    QTest::newRow("half turn") << QVector<double>{0, 0, -1, 0} << QVector<double>{0, 0, 1, 0};
    QTest::newRow("half turn with negative zero") << QVector<double>{-0.0, -1, 0, 0} << QVector<double>{0, 1, 0, 0};
  }
  void canonicalFormIsUnique() {
    QFETCH(QVector<double>, seen);
    QFETCH(QVector<double>, expected);
    const Eigen::Quaterniond q = canonical(Eigen::Quaterniond(seen[0], seen[1], seen[2], seen[3]));
    QVERIFY(q.w() >= 0.0);
    const Eigen::Vector4d difference = q.coeffs() - Eigen::Vector4d(expected[1], expected[2], expected[3], expected[0]);
    QVERIFY(difference.norm() < 1e-15);
  }
  void canonicalOfZeroIsAMistake() {
    QVERIFY_THROWS_EXCEPTION(std::logic_error, canonical(Eigen::Quaterniond(0, 0, 0, 0)));
  }

  void rotationVectors_data() {
    QTest::addColumn<double>("x");
    QTest::addColumn<double>("y");
    QTest::addColumn<double>("z");
    QTest::newRow("none") << 0.0 << 0.0 << 0.0;
    QTest::newRow("tiny") << 1e-12 << -2e-12 << 0.5e-12;
    QTest::newRow("below the series limit") << 9.9e-5 << 0.0 << 0.0;
    QTest::newRow("above the series limit") << 1.01e-4 << 0.0 << 0.0;
    QTest::newRow("quarter turn") << 0.0 << kPi / 2 << 0.0;
    QTest::newRow("nearly a half turn") << 0.0 << 0.0 << kPi - 1e-9;
    QTest::newRow("skew") << 1.1 << -0.7 << 2.2;
  }
  void rotationVectors() {
    QFETCH(double, x);
    QFETCH(double, y);
    QFETCH(double, z);
    const Eigen::Vector3d vector(x, y, z);
    const Eigen::Quaterniond q = rotationFromVector(vector);
    if (vector.norm() > 0.0) {
      const Eigen::Quaterniond expected(Eigen::AngleAxisd(vector.norm(), vector.normalized()));
      QVERIFY((q.coeffs() - expected.coeffs()).norm() < 1e-15);
    }
    const Eigen::Vector3d back = rotationVector_rad(q);
    QVERIFY((back - vector).norm() <= 1e-15 + 1e-9 * vector.norm());
    QVERIFY((rotationVector_rad(Eigen::Quaterniond(-q.coeffs())) - back).norm() < 1e-15);
  }

  void angles() {
    const Eigen::Quaterniond quarter(kHalf, kHalf, 0.0, 0.0);
    const Eigen::Quaterniond identity = Eigen::Quaterniond::Identity();
    FT_VERIFY_MATCH(near(angleBetween_rad(identity, quarter), kPi / 2, 1e-15));
    FT_VERIFY_MATCH(near(angleBetween_rad(identity, Eigen::Quaterniond(-quarter.coeffs())), kPi / 2, 1e-15));
    FT_VERIFY_MATCH(near(angleBetween_rad(identity, Eigen::Quaterniond(0, 0, 1, 0)), kPi, 1e-15));
    // acos of the scalar part would lose this: 1 - cos(1e-9) is below the double's resolution.
    FT_VERIFY_MATCH(near(angleBetween_rad(identity, rotationFromVector({0, 1e-9, 0})), 1e-9, 1e-20));
  }

  void euler_data() {
    QTest::addColumn<double>("azimuth");
    QTest::addColumn<double>("elevation");
    QTest::addColumn<double>("roll");
    QTest::newRow("zero") << 0.0 << 0.0 << 0.0;
    QTest::newRow("one each") << 0.3 << -0.8 << 2.5;
    QTest::newRow("azimuth behind") << -3.0 << 0.2 << -1.0;
    QTest::newRow("near the pole") << 0.5 << kPi / 2 - 1e-6 << 0.25;
  }
  void euler() {
    QFETCH(double, azimuth);
    QFETCH(double, elevation);
    QFETCH(double, roll);
    const Eigen::Quaterniond q = rotationFromEuler({azimuth, elevation, roll});
    // The sensor's x axis points along azimuth and elevation: (cos az cos el, sin az cos el, -sin el).
    const Eigen::Vector3d x_axis(std::cos(azimuth) * std::cos(elevation), std::sin(azimuth) * std::cos(elevation),
                                 -std::sin(elevation));
    FT_VERIFY_MATCH(near(Eigen::Vector3d(q * Eigen::Vector3d::UnitX()), x_axis, 1e-15));
    FT_VERIFY_MATCH(near(eulerFromRotation_rad(q), Eigen::Vector3d(azimuth, elevation, roll), 1e-9));
  }
  void eulerAtThePoles_data() {
    QTest::addColumn<double>("elevation");
    QTest::newRow("up") << kPi / 2;
    QTest::newRow("down") << -kPi / 2;
  }
  void eulerAtThePoles() {
    QFETCH(double, elevation);
    const Eigen::Quaterniond q = rotationFromEuler({0.7, elevation, 0.2});
    const Eigen::Vector3d angles = eulerFromRotation_rad(q);
    QCOMPARE(angles[2], 0.0);
    FT_VERIFY_MATCH(near(angles[1], elevation, 1e-7));
    FT_VERIFY_MATCH(near(rotationFromEuler(angles), q, 1e-7));
  }
};

FIELDTRUE_TEST(PoseTest)
#include "pose_test.moc"
