#include <QTest>
#include <cmath>

#include "calib/field/dipole_field.h"
#include "calib/field/pose_solver.h"
#include "calib/geometry/geometry.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

constexpr double kPlacedSd_m = 0.002;
constexpr double kSlip_m = 0.02;
constexpr int kOfTable = 100;

Eigen::Vector3d somewhere_m(RandomGeometry& random) {
  return {random.between(0.6, 2.2), random.between(-0.9, 0.9), random.between(-0.7, 0.7)};
}

/// What a tracker reads beside a body, half a metre off the places' corner, that answers along one axis.
/// @param strength 0: nothing is there
Eigen::Vector3d trackedBesideBody_m(const Eigen::Vector3d& p_true_m, double strength) {
  const Eigen::Vector3d body_at_m(2.6, 0.5, -0.4);
  const Eigen::Vector3d along = Eigen::Vector3d(0.8, 0.6, 0.0);
  const Eigen::Matrix3d moments = -strength * along * along.transpose() * field::dipoleField(body_at_m, 1.0);
  const Eigen::Matrix3d field =
      field::dipoleField(p_true_m, 1.0) + field::dipoleField(p_true_m - body_at_m, 1.0) * moments;
  return field::solvePose(field, 1.0, p_true_m).value().tracker_from_sensor.position_m;
}

struct Tables {
  FitData slipped;  ///< One place in ten set down beside its mark.
  FitData without;  ///< The same without these.
};

void add(const Eigen::Vector3d& tracked_m, const Eigen::Vector3d& true_m, FitData& data) {
  data.node.push_back(static_cast<int>(data.size()));
  data.p_tracked_m.push_back(tracked_m);
  data.p_true_m.push_back(true_m);
}

Tables tablesOf(unsigned seed, double strength) {
  RandomGeometry random(seed);
  Tables tables;
  for (int i = 0; i < kOfTable; ++i) {
    const Eigen::Vector3d p_m = somewhere_m(random);
    const Eigen::Vector3d tracked_m = trackedBesideBody_m(p_m, strength);
    const Eigen::Vector3d placed_m =
        p_m + kPlacedSd_m * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    const bool is_slip = i % 10 == 0;
    add(tracked_m, is_slip ? Eigen::Vector3d(placed_m + kSlip_m * random.direction()) : placed_m, tables.slipped);
    if (!is_slip) add(tracked_m, placed_m, tables.without);
  }
  return tables;
}

double meanSquare_m2(const PositionModel& model, unsigned seed, double strength) {
  constexpr int kFresh = 400;
  RandomGeometry random(1000 + seed);
  double sum_m2 = 0.0;
  for (int i = 0; i < kFresh; ++i) {
    const Eigen::Vector3d p_m = somewhere_m(random);
    const Eigen::Vector3d tracked_m = trackedBesideBody_m(p_m, strength);
    sum_m2 += (tracked_m + model.displacement_m(tracked_m) - p_m).squaredNorm() / kFresh;
  }
  return sum_m2;
}

}  // namespace

/// A jig set down beside its mark is no field.
class HarmonicSlipsTest : public QObject {
  Q_OBJECT
 private slots:
  /// What is corrected at places not seen is nearly as good as without the slips.
  void slipsAreGivenLittleWeight_data() {
    QTest::addColumn<double>("strength");
    QTest::newRow("nothing there") << 0.0;
    QTest::newRow("a body") << 0.6;
  }
  void slipsAreGivenLittleWeight() {
    constexpr unsigned kTables = 6;
    QFETCH(double, strength);
    double slipped_m2 = 0.0, without_m2 = 0.0;
    for (unsigned seed = 1; seed <= kTables; ++seed) {
      const Tables tables = tablesOf(seed, strength);
      const auto model = fitPosition("harmonic_field", tables.slipped);
      const auto clean = fitPosition("harmonic_field", tables.without);
      FT_VERIFY_OK(model);
      FT_VERIFY_OK(clean);
      slipped_m2 += meanSquare_m2(**model, seed, strength) / kTables;
      without_m2 += meanSquare_m2(**clean, seed, strength) / kTables;
    }
    QVERIFY2(slipped_m2 < 1.5 * 1.5 * without_m2, qPrintable(QStringLiteral("%1 mm, without the slips %2 mm")
                                                                 .arg(1e3 * std::sqrt(slipped_m2))
                                                                 .arg(1e3 * std::sqrt(without_m2))));
  }
};

FIELDTRUE_TEST(HarmonicSlipsTest)
#include "harmonic_slips_test.moc"
