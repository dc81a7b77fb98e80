#include <Eigen/LU>
#include <QTest>
#include <cmath>
#include <optional>

#include "calib/correctors/harmonic/harmonic_field_physics.h"
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

/// Nothing where the way there folds.
std::optional<Eigen::Vector3d> grownFrom_m(const Eigen::Vector3d& reading_m, const FieldSource& source,
                                           const SoftBox& box) {
  constexpr int kParts = 40;
  constexpr double kStep_m = 1e-5;
  Eigen::Vector3d p_m = reading_m;
  for (int part = 1; part <= kParts; ++part) {
    const HeldField grown(DisturbedField({{source.at_m, source.response * part / kParts}}), box);
    for (int step = 0; step < 10 && (reading_m - grown.trackedPosition_m(p_m)).norm() > 1e-10; ++step) {
      Eigen::Matrix3d jacobian;
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(axis);
        jacobian.col(axis) =
            (grown.trackedPosition_m(p_m + step_m) - grown.trackedPosition_m(p_m - step_m)) / (2.0 * kStep_m);
      }
      if (!(jacobian.determinant() > 0.05)) return std::nullopt;
      p_m += jacobian.inverse() * (reading_m - grown.trackedPosition_m(p_m));
    }
    if (!((reading_m - grown.trackedPosition_m(p_m)).norm() < 1e-8)) return std::nullopt;
  }
  return p_m;
}

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

  /// Stretched, bent and swaying as no dipole tracker is: a field that makes it worse at the places themselves is none.
  /// In these tables the fit can end with one that leaves 655 to 1,014 mm of 580 to 603. An alignment that gives places
  /// far off less weight leaves up to 1 % more.
  void leavesNoMoreThanNothing() {
    for (const unsigned seed : {5U, 23U, 40U, 54U}) {
      RandomGeometry random(seed);
      FitData data;
      for (int i = 0; i < 60; ++i) {
        const Eigen::Vector3d p_m(random.between(0.6, 2.6), random.between(-1.0, 1.0), random.between(-0.8, 0.8));
        data.p_true_m.push_back(p_m);
        data.p_tracked_m.emplace_back(1.6 * p_m.x() + 0.3 * p_m.y() * p_m.y(), 1.5 * p_m.y(),
                                      p_m.z() + 0.6 * std::sin(3.0 * p_m.x()));
        data.node.push_back(i);
      }
      const Pose motion = fitRigid(data.p_true_m, data.p_tracked_m).value();
      for (Eigen::Vector3d& p_m : data.p_true_m) p_m = motion * p_m;
      const auto model = fitPosition("harmonic_field", data);
      FT_VERIFY_OK(model);
      QVERIFY2(rmsOf_m(data, model->get()) <= 1.02 * rmsOf_m(data, nullptr), qPrintable(QString::number(seed)));
    }
  }

  /// With no source allowed the floor's decimetres stay, and it must not be said that there is only noise: nine places
  /// in ten that were not fitted err by less than what is stated of three axes.
  void knowsWhatItCannotModel() {
    constexpr double kNineInTen = 1.4436;
    FitData data = floorData(3), fresh = floorData(3);
    data.jig_sd_m = kJigSd_m;
    for (FitData* half : {&data, &fresh}) {
      const auto first = half == &data ? 0 : kPlaces / 2;
      const auto part = [&](auto& values) {
        values = std::decay_t<decltype(values)>(values.begin() + first, values.begin() + first + kPlaces / 2);
      };
      part(half->p_tracked_m);
      part(half->p_true_m);
      part(half->node);
    }
    const auto model = fitPosition("harmonic_field", data, {{"most_sources", "0"}});
    FT_VERIFY_OK(model);
    QVERIFY((*model)->note().find("No field of sources outside the places") == 0);
    int n_within = 0;
    for (std::size_t i = 0; i < fresh.size(); ++i) {
      const Eigen::Vector3d& p_m = fresh.p_tracked_m[i];
      const double error_m = (p_m + (*model)->displacement_m(p_m) - fresh.p_true_m[i]).norm();
      n_within += error_m < kNineInTen * (*model)->uncertainty_m(p_m).value() ? 1 : 0;
    }
    QVERIFY2(n_within >= 15, qPrintable(QString("%1 of 20").arg(n_within)));
    const auto read = findPositionMethod("harmonic_field").value()->load((*model)->parameters());
    FT_VERIFY_OK(read);
    QCOMPARE((*read)->uncertainty_m(fresh.p_tracked_m[0]), (*model)->uncertainty_m(fresh.p_tracked_m[0]));
  }

  /// Beside strong sources several places are tracked to one reading. The one that is meant goes on from the reading as
  /// the sources grow, which is followed here in forty parts by Newton's method.
  void findsThePlaceThatGrowsFromTheReading() {
    RandomGeometry random(5);
    const SoftBox box{{0.6, -1.2, -0.9}, {3.0, 1.2, 0.9}, 0.06};
    int n_followed = 0;
    for (int k = 0; k < 24; ++k) {
      const Eigen::Vector3d at_m(random.between(1.0, 2.8), random.between(1.5, 1.8), random.between(-0.6, 0.6));
      const Eigen::Vector3d along = random.direction();
      const FieldSource source{at_m, -0.02 * along * (along.transpose() * field::dipoleField(at_m, 1.0))};
      const HeldField field(DisturbedField({source}), box);
      for (int i = 0; i < 250; ++i) {
        const Eigen::Vector3d reading_m(random.between(0.6, 3.0), random.between(0.4, 1.2), random.between(-0.9, 0.9));
        const std::optional<Eigen::Vector3d> p_m = grownFrom_m(reading_m, source, box);
        if (!p_m) continue;
        ++n_followed;
        const double off_m = (field.truePosition_m(reading_m) - *p_m).norm();
        QVERIFY2(off_m < 1e-5, qPrintable(QString("source %1, reading %2: %3 m off").arg(k).arg(i).arg(off_m)));
      }
    }
    QVERIFY(n_followed > 4500);
  }
};

FIELDTRUE_TEST(HarmonicFloorTest)
#include "harmonic_floor_test.moc"
