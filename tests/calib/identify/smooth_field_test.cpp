#include "calib/identify/smooth_field.h"

#include <Eigen/Eigenvalues>
#include <QTest>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::identify;
using namespace fieldtrue::testing;

namespace {

double matern52(double d) { return (1.0 + std::sqrt(5.0) * d + 5.0 * d * d / 3.0) * std::exp(-std::sqrt(5.0) * d); }

std::vector<FieldPoint> randomPoints(int n, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<FieldPoint> points;
  for (int i = 0; i < n; ++i) {
    FieldPoint point;
    point.place_m = {uniform(generator), uniform(generator), uniform(generator)};
    point.turned =
        Eigen::Quaterniond(normal(generator), normal(generator), normal(generator), normal(generator)).normalized();
    point.time_s = 100.0 * uniform(generator);
    points.push_back(point);
  }
  return points;
}

}  // namespace

class SmoothFieldTest : public QObject {
  Q_OBJECT
 private slots:
  /// One reading of 3 with noise variance 1 and a field of variance 4: what is foretold at distance d is
  /// 4 k(d) / (4 + 1) * 3, and the density is that of a normal of variance 5 (twice with 0).
  void onePointByHand() {
    FieldPoint here;
    FieldPoint there;
    there.place_m = {0.3, 0.0, 0.4};
    Eigen::MatrixX3d values(1, 3);
    values << 3.0, 0.0, 0.0;
    const SmoothLaw law{.length_m = 0.5, .by_place = 2.0};
    const SmoothField field({here}, values, Eigen::VectorXd::Ones(1), law);
    FT_VERIFY_MATCH(near(field.at(here).x(), 12.0 / 5.0, 1e-12));
    FT_VERIFY_MATCH(near(field.at(there).x(), 12.0 / 5.0 * matern52(1.0), 1e-12));
    FT_VERIFY_MATCH(near(field.at(there).y(), 0.0, 1e-12));
    FT_VERIFY_MATCH(near(field.logEvidence(), -0.5 * 9.0 / 5.0 - 1.5 * std::log(2.0 * std::numbers::pi * 5.0), 1e-12));
  }

  /// q and -q are one turn, and far from all readings nothing is foretold.
  void turnsAndDistance() {
    const std::vector<FieldPoint> points = randomPoints(20, 1);
    const Eigen::MatrixX3d values = Eigen::MatrixX3d::Random(20, 3);
    const SmoothField field(points, values, Eigen::VectorXd::Constant(20, 0.01), {.length_m = 0.5, .by_turn = 1.0});
    FieldPoint at = points[3];
    const Eigen::Vector3d value = field.at(at);
    at.turned.coeffs() = -at.turned.coeffs();
    QVERIFY((field.at(at) - value).norm() < 1e-12);
    at.place_m *= 1e3;
    QVERIFY(field.at(at).norm() < 1e-9);
  }

  /// The evidence is finite, so the kernel is positive definite, with readings at the same place turned otherwise.
  void isPositiveDefinite() {
    std::vector<FieldPoint> points = randomPoints(60, 2);
    for (std::size_t i = 0; i < points.size(); ++i) points[i].place_m = points[i % 5].place_m;
    const SmoothLaw law{.length_m = 0.7, .time_s = 30.0, .far_m = 2.0, .by_place = 1.0, .by_turn = 2.0, .by_time = 0.5};
    const SmoothField field(points, Eigen::MatrixX3d::Ones(60, 3), Eigen::VectorXd::Constant(60, 1e-6), law);
    QVERIFY(std::isfinite(field.logEvidence()));
  }

  void noiseIsNoField() {
    const std::vector<FieldPoint> points = randomPoints(100, 3);
    std::mt19937_64 generator(4);
    std::normal_distribution<double> normal(0.0, 1.0);
    int silent = 0;
    for (int draw = 0; draw < 10; ++draw) {
      Eigen::MatrixX3d values(100, 3);
      for (Eigen::Index i = 0; i < values.size(); ++i) values.data()[i] = normal(generator);
      const Eigen::VectorXd variances = Eigen::VectorXd::Ones(100);
      const SmoothLaw law = likeliestLaw(points, values, variances, {true, true});
      const double gain = SmoothField(points, values, variances, law).logEvidence() -
                          SmoothField(points, values, variances, {}).logEvidence();
      silent += gain < 4.0 ? 1 : 0;
    }
    QCOMPARE(silent, 10);
  }

  /// A field that is there is found and foretold at places that were not read; each kind by its own part.
  void foretellsWhatVaries_data() {
    QTest::addColumn<int>("kind");
    QTest::newRow("by place") << 0;
    QTest::newRow("by turn") << 1;
    QTest::newRow("by time") << 2;
  }
  void foretellsWhatVaries() {
    QFETCH(int, kind);
    std::vector<FieldPoint> points = randomPoints(220, 5);
    const Eigen::Quaterniond turns[] = {Eigen::Quaterniond::Identity(), Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0)};
    for (std::size_t i = 0; i < points.size(); ++i) points[i].turned = turns[i % 2];
    const auto truth = [&](const FieldPoint& p) -> Eigen::Vector3d {
      if (kind == 0) return {std::sin(3.0 * p.place_m.x()), p.place_m.y() * p.place_m.z(), 0.0};
      if (kind == 1)
        return p.turned.x() > 0.5 ? Eigen::Vector3d(1.0, p.place_m.x(), 0.0) : Eigen::Vector3d(-1.0, 0.0, 0.0);
      return Eigen::Vector3d::Constant(std::sin(p.time_s / 20.0));
    };
    std::mt19937_64 generator(6);
    std::normal_distribution<double> normal(0.0, 0.1);
    Eigen::MatrixX3d values(120, 3);
    for (Eigen::Index i = 0; i < 120; ++i)
      for (int axis = 0; axis < 3; ++axis)
        values(i, axis) = truth(points[static_cast<std::size_t>(i)])[axis] + normal(generator);
    const std::vector<FieldPoint> known(points.begin(), points.begin() + 120);
    const Eigen::VectorXd variances = Eigen::VectorXd::Constant(120, 0.01);
    const SmoothLaw law = likeliestLaw(known, values, variances, {true, true});
    const SmoothField field(known, values, variances, law);
    double before = 0.0;
    double after = 0.0;
    for (std::size_t i = 120; i < points.size(); ++i) {
      before += truth(points[i]).squaredNorm();
      after += (truth(points[i]) - field.at(points[i])).squaredNorm();
    }
    QVERIFY2(after < 0.05 * before, qPrintable(QString("%1 of %2").arg(after).arg(before)));
  }
};

FIELDTRUE_TEST(SmoothFieldTest)
#include "smooth_field_test.moc"
