#include <QElapsedTimer>
#include <QTemporaryDir>
#include <QTest>
#include <fstream>

#include "acquisition/devices/fastrak_device.h"
#include "acquisition/emulators/fastrak_emulator.h"
#include "tests/acquisition/devices/device_probe.h"
#include "tests/support/matchers.h"
#include "tests/support/real_data.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

constexpr double kRate_hz = 100.0;

/// A trajectory of 4x4 matrices in metres, one after the other, at 100 Hz.
SampleTable readTrajectory(const std::filesystem::path& path) {
  std::ifstream in(path);
  SampleTable table;
  Eigen::Matrix4d matrix;
  const auto next = [&in, &matrix] {
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) {
        if (!(in >> matrix(row, column))) return false;
      }
    }
    return true;
  };
  while (next()) {
    Sample sample;
    sample.time_s = static_cast<double>(table.rows.size()) / kRate_hz;
    sample.tracker_from_sensor.position_m = matrix.topRightCorner<3, 1>();
    sample.tracker_from_sensor.orientation =
        Eigen::Quaterniond(Eigen::Matrix3d(matrix.topLeftCorner<3, 3>())).normalized();
    table.rows.push_back({-1, 0, sample});
  }
  return table;
}

}  // namespace

class FastrakReplayTest : public QObject {
  Q_OBJECT
 private slots:
  void everyRecordOfARealHandArrives_data();
  void everyRecordOfARealHandArrives();
  void refusesWhatCannotBeReplayed();
};

void FastrakReplayTest::everyRecordOfARealHandArrives_data() {
  QTest::addColumn<bool>("tcp");
  QTest::newRow("pty") << false;
  QTest::newRow("tcp") << true;
}

void FastrakReplayTest::everyRecordOfARealHandArrives() {
  FT_REQUIRE_REAL_DATA();
  QFETCH(bool, tcp);
  const SampleTable recorded = readTrajectory(*realData("polhemus_hand/user1_cup0.traj"));
  QCOMPARE(recorded.rows.size(), std::size_t{290});

  QTemporaryDir folder;
  Emulation emulation;
  emulation.replay = recorded;
  if (tcp) {
    emulation.tcp_port = 0;
  } else {
    emulation.pty_link = folder.filePath("tracker").toStdString();
  }
  auto emulator = makeFastrakEmulator(emulation);
  FT_VERIFY_OK(emulator);
  FT_VERIFY_OK((*emulator)->start());
  const std::string line = (*emulator)->endpoint().address().toStdString();
  FastrakSetup setup;
  setup.where = line;
  const auto device = makeLineDevice<FastrakStartup>(setup, [line] { return makeTransport(line); });
  DeviceProbe probe(*device);
  device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(!probe.samples.empty(), qPrintable(probe.last_text), 15000);
  QElapsedTimer clock;
  clock.start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= recorded.rows.size(), qPrintable(probe.last_text), 30000);
  // In real time: 289 periods of 10 ms, the first two records of which arrive together.
  const double took_s = static_cast<double>(clock.nsecsElapsed()) * 1e-9;
  QVERIFY2(took_s > 2.75 && took_s < 4.5, qPrintable(QString::number(took_s)));
  QTest::qWait(100);
  QCOMPARE(probe.samples.size(), recorded.rows.size());
  QCOMPARE((*emulator)->recordsSent(), static_cast<std::uint64_t>(recorded.rows.size()));
  for (std::size_t i = 0; i < recorded.rows.size(); ++i) {
    QCOMPARE(probe.samples[i].status, std::string());
    // The recording has six digits; a float32 of centimetres keeps 8e-6 cm at 2 m.
    FT_VERIFY_MATCH(
        near(probe.samples[i].tracker_from_sensor, recorded.rows[i].sample.tracker_from_sensor, 2e-7, 2e-6));
  }
  const double span_s = probe.samples.back().time_s - probe.samples.front().time_s;
  FT_VERIFY_MATCH(near(span_s, 2.89, 0.1));
}

void FastrakReplayTest::refusesWhatCannotBeReplayed() {
  Emulation emulation;
  FT_VERIFY_MATCH(holdsAll(makeFastrakEmulator(emulation).error().message, {"--pty", "--listen"}));
  emulation.tcp_port = 0;
  emulation.replay = SampleTable{};
  FT_VERIFY_MATCH(holdsAll(makeFastrakEmulator(emulation).error().message, {"no rows"}));
  emulation.replay->rows.push_back({-1, 0, Sample{0.0, 7, {}, {}}});
  FT_VERIFY_MATCH(holdsAll(makeFastrakEmulator(emulation).error().message, {"sensor 7"}));
}

FIELDTRUE_TEST(FastrakReplayTest)
#include "fastrak_replay_test.moc"
