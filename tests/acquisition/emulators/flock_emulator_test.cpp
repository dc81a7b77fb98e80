#include "acquisition/emulators/flock_emulator.h"

#include <QTest>

#include "calib/core/units.h"
#include "tests/acquisition/emulators/shaking_source.h"
#include "tests/acquisition/protocols/fastrak_bytes.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

/// Station n of the exchange with VRPN stands at (0.254 n, -0.127, 0.0635 n) m, az el roll (30 n, 10, -20) deg.
std::vector<Pose> birdPoses(int birds) {
  std::vector<Pose> poses;
  for (int n = 1; n <= birds; ++n) {
    poses.push_back(
        {{0.254 * n, -0.127, 0.0635 * n}, rotationFromEuler(Eigen::Vector3d(30.0 * n, 10.0, -20.0) * kRadPerDeg)});
  }
  return poses;
}

FlockEmulatorOptions withFaults(const std::string& faults) {
  FlockEmulatorOptions options;
  options.faults = *parseFaults(faults, "flock");
  return options;
}

FlockEmulatorCore standingFlock(std::vector<Pose> poses, const FlockEmulatorOptions& options = {}) {
  return FlockEmulatorCore(std::make_unique<StandingSource>(std::move(poses), options.rate_hz), options);
}

std::string heard(FlockEmulatorCore& core, std::string_view said, double time_s = 0.0) {
  std::vector<EmulatedOutput> out;
  core.receive(said, time_s, out);
  std::string all;
  for (const auto& piece : out) all += piece.bytes;
  return all;
}

std::vector<EmulatedOutput> flockUntil(FlockEmulatorCore& core, double time_s) {
  std::vector<EmulatedOutput> out;
  while (core.tick(time_s, out)) {
  }
  return out;
}

FlockLayout driverLayout(bool group, double range_m = kFlockRange36_m) {
  FlockLayout layout;
  layout.mode = findFlockMode("position_quaternion");
  layout.group = group;
  layout.range_m = range_m;
  return layout;
}

Pose poseOf(const std::string& record, const FlockLayout& layout) {
  const auto decoded = decodeFlockRecord(record, layout);
  FT_CHECK(decoded.has_value());
  return toSample(*decoded, 0).tracker_from_sensor;
}

Pose polledBird(FlockEmulatorCore& core, double time_s) {
  return poseOf(heard(core, "]B", time_s), driverLayout(false));
}

}  // namespace

class FlockEmulatorTest : public QObject {
  Q_OBJECT
 private slots:
  void takesWhatVrpnSends();
  void extendedRangeNumbersFromTwo();
  void powerUpState();
  void everyModeAnswers_data();
  void everyModeAnswers();
  void streamsAtItsRate();
  void reportRates();
  void askedTooOftenRepeats();
  void groupNeedsConfiguring();
  void configuringTakesTime();
  void addressesBirds();
  void hemisphereMirrors();
  void angleAlignAndReferenceFrame();
  void scaleDoubles();
  void sleepsAndWakes();
  void dataReadyCharacter();
  void errorsAreKeptUntilRead();
  void parametersAreKept_data();
  void parametersAreKept();
  void saturationRepeatsAndIsNoted();
  void repeatsAndStuck();
  void alreadyStreams();
};

void FlockEmulatorTest::takesWhatVrpnSends() {
  // Its start with one bird, no extended range, side +z: point, auto-configure, group mode with mode and hemisphere in
  // one write, the flock status, two parameters in one write, the stream.
  auto core = standingFlock(birdPoses(1));
  QVERIFY(!heard(core, "B", 3.0).empty());
  heard(core, bytes("P<32 01>"), 8.0);
  QVERIFY(heard(core, bytes("P<23 01 F1 5D F1>L<0C 00>"), 18.0).empty());
  const std::string status = heard(core, bytes("O<24>"), 18.1);
  QCOMPARE(status.size(), std::size_t{14});
  // Accessible, running, a receiver, with the standard transmitter.
  QCOMPARE(status.substr(0, 2), bytes("<E1 00>"));
  const std::string rate = heard(core, bytes("O<02>O<06>"), 18.6);
  QCOMPARE(rate.size(), std::size_t{4});
  FT_VERIFY_MATCH(near(flockRate_hz(flockNumber(rate.substr(2)), flockNumber(rate)), 103.3, 0.05));
  QVERIFY(heard(core, "@", 19.1).empty());
  const auto out = flockUntil(core, 19.2);
  QVERIFY(out.size() >= 10);
  for (const auto& piece : out) {
    QCOMPARE(piece.bytes.size(), std::size_t{15});
    QCOMPARE(piece.bytes.back(), '\1');
    // What VRPN printed for this pose, within half a step.
    const Pose pose = poseOf(piece.bytes, driverLayout(true));
    const Eigen::Vector3d expected_m(0.254, -0.127, 0.0635);
    for (int axis = 0; axis < 3; ++axis)
      FT_VERIFY_MATCH(near(pose.position_m[axis], expected_m[axis], 0.0558e-3 + 1e-9));
    FT_VERIFY_MATCH(near(pose.orientation, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536), 3e-4));
  }
  // Its farewell.
  heard(core, "BG", 20.0);
  QVERIFY(!core.streaming() && core.asleep());
}

void FlockEmulatorTest::extendedRangeNumbersFromTwo() {
  FlockEmulatorOptions options;
  options.extended_range = true;
  auto core = standingFlock(birdPoses(1), options);
  QVERIFY(heard(core, "B").empty());
  heard(core, bytes("P<32 02>"), 1.0);
  heard(core, bytes("P<23 01 F2 5D F2>L<00 00>@"), 2.0);
  const std::string status = heard(core, bytes("O<24>"), 2.0);
  QCOMPARE(status.substr(0, 3), bytes("<D1 E0 00>"));
  const auto out = flockUntil(core, 2.1);
  QVERIFY(!out.empty());
  QCOMPARE(out[0].bytes.back(), '\2');
  const Pose pose = poseOf(out[0].bytes, driverLayout(true, kFlockRange144_m));
  FT_VERIFY_MATCH(near(pose.position_m.x(), 0.254, 0.5 * 0.4465e-3 + 1e-9));
}

void FlockEmulatorTest::powerUpState() {
  auto core = standingFlock(birdPoses(1));
  QCOMPARE(heard(core, bytes("O<0F>")), std::string("6DFOB     "));
  QCOMPARE(heard(core, bytes("O<01>")), bytes("<03 43>"));
  // Master, initialised, running, position and angles.
  QCOMPARE(heard(core, bytes("O<00>")), bytes("<08 D0>"));
  QCOMPARE(heard(core, "B").size(), std::size_t{12});
  QCOMPARE(heard(core, bytes("O<15>")), bytes("<01>"));
  FlockEmulatorOptions options;
  options.standalone = true;
  auto alone = standingFlock(birdPoses(1), options);
  QCOMPARE(heard(alone, bytes("O<15>")), bytes("<00>"));
}

void FlockEmulatorTest::everyModeAnswers_data() {
  QTest::addColumn<QByteArray>("mode");
  for (const FlockMode& mode : flockModes()) QTest::newRow(mode.id) << QByteArray(mode.id);
}

void FlockEmulatorTest::everyModeAnswers() {
  QFETCH(QByteArray, mode);
  auto core = standingFlock(birdPoses(1));
  FlockLayout layout;
  layout.mode = findFlockMode(std::string_view(mode.constData()));
  const std::string record = heard(core, flock::mode(*layout.mode) + "B");
  QCOMPARE(record.size(), 2 * layout.mode->words);
  const auto decoded = decodeFlockRecord(record, layout);
  QVERIFY(decoded.has_value());
  const Pose pose = toSample(*decoded, 0).tracker_from_sensor;
  if (layout.mode->position) FT_VERIFY_MATCH(near(pose.position_m, birdPoses(1)[0].position_m, 0.1e-3));
  if (layout.mode->orientation != FlockOrientation::kNone)
    FT_VERIFY_MATCH(near(pose.orientation, birdPoses(1)[0].orientation, 5e-4));
  // Bits 4 to 1 of the status word name it.
  QCOMPARE(decodeFlockStatus(heard(core, bytes("O<00>"))).mode, layout.mode->code);
}

void FlockEmulatorTest::streamsAtItsRate() {
  auto core = standingFlock(birdPoses(3));
  heard(core, bytes("P<32 03>"), 0.0);
  heard(core, bytes("P<23 01>]@"), 5.0);
  // Every bird in every cycle: 103.3 a second each.
  const auto out = flockUntil(core, 15.0);
  QCOMPARE(out.size(), std::size_t{3 * 1034});
  for (std::size_t i = 0; i < out.size(); ++i) {
    QCOMPARE(out[i].bytes.back() - '\0', static_cast<int>(i % 3) + 1);
    QVERIFY(out[i].record);
  }
}

void FlockEmulatorTest::reportRates() {
  for (const auto& [letter, every] : {std::pair{'Q', 1}, {'R', 2}, {'S', 8}, {'T', 32}}) {
    auto core = standingFlock(birdPoses(1));
    heard(core, std::string(1, letter) + "@");
    QCOMPARE(flockUntil(core, 10.0).size(), static_cast<std::size_t>((1033 + every) / every));
  }
}

void FlockEmulatorTest::askedTooOftenRepeats() {
  FlockEmulatorOptions options;
  FlockEmulatorCore core(std::make_unique<ShakingSource>(birdPoses(1), options.rate_hz), options);
  std::vector<std::string> records;
  for (int i = 0; i < 500; ++i) records.push_back(heard(core, "]B", i / 500.0));
  const auto last = std::unique(records.begin(), records.end());
  // 500 questions in a second, 103.3 measurements.
  QCOMPARE(last - records.begin(), std::ptrdiff_t{104});
}

void FlockEmulatorTest::groupNeedsConfiguring() {
  auto core = standingFlock(birdPoses(2));
  QVERIFY(heard(core, "B").empty());
  QCOMPARE(core.lastError(), 8);
  QCOMPARE(heard(core, bytes("O<24>")).substr(0, 3), bytes("<A1 A0 00>"));
  heard(core, "@");
  QVERIFY(flockUntil(core, 1.0).empty());
  heard(core, bytes("P<32 02>"), 1.0);
  QCOMPARE(heard(core, bytes("O<24>"), 2.0).substr(0, 3), bytes("<E1 E0 00>"));
  QCOMPARE(heard(core, bytes("P<23 01>]<F2>]B"), 2.0).size(), std::size_t{30});
  // A unit that is not there is noted, with its address.
  heard(core, bytes("P<32 05>"), 3.0);
  QCOMPARE(heard(core, bytes("O<10>"), 4.0), bytes("<0D 03>"));
}

void FlockEmulatorTest::configuringTakesTime() {
  auto core = standingFlock(birdPoses(2));
  heard(core, bytes("P<32 02>"), 1.0);
  QVERIFY(heard(core, bytes("O<24>"), 1.3).empty());
  QCOMPARE(heard(core, bytes("O<24>"), 1.6).size(), std::size_t{14});
}

void FlockEmulatorTest::addressesBirds() {
  auto core = standingFlock(birdPoses(3));
  heard(core, bytes("P<32 03>"), 0.0);
  heard(core, bytes("<F2 56 F3 5D>"), 1.0);
  QCOMPARE(std::string(core.mode(1).id), std::string("position_angles"));
  QCOMPARE(std::string(core.mode(2).id), std::string("position"));
  QCOMPARE(std::string(core.mode(3).id), std::string("position_quaternion"));
  const Pose pose = poseOf(heard(core, bytes("<F3>B"), 1.0), driverLayout(false));
  FT_VERIFY_MATCH(near(pose.position_m, birdPoses(3)[2].position_m, 0.1e-3));
  QVERIFY(heard(core, bytes("<F7>B"), 1.0).empty());
  QCOMPARE(heard(core, bytes("O<10>"), 1.0), bytes("<0D 07>"));
}

void FlockEmulatorTest::hemisphereMirrors() {
  const Pose behind{{-0.3, 0.1, 0.2}, Eigen::Quaterniond::Identity()};
  auto core = standingFlock({behind});
  FT_VERIFY_MATCH(near(polledBird(core, 0.0).position_m, -behind.position_m, 0.1e-3));
  heard(core, bytes("L<00 01>"));
  FT_VERIFY_MATCH(near(polledBird(core, 1.0).position_m, behind.position_m, 0.1e-3));
  heard(core, bytes("L<0C 01>"));
  FT_VERIFY_MATCH(near(polledBird(core, 2.0).position_m, -behind.position_m, 0.1e-3));
  heard(core, bytes("L<06 00>"));
  FT_VERIFY_MATCH(near(polledBird(core, 3.0).position_m, behind.position_m, 0.1e-3));
}

void FlockEmulatorTest::angleAlignAndReferenceFrame() {
  auto core = standingFlock({{{0.3, 0.2, 0.1}, Eigen::Quaterniond::Identity()}});
  // Azimuth 90 deg: word 0x4000.
  heard(core, bytes("r<00 40 00 00 00 00>"));
  Pose pose = polledBird(core, 0.0);
  FT_VERIFY_MATCH(near(eulerFromRotation_rad(pose.orientation).x(), -kPi / 2, 5e-4));
  FT_VERIFY_MATCH(near(pose.position_m, Eigen::Vector3d(0.3, 0.2, 0.1), 0.1e-3));
  heard(core, bytes("P<11 01>"));
  // A quarter turn to the right: (x, y) is seen as (y, -x).
  FT_VERIFY_MATCH(near(polledBird(core, 1.0).position_m, Eigen::Vector3d(0.2, -0.3, 0.1), 0.1e-3));
  heard(core, flock::clearReferenceFrame());
  heard(core, bytes("q<00 00 00 00 00 40>"));
  FT_VERIFY_MATCH(near(eulerFromRotation_rad(polledBird(core, 2.0).orientation).z(), kPi / 2, 5e-4));
  heard(core, flock::clearAngleAlign());
  FT_VERIFY_MATCH(near(polledBird(core, 3.0), {{0.3, 0.2, 0.1}, Eigen::Quaterniond::Identity()}, 0.1e-3, 5e-4));
}

void FlockEmulatorTest::scaleDoubles() {
  auto core = standingFlock({{{1.2, 0.0, 0.0}, Eigen::Quaterniond::Identity()}});
  // Out of the 36 in range a position stays at its end.
  FT_VERIFY_MATCH(near(polledBird(core, 0.0).position_m.x(), kFlockRange36_m * 8191.0 / 8192.0, 1e-9));
  heard(core, bytes("P<03 01 00>"));
  FT_VERIFY_MATCH(
      near(poseOf(heard(core, "B", 1.0), driverLayout(false, kFlockRange72_m)).position_m.x(), 1.2, 0.12e-3));
  QCOMPARE(heard(core, bytes("O<03>")), bytes("<01 00>"));
}

void FlockEmulatorTest::sleepsAndWakes() {
  auto core = standingFlock(birdPoses(1));
  heard(core, "@G");
  QVERIFY(flockUntil(core, 5.0).empty());
  QVERIFY(decodeFlockStatus(heard(core, bytes("O<00>"), 5.0)).sleeping);
  heard(core, "F", 5.0);
  // Nothing is made up for.
  QCOMPARE(flockUntil(core, 5.1).size(), std::size_t{11});
}

void FlockEmulatorTest::dataReadyCharacter() {
  auto core = standingFlock(birdPoses(1));
  heard(core, bytes("P<08 01>"));
  QVERIFY(core.streaming());
  const auto out = flockUntil(core, 0.1);
  QCOMPARE(out.size(), std::size_t{11});
  for (const auto& piece : out) QCOMPARE(piece.bytes, std::string(","));
  heard(core, bytes("P<08 00>"), 0.1);
  QVERIFY(!core.streaming());
}

void FlockEmulatorTest::errorsAreKeptUntilRead() {
  auto core = standingFlock(birdPoses(1));
  heard(core, "z");
  QVERIFY(decodeFlockStatus(heard(core, bytes("O<00>"))).error);
  QCOMPARE(heard(core, bytes("O<0A>")), bytes("<06>"));
  QCOMPARE(heard(core, bytes("O<0A>")), bytes("<00>"));
  QVERIFY(!decodeFlockStatus(heard(core, bytes("O<00>"))).error);
  // What cannot be changed or is not there.
  QVERIFY(heard(core, bytes("P<00>")).empty());
  QCOMPARE(heard(core, bytes("O<0A>")), bytes("<06>"));
  QVERIFY(heard(core, bytes("O<63>")).empty());
  QCOMPARE(heard(core, bytes("O<0A>")), bytes("<06>"));
}

void FlockEmulatorTest::parametersAreKept_data() {
  QTest::addColumn<int>("number");
  for (const FlockParameter& row : flockParameters()) {
    const bool acts = row.number == flock_parameter::kGroupMode || row.number == flock_parameter::kAddressing;
    if (row.examined_bytes > 0 && row.changed_bytes > 0 && !acts) QTest::newRow(row.meaning) << row.number;
  }
}

void FlockEmulatorTest::parametersAreKept() {
  QFETCH(int, number);
  auto core = standingFlock(birdPoses(1));
  const FlockParameter& row = *findFlockParameter(number);
  QCOMPARE(row.examined_bytes, row.changed_bytes);
  std::string value;
  for (int i = 0; i < row.changed_bytes; ++i) value += static_cast<char>(i + 1);
  QVERIFY(heard(core, flock::change(number, value)).empty());
  QCOMPARE(heard(core, flock::examine(number)), value);
}

void FlockEmulatorTest::saturationRepeatsAndIsNoted() {
  const FlockEmulatorOptions options = withFaults("error_status");
  FlockEmulatorCore core(std::make_unique<ShakingSource>(birdPoses(1), options.rate_hz), options);
  heard(core, "]@");
  const auto good = flockUntil(core, 2.99);
  QCOMPARE(core.lastError(), 0);
  const auto saturated = flockUntil(core, 3.99);
  QVERIFY(saturated.size() >= 100);
  for (const auto& piece : saturated) QCOMPARE(piece.bytes, saturated.front().bytes);
  QCOMPARE(core.lastError(), 32);
  const auto again = flockUntil(core, 4.2);
  QVERIFY(again[again.size() - 1].bytes != again[again.size() - 2].bytes);
}

void FlockEmulatorTest::repeatsAndStuck() {
  const FlockEmulatorOptions twice = withFaults("repeats");
  FlockEmulatorCore core(std::make_unique<ShakingSource>(birdPoses(1), twice.rate_hz), twice);
  heard(core, "]@");
  const auto out = flockUntil(core, 1.0);
  QCOMPARE(out.size(), std::size_t{208});
  for (std::size_t i = 0; i + 2 < out.size(); i += 2) {
    QCOMPARE(out[i].bytes, out[i + 1].bytes);
    QVERIFY(out[i].bytes != out[i + 2].bytes);
  }
  const FlockEmulatorOptions sticks = withFaults("stuck");
  FlockEmulatorCore stuck(std::make_unique<ShakingSource>(birdPoses(1), sticks.rate_hz), sticks);
  heard(stuck, "]@");
  flockUntil(stuck, 3.1);
  const auto later = flockUntil(stuck, 10.0);
  QVERIFY(later.size() > 700);
  for (const auto& piece : later) QCOMPARE(piece.bytes, later.front().bytes);
}

void FlockEmulatorTest::alreadyStreams() {
  auto core = standingFlock(birdPoses(2), withFaults("already_streaming"));
  QVERIFY(core.streaming());
  QVERIFY(flockUntil(core, 1.0).size() > 200);
  heard(core, "B", 1.0);
  QVERIFY(!core.streaming());
}

FIELDTRUE_TEST(FlockEmulatorTest)
#include "flock_emulator_test.moc"
