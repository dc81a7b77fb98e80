#include <QTest>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/correctors/baked/baked_lattice_maker.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/harmonic/harmonic_field_evidence.h"
#include "calib/correctors/harmonic/harmonic_field_linear.h"
#include "calib/correctors/harmonic/harmonic_field_physics.h"
#include "calib/correctors/harmonic/six_columns.h"
#include "calib/effects/compact_metal.h"
#include "calib/field/pose_solver.h"
#include "calib/field/tracker_model.h"
#include "calib/geometry/geometry.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

/// A sphere beside the grid of `roomGrid`, 0.45 m from its nearest places.
std::unique_ptr<field::CouplingDistortion> cabinet() {
  return effects::makeCompactMetal(
      {2.0, 0.9, 0.1}, effects::spherePolarizability_m3(0.2, false, 1.0) * Eigen::Matrix3d::Identity(), 0.2);
}

/// Sheets of metal beside and above the grid, stronger in the middle than at the edge.
class Plates final : public field::CouplingDistortion {
 public:
  Plates() {
    addPlate({1.3, 0.93, 0.07}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ());
    addPlate({1.4, 0.05, 0.87}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY());
  }
  Eigen::Matrix3d fieldChange(const Eigen::Vector3d& p_m, double dipole_constant_m3, double time_s) const override {
    Eigen::Matrix3d change = Eigen::Matrix3d::Zero();
    for (const auto& piece : pieces_) change += piece->fieldChange(p_m, dipole_constant_m3, time_s);
    return change;
  }

 private:
  void addPlate(const Eigen::Vector3d& center_m, const Eigen::Vector3d& along, const Eigen::Vector3d& up) {
    const Eigen::Vector3d normal = along.cross(up);
    for (int i = 0; i < 10; ++i) {
      for (int j = 0; j < 10; ++j) {
        const double u = (i + 0.5) / 5.0 - 1.0;
        const double v = (j + 0.5) / 5.0 - 1.0;
        const double strength_m3 = -0.004 * std::sqrt((1.0 - u * u) * (1.0 - v * v));
        pieces_.push_back(effects::makeCompactMetal(center_m + 0.45 * (u * along + v * up),
                                                    strength_m3 * normal * normal.transpose(), 0.0));
      }
    }
  }
  std::vector<std::unique_ptr<field::CouplingDistortion>> pieces_;
};

Eigen::Vector3d tracked_m(const field::CouplingDistortion& metal, const Eigen::Vector3d& p_true_m) {
  const Eigen::Matrix3d field = field::dipoleField(p_true_m, 1.0) + metal.fieldChange(p_true_m, 1.0, 0.0);
  return field::solvePose(field, 1.0, p_true_m).value().tracker_from_sensor.position_m;
}

/// 6x6x5 true places 0.2 m apart beside the transmitter.
std::vector<Eigen::Vector3d> roomGrid() {
  std::vector<Eigen::Vector3d> places_m;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      for (int k = 0; k < 5; ++k) places_m.emplace_back(0.8 + 0.2 * i, -0.5 + 0.2 * j, -0.4 + 0.2 * k);
  return places_m;
}

/// Truth off by the jig, readings exact.
FitData roomData(const field::CouplingDistortion* metal, double jig_sd_m, unsigned seed) {
  RandomGeometry random(seed);
  FitData data;
  for (const Eigen::Vector3d& p_m : roomGrid()) {
    data.p_tracked_m.push_back(metal == nullptr ? p_m : tracked_m(*metal, p_m));
    data.p_true_m.push_back(p_m + jig_sd_m * Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
    data.node.push_back(static_cast<int>(data.node.size()));
  }
  data.jig_sd_m = jig_sd_m;
  return data;
}

/// True places between those of the grid.
std::vector<Eigen::Vector3d> placesBetween(unsigned seed) {
  RandomGeometry random(seed);
  std::vector<Eigen::Vector3d> places_m(200);
  for (Eigen::Vector3d& p_m : places_m)
    p_m = {random.between(0.8, 1.8), random.between(-0.5, 0.5), random.between(-0.4, 0.4)};
  return places_m;
}

double rms_m(const PositionModel& model, const field::CouplingDistortion& metal,
             const std::vector<Eigen::Vector3d>& places_m) {
  double sum_m2 = 0.0;
  for (const Eigen::Vector3d& p_true_m : places_m) {
    const Eigen::Vector3d p_m = tracked_m(metal, p_true_m);
    sum_m2 += (p_m + model.displacement_m(p_m) - p_true_m).squaredNorm();
  }
  return std::sqrt(sum_m2 / static_cast<double>(places_m.size()));
}

std::size_t sourcesOf(const PositionModel& model) { return model.parameters().at("sources").size(); }

/// Rows of a model of two groups with orthogonal columns of the squared length s; of the rows' values the second
/// group's third column foretells q / s, and nothing the rest, of the squared length 500.
struct TwoGroups {
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(500, 2 * kPerSource);
  Eigen::MatrixXd no_nuisance = Eigen::MatrixXd::Zero(500, 0);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(500);

  TwoGroups(double s, double q) {
    design.topRows(2 * kPerSource).diagonal().setConstant(std::sqrt(s));
    y[kPerSource + 2] = q / std::sqrt(s);
    y[499] = std::sqrt(500.0);
  }
  GroupedSystem system() const { return {design, no_nuisance, y, 1.0}; }
};

}  // namespace

class HarmonicFieldTest : public QObject {
  Q_OBJECT
 private slots:
  void solvesAsTheTrackerDoes();
  void differentiatesTheSolution();
  void invertsTheTracker();
  void followsTheFieldWithASource();
  void followsASourceThatMoves();
  void believesNoShiftFarAboveTheLargestSeen();
  void multipliesSixColumns();
  void addsAGroupByItsEvidence();
  void keepsGroupsChosenBefore();
  void removesWhatMetalDoes();
  void isFarBetterThanASmoothFit();
  void holdsForAPlateToo();
  void seesNoMetalInNoise();
  void knowsItsUncertainty();
  void doesNoHarmToAnotherTracker();
  void goesOnBeyondItsBoxWithoutAKink();
  void hasAPlaceForEveryTrackedPosition();
  void findsThePlaceWhereTheFieldTurns();
  void canBeBaked();
  void isRigidWithoutSources();
  void stops();
};

void HarmonicFieldTest::solvesAsTheTrackerDoes() {
  RandomGeometry random(1);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p_m = random.between(0.3, 3.0) * random.direction();
    const Eigen::Matrix3d field = field::dipoleField(p_m, 1.0) + 0.1 / std::pow(p_m.norm(), 3) * random.matrix();
    const Eigen::Vector3d expected_m = field::solvePose(field, 1.0, p_m).value().tracker_from_sensor.position_m;
    FT_VERIFY_MATCH(near(field::solvedPosition_m(field, p_m), expected_m, 1e-11));
    FT_VERIFY_MATCH(near(field::solvedPosition_m(field, -p_m), Eigen::Vector3d(-expected_m), 1e-11));
  }
}

void HarmonicFieldTest::differentiatesTheSolution() {
  RandomGeometry random(2);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d p_m = random.between(0.5, 2.0) * random.direction();
    const Eigen::Matrix3d field = field::dipoleField(p_m, 1.0) + 0.1 / std::pow(p_m.norm(), 3) * random.matrix();
    const field::PositionDerivative derivative = field::solvedPositionDerivative(field, p_m);
    const double step = 1e-6 * field.norm();
    for (Eigen::Index element = 0; element < 9; ++element) {
      Eigen::Matrix3d change = Eigen::Matrix3d::Zero();
      change(element % 3, element / 3) = step;
      const Eigen::Vector3d expected =
          (field::solvedPosition_m(field + change, p_m) - field::solvedPosition_m(field - change, p_m)) / (2.0 * step);
      FT_VERIFY_MATCH(near(Eigen::Vector3d(derivative.col(element)), expected, 1e-6 * derivative.norm()));
    }
  }
}

void HarmonicFieldTest::invertsTheTracker() {
  RandomGeometry random(3);
  const DisturbedField field(
      {{{2.0, 0.9, 0.1}, 0.0005 * random.matrix()}, {{0.5, -1.2, 0.3}, 0.0005 * random.matrix()}});
  for (const Eigen::Vector3d& p_m : placesBetween(4))
    FT_VERIFY_MATCH(near(field.truePosition_m(field.trackedPosition_m(p_m)), p_m, 1e-9));
}

// Corrected positions against amplitudes, by differences of the whole chain.
void HarmonicFieldTest::followsTheFieldWithASource() {
  RandomGeometry random(5);
  const Eigen::Vector3d at_m(1.4, 1.1, -0.2);
  TensorAmplitudes amplitudes;
  for (Eigen::Index e = 0; e < kPerSource; ++e) amplitudes[e] = 0.01 * random.normal();
  for (const Eigen::Vector3d& p_m : {Eigen::Vector3d(1.5, 0.3, 0.1), Eigen::Vector3d(0.9, -0.4, 0.3)}) {
    const auto corrected_m = [&](Eigen::Index e, double change) {
      TensorAmplitudes changed = amplitudes;
      changed[e] += change;
      return DisturbedField({sourceOf(at_m, changed)}).truePosition_m(p_m);
    };
    const auto effects =
        effectOfSource(PlaceDerivative::of(DisturbedField({sourceOf(at_m, amplitudes)}), p_m), SourceBasis(at_m));
    constexpr double kStep = 1e-5;
    for (Eigen::Index e = 0; e < kPerSource; ++e) {
      const Eigen::Vector3d expected = (corrected_m(e, kStep) - corrected_m(e, -kStep)) / (2.0 * kStep);
      FT_VERIFY_MATCH(near(Eigen::Vector3d(effects.col(e)), expected, 1e-5 * effects.norm()));
    }
  }
}

// And against where the source stands, its tensor kept: the excitation there changes too.
void HarmonicFieldTest::followsASourceThatMoves() {
  RandomGeometry random(8);
  const Eigen::Vector3d at_m(1.4, 1.1, -0.2);
  TensorAmplitudes amplitudes;
  for (Eigen::Index e = 0; e < kPerSource; ++e) amplitudes[e] = 0.01 * random.normal();
  const auto source_at = [&](const Eigen::Vector3d& moved_m) { return sourceOf(moved_m, amplitudes); };
  for (const Eigen::Vector3d& p_m : {Eigen::Vector3d(1.5, 0.3, 0.1), Eigen::Vector3d(0.9, -0.4, 0.3)}) {
    const Eigen::Matrix3d effect =
        effectOfMove(PlaceDerivative::of(DisturbedField({source_at(at_m)}), p_m), ChosenSource(source_at(at_m)));
    constexpr double kStep_m = 1e-4;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d expected = (DisturbedField({source_at(at_m + step_m)}).truePosition_m(p_m) -
                                        DisturbedField({source_at(at_m - step_m)}).truePosition_m(p_m)) /
                                       (2.0 * kStep_m);
      FT_VERIFY_MATCH(near(Eigen::Vector3d(effect.col(axis)), expected, 1e-4 * effect.norm()));
    }
  }
}

// Beyond the places towards the metal the model's sources have poles: no reading is moved by more than twice what the
// worst place was seen to be wrong by, and the stated SD stays of that size.
void HarmonicFieldTest::believesNoShiftFarAboveTheLargestSeen() {
  const auto metal = cabinet();
  const FitData data = roomData(metal.get(), 0.0, 1);
  const auto model = fitPosition("harmonic_field", data);
  FT_VERIFY_OK(model);
  double largest_m = 0.0;
  for (std::size_t i = 0; i < data.size(); ++i)
    largest_m = std::max(largest_m, (data.p_true_m[i] - data.p_tracked_m[i]).norm());
  double most_m = 0.0, most_sd_m = 0.0;
  for (int i = 0; i <= 60; ++i)
    for (int j = 0; j <= 20; ++j) {
      const Eigen::Vector3d p_m(1.7 + 0.01 * i, 0.5 + 0.025 * j, 0.1);
      const Eigen::Vector3d shift_m = (*model)->displacement_m(p_m);
      QVERIFY(shift_m.allFinite());
      most_m = std::max(most_m, shift_m.norm());
      most_sd_m = std::max(most_sd_m, *(*model)->uncertainty_m(p_m));
    }
  QVERIFY2(most_m < 2.1 * largest_m, qPrintable(QString("%1 of %2").arg(most_m).arg(largest_m)));
  QVERIFY2(most_m > largest_m, "the probes must reach where the shift is large");
  QVERIFY(most_sd_m < 3.0 * largest_m);
}

// Against Eigen's product, for counts that fill no register.
void HarmonicFieldTest::multipliesSixColumns() {
  RandomGeometry random(14);
  const auto filled = [&random](Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&random] { return random.normal(); }).eval();
  };
  for (const Eigen::Index rows : {1, 7, 64, 171})
    for (const Eigen::Index count : {1, 2, 5}) {
      const Eigen::MatrixXd six = filled(rows, 6), wide = filled(rows, count);
      Eigen::MatrixXd products(6, count);
      sixColumnsTimes(six.data(), wide.data(), static_cast<std::size_t>(rows), static_cast<std::size_t>(count),
                      products.data());
      FT_VERIFY_MATCH(near(products, Eigen::MatrixXd(six.transpose() * wide), 1e-11));
    }
}

// With six orthogonal columns of squared length s and the pull q on one of them the log evidence at prior variance v is
// -3 log(1 + v s) + v q^2 / (2 (1 + v s)), greatest where 1 + v s = q^2 / (6 s), where it is
// (q^2/s - 6)/2 - 3 log(q^2 / (6 s)): for s = 10 and q^2 = 300 that is 12 - 3 log 5 = 7.1717.
void HarmonicFieldTest::addsAGroupByItsEvidence() {
  const TwoGroups rows(10.0, std::sqrt(300.0));
  const GroupedSystem system = rows.system();
  GroupSelectionOptions options;
  options.least_gain = 7.05;  // The variance is looked for in quarter decades, which costs up to a tenth.
  const GroupSelection chosen = selectGroups(system, options, {});
  QCOMPARE(chosen.groups.size(), std::size_t{1});
  QCOMPARE(chosen.groups.front(), Eigen::Index{1});
  // MacKay's fixed point is the greatest evidence: v = (5 - 1)/10, shrinking q/s by v s / (1 + v s) = 0.8.
  FT_VERIFY_MATCH(near(chosen.prior_variance[0], 0.4, 0.01));
  FT_VERIFY_MATCH(near(chosen.amplitudes[2], 0.8 * std::sqrt(300.0) / 10.0, 0.01));
  options.least_gain = 7.18;
  QVERIFY(selectGroups(system, options, {}).groups.empty());
}

// The same fixed point from elsewhere, though the group would not enter by itself; and no other beside it.
void HarmonicFieldTest::keepsGroupsChosenBefore() {
  const TwoGroups rows(10.0, std::sqrt(300.0));
  const GroupedSystem system = rows.system();
  GroupSelectionOptions options;
  options.least_gain = 7.18;
  options.chosen_variances = {1.0, 0.1};
  const GroupSelection both = selectGroups(system, options, {});
  // The group that the rows do not pull at is left with no variance, and goes.
  QCOMPARE(both.groups, std::vector<Eigen::Index>{1});
  FT_VERIFY_MATCH(near(both.prior_variance[0], 0.4, 0.01));
  options.chosen_variances = {1.0};
  QVERIFY(selectGroups(system, options, {}).groups.empty());
}

// Without noise the sphere's field, off the candidates, is matched until little is left of it.
void HarmonicFieldTest::removesWhatMetalDoes() {
  const auto metal = cabinet();
  const auto model = fitPosition("harmonic_field", roomData(metal.get(), 0.0, 1));
  FT_VERIFY_OK(model);
  const auto nothing = fitPosition("none", roomData(metal.get(), 0.0, 1));
  const double before_m = rms_m(**nothing, *metal, placesBetween(6));
  QVERIFY2(before_m > 0.005, "the metal must matter");
  const double after_m = rms_m(**model, *metal, placesBetween(6));
  QVERIFY2(after_m < 0.02 * before_m, qPrintable(QString("%1 of %2 m left").arg(after_m).arg(before_m)));
}

void HarmonicFieldTest::isFarBetterThanASmoothFit() {
  const auto metal = cabinet();
  for (const unsigned seed : {1U, 2U, 3U}) {
    const FitData data = roomData(metal.get(), 0.005, seed);
    const auto model = fitPosition("harmonic_field", data);
    FT_VERIFY_OK(model);
    const double ours_m = rms_m(**model, *metal, placesBetween(7));
    for (const char* degree : {"2", "3", "4"}) {
      const auto polynomial = fitPosition("polynomial", data, {{"degree", degree}});
      FT_VERIFY_OK(polynomial);
      QVERIFY(ours_m < 0.7 * rms_m(**polynomial, *metal, placesBetween(7)));
    }
  }
}

// Two crossed plates of 200 pieces that each answer along the normal only, none of them where a candidate is: metal
// that few dipoles cannot be.
void HarmonicFieldTest::holdsForAPlateToo() {
  const Plates plates;
  const FitData data = roomData(&plates, 0.003, 4);
  const auto model = fitPosition("harmonic_field", data);
  FT_VERIFY_OK(model);
  const double ours_m = rms_m(**model, plates, placesBetween(11));
  for (const char* degree : {"2", "3", "4"}) {
    const auto polynomial = fitPosition("polynomial", data, {{"degree", degree}});
    FT_VERIFY_OK(polynomial);
    QVERIFY(ours_m < 0.7 * rms_m(**polynomial, plates, placesBetween(11)));
  }
}

// A source must add 6 nats: by the likelihood ratio that is rare among some hundred candidates, not impossible.
void HarmonicFieldTest::seesNoMetalInNoise() {
  int n_seen = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto model = fitPosition("harmonic_field", roomData(nullptr, 0.005, seed));
    FT_VERIFY_OK(model);
    n_seen += sourcesOf(**model) > 0 ? 1 : 0;
    if (sourcesOf(**model) == 0) FT_VERIFY_MATCH(holdsAll((*model)->note(), {"No disturbance"}));
    const auto strict = fitPosition("harmonic_field", roomData(nullptr, 0.005, seed), {{"least_gain", "20"}});
    FT_VERIFY_OK(strict);
    QCOMPARE(sourcesOf(**strict), std::size_t{0});
  }
  QVERIFY2(n_seen <= 1, qPrintable(QString("metal seen in %1 of 5 empty rooms").arg(n_seen)));
}

// The errors of many calibrations of one room against what each says of itself.
void HarmonicFieldTest::knowsItsUncertainty() {
  const auto metal = cabinet();
  double errors_m2 = 0.0;
  double said_m2 = 0.0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const auto model = fitPosition("harmonic_field", roomData(metal.get(), 0.005, seed));
    FT_VERIFY_OK(model);
    errors_m2 += std::pow(rms_m(**model, *metal, placesBetween(8)), 2);
    for (const Eigen::Vector3d& p_true_m : placesBetween(8))
      said_m2 += std::pow((*model)->uncertainty_m(tracked_m(*metal, p_true_m)).value(), 2) / 200.0;
  }
  const double ratio = std::sqrt(errors_m2 / said_m2);
  QVERIFY2(ratio > 0.6 && ratio < 1.8, qPrintable(QString("errors are %1 of what is said").arg(ratio)));
}

// An error that no dipole tracker makes, stronger in every respect than the noise: little may be gained, nothing lost.
void HarmonicFieldTest::doesNoHarmToAnotherTracker() {
  const auto bend_m = [](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(0.01 * std::sin(3.0 * p.y()), 0.01 * std::cos(3.0 * p.z()), 0.01 * std::sin(3.0 * p.x()));
  };
  const FitData data = fitDataOf(roomGrid(), bend_m);
  const auto model = fitPosition("harmonic_field", data);
  const auto rigid = fitPosition("rigid", data);
  FT_VERIFY_OK(model);
  FT_VERIFY_OK(rigid);
  double with_m2 = 0.0;
  double without_m2 = 0.0;
  for (const Eigen::Vector3d& p_m : placesBetween(9)) {
    with_m2 += ((*model)->displacement_m(p_m) - bend_m(p_m)).squaredNorm();
    without_m2 += ((*rigid)->displacement_m(p_m) - bend_m(p_m)).squaredNorm();
  }
  QVERIFY2(with_m2 < 1.1 * without_m2, qPrintable(QString("%1 of it left").arg(std::sqrt(with_m2 / without_m2))));
}

// Walks in tracked space through faces, edges and corners of the measured box and on, to a box's length away: where a
// correction has a continuous slope, its second difference is of the order of the squared step. With steps of 2 mm and
// a curvature below 5 per m that is 20 um; a kink of 0.1 gives 200 um.
void HarmonicFieldTest::goesOnBeyondItsBoxWithoutAKink() {
  const auto model = fitPosition("harmonic_field", roomData(cabinet().get(), 0.001, 3));
  FT_VERIFY_OK(model);
  constexpr double kStep_m = 2e-3;
  double largest_slope = 0.0;
  double largest_bend_m = 0.0;
  RandomGeometry random(12);
  for (int walk = 0; walk < 60; ++walk) {
    const Eigen::Vector3d from_m(random.between(0.3, 2.3), random.between(-1.0, 1.0), random.between(-0.9, 0.9));
    const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(walk % 3);
    Eigen::Vector3d before_m = (*model)->displacement_m(from_m - step_m);
    Eigen::Vector3d here_m = (*model)->displacement_m(from_m);
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector3d next_m = (*model)->displacement_m(from_m + (i + 1) * step_m);
      largest_slope = std::max(largest_slope, (next_m - here_m).norm() / kStep_m);
      largest_bend_m = std::max(largest_bend_m, (next_m - 2.0 * here_m + before_m).norm());
      before_m = here_m;
      here_m = next_m;
    }
  }
  QVERIFY(largest_slope > 0.1);  // There is something to have a kink.
  QVERIFY2(largest_bend_m < 30e-6, qPrintable(QString("bends by %1 um").arg(1e6 * largest_bend_m)));
}

// A source beside the box, so strong that the field folds back on the way there: inside the box the place is the
// field's own, to the bit; beyond it what the tracker errs by is what it errs by at the place held at the box, and
// every tracked position, wherever it is, has a place that would be tracked there.
void HarmonicFieldTest::hasAPlaceForEveryTrackedPosition() {
  const FieldSource source{{1.3, 0.0, 0.75}, 0.002 * Eigen::Matrix3d::Identity()};
  const HeldField field(DisturbedField({source}), SoftBox{{0.8, -0.5, -0.4}, {1.8, 0.5, 0.4}, 0.02});
  RandomGeometry random(13);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d p_m(random.between(0.81, 1.79), random.between(-0.49, 0.49), random.between(-0.39, 0.39));
    FT_VERIFY_MATCH(near(field.trackedPosition_m(p_m), field.field().trackedPosition_m(p_m), 0.0));
  }
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d p_m(random.between(0.0, 2.6), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
    const Eigen::Vector3d held_m = field.box().held_m(p_m);
    FT_VERIFY_MATCH(near(field.trackedPosition_m(p_m) - p_m, field.field().trackedPosition_m(held_m) - held_m, 1e-12));
    const Eigen::Vector3d true_m = field.truePosition_m(p_m);
    FT_VERIFY_MATCH(near(field.trackedPosition_m(true_m), p_m, 1e-9));
  }
}

// A strong source above the box's end, near which the field turns, so that steps straight from the tracked position go
// astray: every tracked position of a place in the box has one that is tracked there, to what is called found.
void HarmonicFieldTest::findsThePlaceWhereTheFieldTurns() {
  const FieldSource source{{1.8, 0.0, 0.6}, 0.03 * Eigen::Matrix3d::Identity()};
  const HeldField field(DisturbedField({source}), SoftBox{{0.8, -0.5, -0.4}, {1.8, 0.5, 0.4}, 0.02});
  RandomGeometry random(14);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d p_m(random.between(0.8, 1.8), random.between(-0.5, 0.5), random.between(-0.4, 0.4));
    const Eigen::Vector3d tracked_m = field.trackedPosition_m(p_m);
    FT_VERIFY_MATCH(near(field.trackedPosition_m(field.truePosition_m(tracked_m)), tracked_m, 5e-6));
  }
}

// A correction that a lattice can follow to 0.05 mm has no jump in the region and its margin. The floor of metal bends
// the tracked box so much that its corners stand far beyond the places.
void HarmonicFieldTest::canBeBaked() {
  const auto metal = effects::makeCompactMetal(
      {1.3, 0.0, -1.3}, effects::spherePolarizability_m3(0.55, false, 1.0) * Eigen::Matrix3d::Identity(), 0.55);
  const FitData data = roomData(metal.get(), 0.002, 2);
  const auto model = fitPosition("harmonic_field", data);
  FT_VERIFY_OK(model);
  const Region region = Region::around(data.p_tracked_m, 3, 0.05);
  FT_VERIFY_OK(bakeLattice(**model, region, data.p_tracked_m, 50e-6, {}));
}

void HarmonicFieldTest::isRigidWithoutSources() {
  const auto metal = cabinet();
  const FitData data = roomData(metal.get(), 0.005, 1);
  const auto model = fitPosition("harmonic_field", data, {{"most_sources", "0"}});
  const auto rigid = fitPosition("rigid", data);
  FT_VERIFY_OK(model);
  FT_VERIFY_OK(rigid);
  QCOMPARE(sourcesOf(**model), std::size_t{0});
  for (const Eigen::Vector3d& p_m : placesBetween(10))
    FT_VERIFY_MATCH(near((*model)->displacement_m(p_m), (*rigid)->displacement_m(p_m), 1e-6));
}

void HarmonicFieldTest::stops() {
  std::stop_source source;
  source.request_stop();
  RunControl control;
  control.stop = source.get_token();
  const PositionMethod& method = *findPositionMethod("harmonic_field").value();
  const auto model = method.fit(roomData(nullptr, 0.005, 1), settingsOf(method), control);
  QVERIFY(!model && model.error().code == ErrorCode::kCancelled);
}

FIELDTRUE_TEST(HarmonicFieldTest)
#include "harmonic_field_test.moc"
