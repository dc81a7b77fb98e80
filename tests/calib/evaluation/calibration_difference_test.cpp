#include "calib/evaluation/calibration_difference.h"

#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "calib/calibration/alignment.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

/// 6 x 6 x 6 places around the origin, 0.2 m apart, read exactly where they are, in the tracker's own frame.
CalibrationTable exactTable() {
  SyntheticOptions options;
  options.counts = {6, 6, 6};
  options.pitch_m = Eigen::Vector3d::Constant(0.2);
  options.origin_m = Eigen::Vector3d::Constant(-0.5);
  CalibrationTable table = syntheticTable(options);
  table.metadata.alignment_known = true;
  for (Node& node : table.nodes) node.tracker_from_sensor = node.reference_from_sensor;
  return table;
}

calibration::Corrector fittedBoth(const CalibrationTable& table, const char* method, const char* orientation) {
  auto corrector = calibration::Corrector::fit(table.nodes, table.metadata,
                                               calibration::parseCorrectorChoice(method, orientation).value(),
                                               calibration::defaultAlignMode(table.metadata));
  if (!corrector) qFatal("%s", corrector.error().message.c_str());
  return *corrector;
}

calibration::Corrector fitted(const CalibrationTable& table, const char* method) {
  return fittedBoth(table, method, "none");
}

/// Unit vectors along which the sensor's own x axis points, as it is held.
const std::vector<Eigen::Vector3d> kAlongAxes = {Eigen::Vector3d::UnitX(),  Eigen::Vector3d::UnitY(),
                                                 Eigen::Vector3d::UnitZ(),  -Eigen::Vector3d::UnitX(),
                                                 -Eigen::Vector3d::UnitY(), -Eigen::Vector3d::UnitZ()};

/// 3 x 3 x 3 places, at each the sensor held in all of some ways; it is read at its case's middle, but stands so far
/// along its own x axis.
CalibrationTable leveredTable(double lever_m, const std::vector<Eigen::Vector3d>& along = kAlongAxes) {
  CalibrationTable all = exactTable(), table = all;
  table.nodes.clear();
  for (const Node& node : all.nodes) {
    const auto& index = *node.index;
    if (std::any_of(index.begin(), index.end(), [](int i) { return i % 2 != 0; })) continue;
    for (std::size_t k = 0; k < along.size(); ++k) {
      Node held = node;
      held.visit = static_cast<int>(k);
      held.tracker_from_sensor.orientation =
          Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), along[k]).normalized();
      held.reference_from_sensor = held.tracker_from_sensor;
      held.reference_from_sensor.position_m += lever_m * along[k];
      table.nodes.push_back(held);
    }
  }
  return table;
}

constexpr const char* kOfPose = "gaussian_process:inputs=pose,sensor_coils=none";

/// Independent Gaussian placing errors, 1 mm SD an axis.
CalibrationTable placedLoosely(CalibrationTable table, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> error_m(0.0, 0.001);
  for (Node& node : table.nodes)
    for (double& coordinate : node.reference_from_sensor.position_m) coordinate += error_m(random);
  return table;
}

}  // namespace

class CalibrationDifferenceTest : public QObject {
  Q_OBJECT
 private slots:
  void aStretchIsWhatItIs() {
    // The second corrects by 1 % of the distance from the origin. Over a cube of side 1 m the mean square distance is
    // 3/12 m^2, so the RMS change is 5 mm; its farthest point is a corner, sqrt(3)/2 m away, 8.66 mm, and a margin
    // more.
    CalibrationTable stretched = exactTable();
    for (Node& node : stretched.nodes) node.reference_from_sensor.position_m *= 1.01;
    const auto difference = compareCalibrations(fitted(exactTable(), "none"), fitted(stretched, "polynomial:degree=1"));
    FT_VERIFY_OK(difference);
    QVERIFY(difference->n_points > 1000);
    FT_VERIFY_MATCH(near(difference->rms_mm, 5.0, 0.15));
    const calibration::Corrector unchanged = fitted(exactTable(), "none");
    double corner_m = 0.5;
    while (unchanged.covers(Eigen::Vector3d::Constant(corner_m + 1e-4))) corner_m += 1e-4;
    QVERIFY(corner_m < 0.6);
    FT_VERIFY_MATCH(near(difference->max_mm, 10.0 * std::sqrt(3.0) * corner_m, 0.05));
    FT_VERIFY_MATCH(near(difference->whole_max_mm, difference->max_mm, 0.05));
    QCOMPARE(difference->worst, difference->n_points);
    FT_VERIFY_MATCH(near(difference->moved_mm, 0.0, 0.01));
    FT_VERIFY_MATCH(near(difference->turned_deg, 0.0, 1e-6));
    const ChangeAt& worst = difference->points[difference->worst];
    FT_VERIFY_MATCH(near((worst.change_m - 0.01 * worst.reference_m).norm(), 0.0, 1e-9));
    // The first leaves each place of the second where it was read: 1 % of its distance, refitted by no rotation.
    double squares_mm2 = 0.0;
    for (const Node& node : exactTable().nodes)
      squares_mm2 += 100.0 * node.reference_from_sensor.position_m.squaredNorm();
    FT_VERIFY_MATCH(near(difference->first_at_second.rms_mm, std::sqrt(squares_mm2 / 216.0), 1e-6));
    QVERIFY(difference->verdict == DifferenceVerdict::kChanged);
  }

  void aMotionOfTheRigIsNoChangeOfTheField() {
    CalibrationTable moved = exactTable();
    const Pose motion{{0.3, -0.2, 0.1}, Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()))};
    moved.metadata.alignment_known = false;
    for (Node& node : moved.nodes) node.reference_from_sensor = motion * node.reference_from_sensor;
    const auto difference = compareCalibrations(fitted(exactTable(), "none"), fitted(moved, "none"));
    FT_VERIFY_OK(difference);
    FT_VERIFY_MATCH(near(difference->rms_mm, 0.0, 1e-6));
    // At the middle, the origin, the motion is its translation.
    FT_VERIFY_MATCH(near(difference->moved_mm, 1000.0 * std::sqrt(0.14), 0.5));
    FT_VERIFY_MATCH(near(difference->turned_deg, 0.2 * 180.0 / 3.14159265358979, 1e-6));
    FT_VERIFY_MATCH(near(difference->first_at_second.rms_mm, 0.0, 1e-6));
    // Corrected orientations turn with the rig: that is told, and is no difference between them.
    QVERIFY(!difference->angle_shared_deg);
    const auto turned =
        compareCalibrations(fittedBoth(exactTable(), "none", "rigid"), fittedBoth(moved, "none", "rigid"));
    FT_VERIFY_OK(turned);
    FT_VERIFY_MATCH(near(turned->angle_rms_deg.value(), 0.0, 1e-6));
    FT_VERIFY_MATCH(near(turned->angle_shared_deg.value(), 0.2 * 180.0 / 3.14159265358979, 1e-5));
  }

  void whatTurnsWithTheSensorIsSeenInEveryOrientation() {
    // Levers of 5 mm to either side: 10 mm apart wherever the sensor points, nothing in the mean over all six ways.
    const auto first = fitted(leveredTable(-0.005), kOfPose), second = fitted(leveredTable(0.005), kOfPose);
    QVERIFY(first.takesOrientation() && second.takesOrientation());
    const auto difference = compareCalibrations(first, second);
    FT_VERIFY_OK(difference);
    QCOMPARE(difference->n_orientations, std::size_t(6));
    FT_VERIFY_MATCH(near(difference->rms_mm, 10.0, 0.5));
    FT_VERIFY_MATCH(near(difference->max_mm, 10.0, 1.0));
    QCOMPARE(difference->points.size(), difference->n_points + 1);
    const ChangeAt& worst = difference->points[difference->worst];
    FT_VERIFY_MATCH(near((worst.change_m - 0.01 * (*worst.held * Eigen::Vector3d::UnitX())).norm(), 0.0, 0.001));
    FT_VERIFY_MATCH(holdsAll(difference->text, {"in 6 orientations that both were fitted on", "held as (w "}));
    const auto json = toJson(*difference);
    QCOMPARE(json.at("orientations").get<int>(), 6);
    QCOMPARE(json.at("orientations_of").get<std::string>(), std::string("both"));
    QCOMPARE(json.at("field").at("max_at_wxyz").size(), std::size_t(4));
    // What each states of itself is of a sensor that is held; of any way it is held in it would hold the levers too.
    QVERIFY(*difference->expected_mm < 2.0);
    // One that stands for one orientation, which is one of the other's.
    const auto from_none = compareCalibrations(fitted(exactTable(), "none"), second);
    FT_VERIFY_OK(from_none);
    QCOMPARE(from_none->n_orientations, std::size_t(1));
  }

  void orientationsThatOnlyOneWasFittedOnStandInWhereTheyShareNone() {
    std::vector<Eigen::Vector3d> along = kAlongAxes;
    for (Eigen::Vector3d& axis : along) axis = Eigen::Quaterniond(0.8, 0.4, 0.4, 0.2).normalized() * axis;
    along.push_back(Eigen::Vector3d::Ones().normalized());
    const auto difference =
        compareCalibrations(fitted(leveredTable(0.005), "none"), fitted(leveredTable(0.005, along), kOfPose));
    FT_VERIFY_OK(difference);
    // Thirteen, of which twelve are taken.
    QCOMPARE(difference->n_orientations, std::size_t(12));
    FT_VERIFY_MATCH(holdsAll(difference->text, {"in 12 orientations that either was fitted on"}));
  }

  void aMountingTurnedIsNoChangeOfOrientations() {
    CalibrationTable remounted = leveredTable(0.005);
    const Eigen::Quaterniond mounting(Eigen::AngleAxisd(0.2, Eigen::Vector3d(1.0, 2.0, 2.0).normalized()));
    const Eigen::Quaterniond rig(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()));
    remounted.metadata.alignment_known = false;
    for (Node& node : remounted.nodes) {
      Pose& pose = node.reference_from_sensor;
      pose = {rig * pose.position_m, rig * pose.orientation * mounting};
    }
    const auto difference =
        compareCalibrations(fittedBoth(leveredTable(0.005), kOfPose, "rigid"), fittedBoth(remounted, kOfPose, "rigid"));
    FT_VERIFY_OK(difference);
    FT_VERIFY_MATCH(near(difference->rms_mm, 0.0, 0.1));
    FT_VERIFY_MATCH(near(difference->angle_rms_deg.value(), 0.0, 0.01));
    QVERIFY(*difference->angle_shared_deg > 10.0);
  }

  void placingErrorsAloneAreNoChange() {
    int n_changed = 0;
    for (const unsigned seed : {1U, 3U, 5U, 7U, 9U, 11U, 13U, 15U, 17U, 19U}) {
      const auto difference = compareCalibrations(fitted(placedLoosely(exactTable(), seed), "polynomial:degree=2"),
                                                  fitted(placedLoosely(exactTable(), seed + 1), "polynomial:degree=2"));
      FT_VERIFY_OK(difference);
      if (difference->verdict == DifferenceVerdict::kChanged) ++n_changed;
      FT_VERIFY_MATCH(holdsAll(difference->text, {"No change is shown"}));
    }
    QCOMPARE(n_changed, 0);
  }

  void aBumpIsFoundWhereItIs() {
    // 20 mm at (0.3, 0.3, 0.3), falling off over 0.25 m.
    const Eigen::Vector3d center_m = Eigen::Vector3d::Constant(0.3);
    CalibrationTable bumped = exactTable();
    for (Node& node : bumped.nodes) {
      Eigen::Vector3d& p_m = node.reference_from_sensor.position_m;
      p_m.z() += 0.02 * std::exp(-(p_m - center_m).squaredNorm() / (0.25 * 0.25));
    }
    const auto difference =
        compareCalibrations(fitted(placedLoosely(exactTable(), 1), "rbf"), fitted(placedLoosely(bumped, 2), "rbf"));
    FT_VERIFY_OK(difference);
    QVERIFY(difference->verdict == DifferenceVerdict::kChanged);
    QVERIFY((difference->points[difference->worst].reference_m - center_m).norm() < 0.2);
    FT_VERIFY_MATCH(holdsAll(difference->text, {"changed between the two recordings"}));
  }

  void fewPlacesInCommonTellNothing() {
    CalibrationTable corner = exactTable();
    std::erase_if(corner.nodes,
                  [](const Node& node) { return (node.reference_from_sensor.position_m.array() < 0.25).any(); });
    CalibrationTable few = exactTable();
    std::erase_if(few.nodes,
                  [](const Node& node) { return (node.reference_from_sensor.position_m.array() > 0.35).any(); });
    const auto difference = compareCalibrations(fitted(few, "none"), fitted(corner, "none"));
    FT_VERIFY_OK(difference);
    QVERIFY(difference->verdict == DifferenceVerdict::kCannotTell);
    QVERIFY(toJson(*difference).at("first_at_second").is_null());
  }

  void tooFewToBeJudgedAreToldSo() {
    CalibrationTable few = exactTable();
    // Three corners: without one of them nothing can be aligned.
    std::erase_if(few.nodes, [](const Node& node) {
      const auto& index = *node.index;
      return index != std::array{0, 0, 0} && index != std::array{5, 0, 0} && index != std::array{0, 5, 0};
    });
    few.metadata.alignment_known = false;
    const auto difference = compareCalibrations(fitted(few, "none"), fitted(exactTable(), "none"));
    FT_VERIFY_OK(difference);
    QVERIFY(difference->verdict == DifferenceVerdict::kCannotTell);
    QVERIFY(toJson(*difference).at("field").at("rms_mm").get<double>() < 1e-6);
  }

  void nothingInCommonIsRefused() {
    CalibrationTable elsewhere = exactTable();
    for (Node& node : elsewhere.nodes) {
      node.tracker_from_sensor.position_m.x() += 5.0;
      node.reference_from_sensor.position_m.x() += 5.0;
    }
    const auto difference = compareCalibrations(fitted(exactTable(), "none"), fitted(elsewhere, "none"));
    QVERIFY(!difference);
    FT_VERIFY_MATCH(holdsAll(difference.error().message, {"no reading in common"}));
  }

  void setUpsAreHeldAgainstEachOther() {
    CalibrationTable first = exactTable(), second = exactTable();
    first.metadata.setup = {{"room", "A"}};
    first.metadata.date = "2026-01-02";
    second.metadata.setup = {{"room", "B"}};
    second.metadata.date = "2026-03-04";
    const auto difference = compareCalibrations(fitted(first, "none"), fitted(second, "none"));
    FT_VERIFY_OK(difference);
    FT_VERIFY_MATCH(holdsAll(difference->text, {"different set-ups", "room 'B' instead of 'A'"}));
    const auto json = toJson(*difference);
    QCOMPARE(json.at("setup_matches").get<std::string>(), std::string("no"));
    QCOMPARE(json.at("setup_differences").size(), std::size_t(2));
  }
};

FIELDTRUE_TEST(CalibrationDifferenceTest)
#include "calibration_difference_test.moc"
