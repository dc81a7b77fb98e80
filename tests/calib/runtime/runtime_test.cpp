#include <QTest>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "calib/calibration/corrector.h"
#include "calib/core/units.h"
#include "calib/correctors/readers.h"
#include "calib/correctors/registry.h"
#include "calib/runtime/fieldtrue_runtime.hpp"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::calibration;
using namespace fieldtrue::testing;
using fieldtrue_runtime::Calibration;

namespace {
std::atomic<std::size_t> n_allocations{0};
}  // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// Counts what the whole program allocates: Eigen's memory, and what `new` takes, come from here.
// NOLINTNEXTLINE(bugprone-reserved-identifier): glibc's own, by which malloc may be replaced.
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  n_allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
#define FT_COUNTS_ALLOCATIONS true
#else
#define FT_COUNTS_ALLOCATIONS false
#endif

namespace {

constexpr std::size_t kPoses = 600;

/// @param position its method: two need a grid along the tracker's axes
CalibrationTable bentTable(int orientations = 1, const QString& position = {}) {
  SyntheticOptions options;
  const bool is_grid = position == "trilinear" || position == "local_briggs";
  if (!is_grid) options.reference_from_tracker = {{0.5, -0.2, 1.1}, rotationFromVector({0.3, -0.8, 1.7})};
  options.smooth_distortion_m = is_grid ? 0.002 : 0.02;
  options.orientation_error_rad = 0.05;
  options.orientations = orientations;
  SyntheticNoise noise;
  noise.position_sd_m = 1e-4;
  return syntheticTable(options, noise);
}

Corrector fitted(const CalibrationTable& table, const std::string& position, const std::string& orientation) {
  const CorrectorChoice choice = parseCorrectorChoice(position, orientation).value();
  auto corrector = Corrector::fit(table.nodes, table.metadata, choice, AlignMode::kRigid);
  if (!corrector) qFatal("%s", corrector.error().message.c_str());
  return *std::move(corrector);
}

/// A second sensor of another gain, and what each has of its own.
Corrector fittedApart() {
  CalibrationTable table = bentTable();
  std::vector<Node> second = table.nodes;
  for (Node& node : second) {
    node.sensor = 3;
    node.tracker_from_sensor.position_m *= 1.02;
  }
  table.nodes.insert(table.nodes.end(), second.begin(), second.end());
  CorrectorChoice choice = parseCorrectorChoice("polynomial:degree=3", "polynomial_quaternion").value();
  choice.separate_position = choice.separate_orientation = true;
  auto corrector = Corrector::fit(table.nodes, table.metadata, choice, AlignMode::kRigid);
  if (!corrector) qFatal("%s", corrector.error().message.c_str());
  return *std::move(corrector);
}

/// Inside, at the edge and outside.
std::vector<Pose> somePoses(const CalibrationTable& table, std::size_t n = kPoses) {
  std::mt19937 random(5);
  std::uniform_int_distribution<std::size_t> row(0, table.nodes.size() - 1);
  std::normal_distribution<double> step_m(0.0, 0.08);
  std::vector<Pose> poses(n);
  for (Pose& pose : poses) {
    pose = table.nodes[row(random)].tracker_from_sensor;
    pose.position_m += Eigen::Vector3d(step_m(random), step_m(random), step_m(random));
    pose.orientation = (pose.orientation * rotationFromVector({step_m(random), 0.1, step_m(random)})).normalized();
  }
  return poses;
}

std::vector<fieldtrue_pose> inC(const std::vector<Pose>& poses) {
  std::vector<fieldtrue_pose> c(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Eigen::Vector3d::Map(c[i].position_m) = poses[i].position_m;
    const Eigen::Quaterniond& q = poses[i].orientation;
    const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
    std::copy(wxyz, wxyz + 4, c[i].orientation_wxyz);
  }
  return c;
}

Pose outOfC(const fieldtrue_pose& c) {
  const double* q = c.orientation_wxyz;
  return {Eigen::Vector3d::Map(c.position_m), Eigen::Quaterniond(q[0], q[1], q[2], q[3])};
}

Calibration loaded(const Corrector& corrector) { return Calibration::fromMemory(corrector.toText(), "test"); }

struct Worst {
  double position_m = 0.0;
  double angle_rad = 0.0;
};

/// How far two corrections of poses inside the region are from each other.
Worst differenceInside(const Calibration& a, const Calibration& b, const std::vector<fieldtrue_pose>& poses) {
  Worst worst;
  const auto of_a = a.correct(poses), of_b = b.correct(poses);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!a.isInside(poses[i])) continue;
    const Pose pose_a = outOfC(of_a[i]), pose_b = outOfC(of_b[i]);
    worst.position_m = std::max(worst.position_m, (pose_a.position_m - pose_b.position_m).norm());
    worst.angle_rad = std::max(worst.angle_rad, angleBetween_rad(pose_a.orientation, pose_b.orientation));
  }
  return worst;
}

}  // namespace

class RuntimeTest : public QObject {
  Q_OBJECT
 private slots:
  void everyMethodHasItsReader() {
    for (const auto& method : correctors::positionMethods())
      QVERIFY2(correctors::findPositionReader(method.id).value() == method.read, method.id.c_str());
    for (const auto& method : correctors::orientationMethods())
      QVERIFY2(correctors::findOrientationReader(method.id).value() == method.read, method.id.c_str());
    QVERIFY(!correctors::findPositionReader("nothing"));
  }

  void eachSensorHasItsCorrection() {
    const Corrector program = fittedApart();
    const Calibration runtime = loaded(program);
    const std::vector<Pose> poses = somePoses(program.table());
    const auto tracked = inC(poses);
    for (const int sensor : {0, 3}) {
      const auto of_runtime = runtime.correct(tracked, sensor);
      const Calibration alone = runtime.ofSensor(sensor);
      for (std::size_t i = 0; i < poses.size(); ++i) {
        const Pose of_program = program.correct(poses[i], sensor);
        FT_VERIFY_MATCH(near(outOfC(of_runtime[i]), of_program, 1e-15, 1e-12));
        FT_VERIFY_MATCH(near(outOfC(alone.correct(tracked[i])), of_program, 1e-15, 1e-12));
        QCOMPARE(alone.isInside(tracked[i]), program.covers(poses[i].position_m, sensor));
      }
      const Worst worst = differenceInside(alone, runtime.baked(50.0, 0.01).ofSensor(sensor), tracked);
      QVERIFY2(worst.position_m < 50e-6, qPrintable(QString::number(worst.position_m)));
    }
    QVERIFY_EXCEPTION_THROWN(runtime.ofSensor(1), fieldtrue_runtime::Failure);
  }

  void correctsToTheBitsOfTheProgram_data() {
    QTest::addColumn<QString>("position");
    QTest::addColumn<QString>("orientation");
    for (const auto& method : correctors::positionMethods())
      if (method.id != "auto") QTest::newRow(method.id.c_str()) << QString::fromStdString(method.id) << "none";
    for (const auto& method : correctors::orientationMethods())
      QTest::newRow(("turn: " + method.id).c_str()) << "affine" << QString::fromStdString(method.id);
  }

  void correctsToTheBitsOfTheProgram() {
    QFETCH(const QString, position);
    QFETCH(const QString, orientation);
    const CalibrationTable table = bentTable(1, position);
    const Corrector corrector = fitted(table, position.toStdString(), orientation.toStdString());
    const Calibration calibration = loaded(corrector);
    const std::vector<Pose> poses = somePoses(table);
    const auto c = inC(poses);
    std::vector<Pose> given(poses.size()), expected(poses.size());
    for (std::size_t i = 0; i < c.size(); ++i)  // As a table of unit quaternions is read.
      given[i] = {poses[i].position_m, outOfC(c[i]).orientation.normalized()};
    corrector.correct(given, expected);
    std::vector<fieldtrue_pose> seen(c.size());
    const std::size_t before = n_allocations;
    fieldtrue_correct_many(calibration.get(), FIELDTRUE_FIRST_SENSOR, c.data(), seen.data(), c.size());
    const std::size_t n_batch = n_allocations - before;
    if (FT_COUNTS_ALLOCATIONS) QCOMPARE(n_batch, std::size_t{0});
    std::vector<double> positions_m;
    for (const fieldtrue_pose& pose : c) positions_m.insert(positions_m.end(), pose.position_m, pose.position_m + 3);
    const std::size_t before_positions = n_allocations;
    fieldtrue_correct_positions(calibration.get(), positions_m.data(), positions_m.data(), c.size());
    if (FT_COUNTS_ALLOCATIONS) QCOMPARE(n_allocations - before_positions, std::size_t{0});
    for (std::size_t i = 0; i < poses.size(); ++i) {
      QVERIFY2(Eigen::Vector3d::Map(&positions_m[3 * i]) == expected[i].position_m, std::to_string(i).c_str());
      const Pose got = outOfC(seen[i]);
      QVERIFY2((got.position_m == expected[i].position_m), std::to_string(i).c_str());
      QVERIFY2((got.orientation.coeffs() == canonical(expected[i].orientation).coeffs()), std::to_string(i).c_str());
      QCOMPARE(calibration.isInside(c[i]), corrector.covers(poses[i].position_m));
      const Pose alone = outOfC(calibration.correct(c[i]));
      QVERIFY2((alone.position_m - got.position_m).norm() < 1e-12, std::to_string(i).c_str());
      const auto known_m = corrector.uncertaintyAt_m(given[i]);
      const double told_m = calibration.uncertainty_m(c[i]);
      QCOMPARE(std::isnan(told_m), !known_m.has_value());
      if (known_m) QVERIFY2(std::abs(told_m - *known_m) < 1e-7 * *known_m + 1e-12, std::to_string(i).c_str());
    }
  }

  void whatIsBakedStaysWithinItsBounds_data() {
    QTest::addColumn<QString>("position");
    QTest::addColumn<QString>("orientation");
    for (const char* position : {"none", "rigid", "affine", "trilinear", "tetrahedral", "polynomial", "neural_network",
                                 "rbf", "gaussian_process", "bspline", "physics_residual"})
      QTest::newRow(position) << position << "none";
    for (const char* orientation :
         {"rigid", "slerp_trilinear", "polynomial_euler", "polynomial_quaternion", "hmq_matrix"})
      QTest::newRow(orientation) << "affine" << orientation;
  }

  void whatIsBakedStaysWithinItsBounds() {
    QFETCH(const QString, position);
    QFETCH(const QString, orientation);
    // What jumps or bends sharply at places or faces of cells no smooth lattice follows.
    const QStringList sharp = {"tetrahedral", "trilinear", "slerp_trilinear", "hmq_matrix"};
    const CalibrationTable table = bentTable(1, position);
    const Calibration exact = loaded(fitted(table, position.toStdString(), orientation.toStdString()));
    fieldtrue_calibration* made = nullptr;
    const fieldtrue_status status = fieldtrue_bake(exact.get(), 50.0, 0.02, &made);
    if (status != FIELDTRUE_OK) {
      QCOMPARE(status, FIELDTRUE_IMPOSSIBLE);
      QVERIFY2(sharp.contains(position) || sharp.contains(orientation), fieldtrue_error());
      FT_VERIFY_MATCH(holdsAll(fieldtrue_error(), {"lattice"}));
      return;
    }
    fieldtrue_free(made);
    const Calibration baked = exact.baked(50.0, 0.02);
    const auto poses = inC(somePoses(table, 5000));
    const Worst worst = differenceInside(exact, baked, poses);
    QVERIFY2(worst.position_m < 50e-6, std::to_string(1e6 * worst.position_m).c_str());
    QVERIFY2(kDegPerRad * worst.angle_rad < 0.02, std::to_string(kDegPerRad * worst.angle_rad).c_str());
    std::vector<fieldtrue_pose> corrected(poses.size());
    const std::size_t before = n_allocations;
    fieldtrue_correct_many(baked.get(), FIELDTRUE_FIRST_SENSOR, poses.data(), corrected.data(), poses.size());
    for (const fieldtrue_pose& pose : poses) {
      fieldtrue_correct(baked.get(), FIELDTRUE_FIRST_SENSOR, &pose, &corrected.front());
      static_cast<void>(fieldtrue_uncertainty_m(baked.get(), &pose));
      static_cast<void>(fieldtrue_inside(baked.get(), pose.position_m));
    }
    QCOMPARE(n_allocations - before, std::size_t{0});
  }

  void aCorrectionOfPosesTakesThemAndTellsWhereItWasMeasured() {
    const CalibrationTable table = bentTable(4);
    const Corrector corrector = fitted(table, "gaussian_process:inputs=pose", "none");
    QVERIFY(corrector.takesOrientation());
    const Calibration calibration = loaded(corrector);
    QVERIFY(calibration.takesOrientation());
    for (const Pose& pose : somePoses(table, 50)) {
      auto c = inC({pose}).front();
      QVERIFY(outOfC(calibration.correct(c)).position_m == corrector.correct(pose).position_m);
      double nearest_rad = kPi;
      for (const Eigen::Quaterniond& q : corrector.orientationsSeen())
        nearest_rad = std::min(nearest_rad, angleBetween_rad(q, pose.orientation));
      FT_VERIFY_MATCH(near(calibration.nearestOrientation_deg(c), kDegPerRad * nearest_rad, 1e-9));
      // Without an orientation: the mean over those measured, and none comes back.
      std::fill(c.orientation_wxyz, c.orientation_wxyz + 4, 0.0);
      const fieldtrue_pose mean = calibration.correct(c);
      QVERIFY(Eigen::Vector3d::Map(mean.position_m) == corrector.correctPosition_m(pose.position_m));
      QCOMPARE(mean.orientation_wxyz[0], 0.0);
      QVERIFY(std::isnan(calibration.nearestOrientation_deg(c)));
    }
  }

  void aCorrectionOfPosesIsBakedWithItsOrientations() {
    const CalibrationTable table = bentTable(4);
    const Calibration exact = loaded(fitted(table, "gaussian_process:inputs=pose", "none"));
    const Calibration baked = exact.baked(50.0, 0.02);
    QVERIFY(baked.takesOrientation());
    const auto poses = inC(somePoses(table, 3000));
    const Worst worst = differenceInside(exact, baked, poses);
    QVERIFY2(worst.position_m < 50e-6, std::to_string(1e6 * worst.position_m).c_str());
    std::vector<fieldtrue_pose> corrected(poses.size());
    const std::size_t before = n_allocations;
    fieldtrue_correct_many(baked.get(), FIELDTRUE_FIRST_SENSOR, poses.data(), corrected.data(), poses.size());
    fieldtrue_correct(baked.get(), FIELDTRUE_FIRST_SENSOR, &poses.front(), &corrected.front());
    QCOMPARE(n_allocations - before, std::size_t{0});
  }

  void everySensorHasItsMounting() {
    CalibrationTable table = bentTable();
    const std::size_t n = table.nodes.size();
    for (std::size_t i = 0; i < n; ++i) {
      Node other = table.nodes[i];
      other.sensor = 7;
      other.tracker_from_sensor.orientation =
          other.tracker_from_sensor.orientation * rotationFromVector({0.0, 0.0, 0.7});
      table.nodes.push_back(other);
    }
    const Corrector corrector = fitted(table, "affine", "none");
    const Calibration calibration = loaded(corrector);
    const Pose pose = somePoses(table, 1).front();
    for (const int sensor : {0, 7, 3})
      QVERIFY(outOfC(calibration.correct(inC({pose}).front(), sensor)).orientation.coeffs() ==
              canonical(corrector.correct(pose, sensor).orientation).coeffs());
    QVERIFY(angleBetween_rad(outOfC(calibration.correct(inC({pose}).front(), 7)).orientation,
                             outOfC(calibration.correct(inC({pose}).front(), 0)).orientation) > 0.5);
  }

  void manyThreadsUseOne() {
    const CalibrationTable table = bentTable();
    const Calibration calibration = loaded(fitted(table, "gaussian_process", "none"));
    const auto poses = inC(somePoses(table));
    const auto expected = calibration.correct(poses);
    std::atomic<int> n_wrong{0};
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
      threads.emplace_back([&] {
        for (std::size_t i = 0; i < poses.size(); ++i) {
          if (!(calibration.uncertainty_m(poses[i]) > 0.0)) ++n_wrong;
          const fieldtrue_pose seen = calibration.correct(poses)[i % poses.size()];
          if (seen.position_m[0] != expected[i].position_m[0]) ++n_wrong;
        }
      });
    for (std::thread& thread : threads) thread.join();
    QCOMPARE(n_wrong.load(), 0);
  }

  void theFactsOfTheFileAndItsSetUp() {
    CalibrationTable table = bentTable();
    table.metadata.setup = {{"room", "Lab 2"}, {"transmitter_serial", "TX 17"}};
    const Calibration calibration = loaded(fitted(table, "affine", "rigid"));
    QCOMPARE(calibration.fact("method"), std::string("affine"));
    QCOMPARE(calibration.fact("orientation_method"), std::string("rigid"));
    QCOMPARE(calibration.fact("setup.room"), std::string("Lab 2"));
    QVERIFY(fieldtrue_fact(calibration.get(), "setup.units") == nullptr);
    QVERIFY(fieldtrue_fact(calibration.get(), nullptr) == nullptr);
    char text[200];
    const char* other[] = {"room=Lab 1"};
    QCOMPARE(fieldtrue_setup_matches(calibration.get(), other, 1, text, sizeof text), FIELDTRUE_MATCH_NO);
    FT_VERIFY_MATCH(holdsAll(text, {"Lab 1", "Lab 2"}));
    char cut[6];
    QCOMPARE(fieldtrue_setup_matches(calibration.get(), other, 1, cut, sizeof cut), FIELDTRUE_MATCH_NO);
    QCOMPARE(std::string(cut), std::string(text).substr(0, 5));
    const char* unknown[] = {"colour=red"};
    QCOMPARE(fieldtrue_setup_matches(calibration.get(), unknown, 1, nullptr, 0), FIELDTRUE_MATCH_UNKNOWN);
    QVERIFY(std::string(fieldtrue_error()).find("colour") != std::string::npos);
    QCOMPARE(fieldtrue_setup_matches(calibration.get(), nullptr, 0, nullptr, 0), FIELDTRUE_MATCH_UNKNOWN);
  }

  void whatIsNoCalibrationIsRefusedInOneSentence() {
    fieldtrue_calibration* made = nullptr;
    QCOMPARE(fieldtrue_load("/no/such/file.ftcal.json", &made), FIELDTRUE_UNREADABLE);
    const std::string good = fitted(bentTable(), "affine", "none").toText();
    const auto statusOf = [&](const std::string& text) {
      const fieldtrue_status status = fieldtrue_load_memory(text.data(), text.size(), "x.ftcal.json", &made);
      if (made != nullptr) qFatal("taken");
      return status;
    };
    QCOMPARE(statusOf(""), FIELDTRUE_BAD_FILE);
    QCOMPARE(statusOf("{\"schema\": \"fieldtrue.scene/1\"}"), FIELDTRUE_BAD_FILE);
    std::string damaged = good;
    damaged.replace(damaged.find("\"rigid\""), 7, "\"none\" ");
    QCOMPARE(statusOf(damaged), FIELDTRUE_BAD_FILE);
    FT_VERIFY_MATCH(holdsAll(fieldtrue_error(), {"x.ftcal.json", "checksum"}));
    std::string newer = good;
    newer.replace(newer.find("ftcal/1"), 7, "ftcal/9");
    QCOMPARE(statusOf(newer), FIELDTRUE_NEWER_FILE);
    for (std::size_t cut = 0; cut < good.size(); cut += 997) QVERIFY(statusOf(good.substr(0, cut)) != FIELDTRUE_OK);
    QCOMPARE(fieldtrue_load(nullptr, &made), FIELDTRUE_BAD_ARGUMENT);
    QCOMPARE(fieldtrue_load("x", nullptr), FIELDTRUE_BAD_ARGUMENT);
    QCOMPARE(fieldtrue_bake(nullptr, 50.0, 0.1, &made), FIELDTRUE_BAD_ARGUMENT);
    const Calibration calibration = Calibration::fromMemory(good, "x");
    for (const double bound : {0.0, -1.0, std::nan("")})
      QCOMPARE(fieldtrue_bake(calibration.get(), bound, 0.1, &made), FIELDTRUE_BAD_ARGUMENT);
    fieldtrue_free(nullptr);
  }

  void whatIsNoNumberStaysNone() {
    const Calibration calibration = loaded(fitted(bentTable(), "rbf", "hmq_matrix"));
    fieldtrue_pose pose = {{std::nan(""), 0.0, 1e300}, {1.0, 0.0, 0.0, 0.0}};
    QVERIFY(std::isnan(calibration.correct(pose).position_m[0]));
    QVERIFY(!calibration.isInside(pose));
  }
};

FIELDTRUE_TEST(RuntimeTest)
#include "runtime_test.moc"
