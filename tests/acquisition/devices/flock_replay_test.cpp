#include <QTemporaryDir>
#include <QTest>
#include <fstream>
#include <sstream>

#include "acquisition/devices/flock_device.h"
#include "acquisition/emulators/flock_emulator.h"
#include "tests/acquisition/devices/device_probe.h"
#include "tests/support/matchers.h"
#include "tests/support/real_data.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

/// Stylus and reference sensor of a recorded Ascension tracker, 15 Hz, as sensors 0 and 1.
SampleTable readTwoSensors(const std::filesystem::path& path) {
  constexpr std::size_t kTime = 1, kStylus = 10, kReference = 17;
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  SampleTable table;
  while (std::getline(in, line)) {
    std::stringstream fields(line);
    std::vector<double> values;
    for (std::string field; std::getline(fields, field, ',');) values.push_back(std::stod(field));
    for (const auto& [sensor, first] : {std::pair{0, kStylus}, {1, kReference}}) {
      const double* v = values.data() + first;
      const Pose pose{Eigen::Vector3d(v[0], v[1], v[2]) * 1e-3,
                      Eigen::Quaterniond(v[3], v[4], v[5], v[6]).normalized()};
      table.rows.push_back({-1, 0, Sample{values[kTime], sensor, pose, {}}});
    }
  }
  return table;
}

}  // namespace

class FlockReplayTest : public QObject {
  Q_OBJECT
 private slots:
  void everyPoseOfARealRecordingArrives_data();
  void everyPoseOfARealRecordingArrives();
};

void FlockReplayTest::everyPoseOfARealRecordingArrives_data() {
  QTest::addColumn<bool>("drop_repeats");
  QTest::newRow("every record") << false;
  QTest::newRow("repeats dropped") << true;
}

void FlockReplayTest::everyPoseOfARealRecordingArrives() {
  FT_REQUIRE_REAL_DATA();
  QFETCH(bool, drop_repeats);
  const SampleTable recorded = readTwoSensors(*realData("pluslib_fcal/samples.csv"));
  QCOMPARE(recorded.rows.size(), std::size_t{2000});
  constexpr double kSpeed = 10.0;
  QTemporaryDir folder;
  Emulation emulation;
  emulation.replay = recorded;
  emulation.pty_link = folder.filePath("flock").toStdString();
  emulation.speed = kSpeed;
  auto emulator = makeFlockEmulator(emulation);
  FT_VERIFY_OK(emulator);
  FT_VERIFY_OK((*emulator)->start());
  const std::string line = (*emulator)->endpoint().address().toStdString();
  FlockSetup setup;
  setup.where = line;
  setup.range = "36";
  setup.drop_repeats = drop_repeats;
  setup.configure_ms = 100;
  const auto device = makeLineDevice<FlockStartup>(
      setup, [line] { return makeTransport(line); }, kSpeed);
  DeviceProbe probe(*device);
  device->start();
  constexpr double kBusy_s = 0.1;  // Of this computer, before it looks.
  const double last_s = recorded.rows.back().sample.time_s;
  const auto ended = [&] {
    return !probe.samples.empty() &&
           probe.samples.back().time_s - probe.samples.front().time_s > last_s - kSpeed * kBusy_s;
  };
  QTRY_VERIFY2_WITH_TIMEOUT(ended(), qPrintable(probe.last_text), 40000);
  QTest::qWait(static_cast<int>(3e3 * kBusy_s));

  // Positions were recorded on the lattice of the 36 in range; per axis they come back within half a step of it.
  constexpr double kHalfStep_m = 0.5 * 0.9144 / 8192.0;
  const auto same = [](const Pose& seen, const Pose& was) {
    return (seen.position_m - was.position_m).cwiseAbs().maxCoeff() <= kHalfStep_m &&
           angleBetween_rad(seen.orientation, was.orientation) < 3e-4;
  };
  std::size_t arrived = 0;
  int repeats = 0;
  for (std::size_t i = 0; i < recorded.rows.size(); ++i) {
    const Sample& was = recorded.rows[i].sample;
    const bool here = arrived < probe.samples.size() && probe.samples[arrived].sensor == was.sensor &&
                      same(probe.samples[arrived].tracker_from_sensor, was.tracker_from_sensor);
    if (here) {
      QCOMPARE(probe.samples[arrived++].status, std::string());
      continue;
    }
    // What did not arrive said what the sensor's row before had said.
    QVERIFY2(drop_repeats && i >= 2, qPrintable(QString::number(i)));
    QVERIFY(same(was.tracker_from_sensor, recorded.rows[i - 2].sample.tracker_from_sensor));
    ++repeats;
  }
  QCOMPARE(arrived, probe.samples.size());
  // 58 of 2000 repeat the one before to the bit of a record.
  QVERIFY(repeats < 100);
}

FIELDTRUE_TEST(FlockReplayTest)
#include "flock_replay_test.moc"
