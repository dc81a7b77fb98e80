#include <QTest>

#include "acquisition/emulators/simulated_jig.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

const Pose kRest{{0.3, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
const Pose kPlace{{0.6, 0.3, -0.1}, rotationFromEuler(Eigen::Vector3d(0.4, 0.1, -0.2))};

VirtualOperator exact(double travel_s) {
  OperatorHabits habits;
  habits.travel_s = travel_s;
  return VirtualOperator(simulation::RigModel{}, habits, kRest, 1);
}

}  // namespace

class VirtualOperatorTest : public QObject {
  Q_OBJECT
 private slots:
  void restsUntilGuided();
  void arrivesAndStandsStill();
  void tremblesOnTheWay();
  void neverJumps();
  void placesWithTheRigsTolerance();
  void repeatedCallsOnTheWayChangeNothing();
  void setsDownAnewOnTheSamePlace();
  void travelsAtOnceWhenAsked();
};

void VirtualOperatorTest::restsUntilGuided() {
  const auto person = exact(1.0);
  QVERIFY(person.standing(0.0));
  FT_VERIFY_MATCH(sameBits(person.poseAt(12.3).position_m.x(), 0.3));
}

void VirtualOperatorTest::arrivesAndStandsStill() {
  auto person = exact(1.0);
  person.guideTo(kPlace, 10.0);
  QVERIFY(!person.standing(10.5));
  QVERIFY(!person.standing(11.1));
  QVERIFY(person.standing(12.5));
  FT_VERIFY_MATCH(near(person.poseAt(12.5), kPlace, 1e-12, 1e-9));
  FT_VERIFY_MATCH(sameBits(person.poseAt(13.0), person.poseAt(20.0)));
  // Half the way at half the time, within the tremor.
  FT_VERIFY_MATCH(near(person.poseAt(10.5).position_m, 0.5 * (kRest.position_m + kPlace.position_m), 0.02));
}

void VirtualOperatorTest::tremblesOnTheWay() {
  auto person = exact(1.0);
  person.guideTo(kPlace, 0.0);
  double early_m = 0.0, late_m = 0.0;
  for (int step = 0; step < 40; ++step) {
    const double t = 1.0 + 0.005 * step;
    early_m = std::max(early_m, (person.poseAt(t).position_m - kPlace.position_m).norm());
    late_m = std::max(late_m, (person.poseAt(t + 0.6).position_m - kPlace.position_m).norm());
  }
  QVERIFY(early_m > 0.002);
  QVERIFY(late_m < 0.0003);
}

void VirtualOperatorTest::neverJumps() {
  auto person = exact(1.0);
  Pose last = person.poseAt(0.0);
  for (int i = 1; i < 6000; ++i) {
    const double t = i * 0.001;
    if (i == 500 || i == 1100 || i == 3000) person.guideTo(i == 1100 ? kRest : kPlace, t);
    const Pose now = person.poseAt(t);
    QVERIFY((now.position_m - last.position_m).norm() < 0.01);
    QVERIFY(angleBetween_rad(now.orientation, last.orientation) < 0.02);
    last = now;
  }
}

void VirtualOperatorTest::placesWithTheRigsTolerance() {
  OperatorHabits habits;
  habits.travel_s = 0.0;
  simulation::RigModel rig;
  rig.tolerance_m = 0.002;
  rig.tolerance_rad = 0.01;
  VirtualOperator person(rig, habits, kRest, 5);
  Eigen::Vector3d sum_m = Eigen::Vector3d::Zero(), squares_m2 = sum_m, squares_rad2 = sum_m;
  constexpr int kTimes = 2000;
  for (int i = 0; i < kTimes; ++i) {
    const double t = 10.0 * i;
    person.guideTo(i % 2 ? kPlace : kRest, t);
    const Pose& place = i % 2 ? kPlace : kRest;
    const Pose pose = person.poseAt(t + 9.0);
    const Eigen::Vector3d offset_m = pose.position_m - place.position_m;
    sum_m += offset_m;
    squares_m2 += offset_m.cwiseAbs2();
    squares_rad2 += rotationVector_rad(place.orientation.conjugate() * pose.orientation).cwiseAbs2();
  }
  for (int axis = 0; axis < 3; ++axis) {
    // Four standard errors: of a mean sd/sqrt(n), of an SD sd/sqrt(2n).
    FT_VERIFY_MATCH(near(sum_m[axis] / kTimes, 0.0, 4.0 * 0.002 / std::sqrt(kTimes)));
    FT_VERIFY_MATCH(near(std::sqrt(squares_m2[axis] / kTimes), 0.002, 4.0 * 0.002 / std::sqrt(2.0 * kTimes)));
    FT_VERIFY_MATCH(near(std::sqrt(squares_rad2[axis] / kTimes), 0.01, 4.0 * 0.01 / std::sqrt(2.0 * kTimes)));
  }
}

void VirtualOperatorTest::repeatedCallsOnTheWayChangeNothing() {
  auto once = exact(1.0), often = exact(1.0);
  once.guideTo(kPlace, 1.0);
  for (int tenth = 10; tenth < 19; ++tenth) often.guideTo(kPlace, 0.1 * tenth);
  FT_VERIFY_MATCH(sameBits(once.poseAt(1.7), often.poseAt(1.7)));
}

void VirtualOperatorTest::setsDownAnewOnTheSamePlace() {
  simulation::RigModel rig;
  rig.tolerance_m = 0.001;
  VirtualOperator person(rig, OperatorHabits{}, kRest, 2);
  person.guideTo(kPlace, 0.0);
  const Pose first = person.poseAt(5.0);
  person.guideTo(kPlace, 10.0);
  QVERIFY(person.poseAt(10.5).position_m.z() > first.position_m.z() + 0.02);
  const Pose second = person.poseAt(15.0);
  QVERIFY((second.position_m - first.position_m).norm() > 1e-5);
  FT_VERIFY_MATCH(near(second.position_m, kPlace.position_m, 0.006));
}

void VirtualOperatorTest::travelsAtOnceWhenAsked() {
  auto person = exact(0.0);
  person.guideTo(kPlace, 3.0);
  FT_VERIFY_MATCH(near(person.poseAt(3.0).position_m, kPlace.position_m, 0.02));
  FT_VERIFY_MATCH(near(person.poseAt(5.0), kPlace, 1e-12, 1e-9));
}

FIELDTRUE_TEST(VirtualOperatorTest)
#include "virtual_operator_test.moc"
