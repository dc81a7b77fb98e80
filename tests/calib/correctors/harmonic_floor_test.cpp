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

constexpr double kJigSd_m = 0.002;
constexpr int kPlaces = 40;

/// What a tracker reads above a floor 1.6 m below it that answers with 0.8 of the transmitter's image: moments along it
/// against those of the coils, the one across it along with its coil.
Eigen::Vector3d trackedAboveFloor_m(const Eigen::Vector3d& p_true_m) {
  const Eigen::Vector3d image_at_m(0.0, 0.0, -3.2);
  const Eigen::Matrix3d image = Eigen::Vector3d(-0.8, -0.8, 0.8).asDiagonal();
  const Eigen::Matrix3d field =
      field::dipoleField(p_true_m, 1.0) + field::dipoleField(p_true_m - image_at_m, 1.0) * image;
  return field::solvePose(field, 1.0, p_true_m).value().tracker_from_sensor.position_m;
}

/// Places strewn over a room, the truth off by the jig and brought to the readings by the best rigid motion. No
/// tolerance is stated.
FitData floorData(unsigned seed) {
  RandomGeometry random(seed);
  FitData data;
  for (int i = 0; i < kPlaces; ++i) {
    const Eigen::Vector3d p_m(random.between(0.6, 3.0), random.between(-1.2, 1.2), random.between(-0.9, 0.9));
    data.p_tracked_m.push_back(trackedAboveFloor_m(p_m));
    data.p_true_m.push_back(p_m + kJigSd_m * Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
    data.node.push_back(i);
  }
  const Pose motion = fitRigid(data.p_true_m, data.p_tracked_m).value();
  for (Eigen::Vector3d& p_m : data.p_true_m) p_m = motion * p_m;
  return data;
}

double rmsOf_m(const FitData& data, const PositionModel* model) {
  double sum_m2 = 0.0;
  for (std::size_t i = 0; i < data.size(); ++i) {
    const Eigen::Vector3d& p_m = data.p_tracked_m[i];
    const Eigen::Vector3d move_m = model == nullptr ? Eigen::Vector3d::Zero() : model->displacement_m(p_m);
    sum_m2 += (p_m + move_m - data.p_true_m[i]).squaredNorm();
  }
  return std::sqrt(sum_m2 / static_cast<double>(data.size()));
}

}  // namespace

/// A floor that bends readings by decimetres: the first linear model is far off, and a fit that loses its way there
/// ends among no sources at all, or with one where it needs three.
class HarmonicFloorTest : public QObject {
  Q_OBJECT
 private slots:
  void findsItsWayInEveryTable() {
    for (unsigned seed = 1; seed <= 24; ++seed) {
      const FitData data = floorData(seed);
      QVERIFY(rmsOf_m(data, nullptr) > 0.1);
      const auto model = fitPosition("harmonic_field", data);
      FT_VERIFY_OK(model);
      const double left_m = rmsOf_m(data, model->get());
      // The jig's own RMS over three axes is 3.5 mm.
      QVERIFY2(left_m < 2.0 * std::sqrt(3.0) * kJigSd_m,
               qPrintable(QString("table %1: %2 mm are left").arg(seed).arg(1000.0 * left_m)));
    }
  }
};

FIELDTRUE_TEST(HarmonicFloorTest)
#include "harmonic_floor_test.moc"
