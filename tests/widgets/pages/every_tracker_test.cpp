#include <QCheckBox>
#include <QComboBox>
#include <QFile>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QSpinBox>
#include <QTableWidget>
#include <QTest>
#include <algorithm>
#include <map>
#include <memory>

#include "acquisition/devices/registry.h"
#include "acquisition/emulators/fastrak_emulator.h"
#include "acquisition/emulators/flock_emulator.h"
#include "acquisition/emulators/isotrak_emulator.h"
#include "acquisition/emulators/liberty_emulator.h"
#include "acquisition/emulators/ndi_emulator.h"
#include "acquisition/emulators/openigtlink_emulator.h"
#include "tests/acquisition/emulators/shaking_source.h"
#include "tests/support/matchers.h"
#include "tests/widgets/pages/window_driver.h"

/// From the cable to a calibration with every tracker that has an emulator, two sensors on each, in the window by keys
/// and clicks: connect, see that both are recorded, look at the signals, plan, take every place, compare, fit, export.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

using Source = std::unique_ptr<acquisition::PoseSource>;
using Unit = std::unique_ptr<acquisition::EmulatedTracker>;

const Pose kReferenceFromTracker{{0.1, 0.05, -0.02}, rotationFromVector({0.0, 0.0, 0.2})};
const Eigen::Vector3d kToSecond_m{0.0, 0.04, 0.0};
constexpr int kConnectMs = 30000;
constexpr std::size_t kPlaces = 8;

template <class Emulator, class Options>
Unit made(Source source) {
  return std::make_unique<Emulator>(std::move(source), Options{});
}

/// What stands behind a line of each kind.
const std::map<std::string, Unit (*)(Source)>& units() {
  static const std::map<std::string, Unit (*)(Source)> kUnits{
      {"fastrak", made<acquisition::FastrakEmulatorCore, acquisition::FastrakEmulatorOptions>},
      {"isotrak", made<acquisition::IsotrakEmulator, acquisition::IsotrakEmulatorOptions>},
      {"liberty",
       [](Source source) -> Unit {
         return std::make_unique<acquisition::LibertyEmulator>(std::move(source),
                                                               acquisition::LibertyEmulatorOptions{});
       }},
      {"patriot",
       [](Source source) -> Unit {
         return std::make_unique<acquisition::LibertyEmulator>(
             std::move(source), acquisition::LibertyEmulatorOptions(acquisition::libertyMake("patriot")));
       }},
      {"flock", made<acquisition::FlockEmulatorCore, acquisition::FlockEmulatorOptions>},
      {"ndi", made<acquisition::NdiEmulatorCore, acquisition::NdiEmulatorOptions>},
      {"openigtlink",
       [](Source source) -> Unit {
         acquisition::IgtlEmulatorOptions options;
         options.start_utc_s = 1.7e9;
         return std::make_unique<acquisition::IgtlEmulatorCore>(std::move(source), options);
       }},
  };
  return kUnits;
}

}  // namespace

class EveryTrackerTest : public WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase() {
    showWindow();
    window_->activateWindow();  // Keys reach no other.
  }
  void cleanup() {
    window_->workbench().disconnectDevice();
    QTRY_COMPARE(status().device, acquisition::DeviceState::kClosed);
    emulator_.reset();
  }
  void cleanupTestCase() { closeWindow(); }

  void toACalibration_data() {
    QTest::addColumn<QString>("kind");
    for (const acquisition::DeviceKind& kind : acquisition::deviceKinds()) {
      if (kind.emulate) QTest::newRow(kind.id.c_str()) << QString::fromStdString(kind.id);
    }
  }

  void toACalibration() {
    QFETCH(QString, kind);
    QVERIFY2(units().contains(kind.toStdString()), "a new tracker belongs into the table above");
    plugIn(kind);
    connectTracker(kind);
    if (QTest::currentTestFailed()) return;
    click("step_signal");
    QTRY_COMPARE_WITH_TIMEOUT(find<QTableWidget>("sensorTable")->rowCount(), 2, kConnectMs);
    QTRY_VERIFY_WITH_TIMEOUT(find<QLabel>("answer_noise")->text().contains(QStringLiteral("SD")), 2 * kConnectMs);
    picture(QStringLiteral("signal-") + kind);
    makePlan();
    if (QTest::currentTestFailed()) return;
    bothAreRecorded();
    if (QTest::currentTestFailed()) return;
    click("step_acquire");
    for (std::size_t place = 0; place < kPlaces; ++place) {
      take(place);
      if (QTest::currentTestFailed()) return;
      if (place == 3) picture(QStringLiteral("acquire-") + kind);
    }
    rowsAreOfBoth();
    if (QTest::currentTestFailed()) return;
    comparisonIsOfBoth();
    if (QTest::currentTestFailed()) return;
    // A calibration of what was recorded puts each sensor where the rig says it was.
    calibration::CorrectorChoice choice;
    choice.position_id = "affine";
    window_->workbench().fit(choice, calibration::AlignMode::kRigid);
    QTRY_VERIFY_WITH_TIMEOUT(window_->workbench().corrector().has_value(), kWaitMs);
    const Pose truth = status().session->places[5].reference_from_sensor;
    correctsBoth(*window_->workbench().corrector(), truth);
    if (QTest::currentTestFailed()) return;
    exportedIsOfBoth(truth);
  }

 private:
  const acquisition::AcquisitionStatus& status() { return window_->workbench().status(); }

  void plugIn(const QString& kind) {
    const Pose first{{0.4, 0.0, 0.1}, Eigen::Quaterniond::Identity()};
    auto source = std::make_unique<ShakingSource>(std::vector{first, first});
    source_ = source.get();
    put(kReferenceFromTracker * first);
    emulator_ = std::make_unique<acquisition::EmulatorRunner>(units().at(kind.toStdString())(std::move(source)),
                                                              std::make_unique<acquisition::TcpEndpoint>(quint16{0}));
    FT_VERIFY_OK(emulator_->start());
  }

  static Eigen::Vector3d jigToSensor_m(std::size_t sensor) {
    return sensor == 0 ? Eigen::Vector3d::Zero() : kToSecond_m;
  }

  void put(const Pose& reference_from_sensor) {
    for (std::size_t i = 0; i < 2; ++i)
      source_->put(i, inverse(kReferenceFromTracker) *
                          Pose{reference_from_sensor.position_m + jigToSensor_m(i), reference_from_sensor.orientation});
  }

  /// Connect offers both; one can be left out by the keyboard, and put back.
  void bothAreRecorded() {
    click("step_connect");
    QTRY_COMPARE_WITH_TIMEOUT(status().sensors.size(), std::size_t{2}, kConnectMs);
    sensors_ = {status().sensors[0].sensor, status().sensors[1].sensor};
    QVERIFY(sensors_[0] < sensors_[1]);
    auto* second = find<QCheckBox>(qPrintable(QStringLiteral("recordSensor%1").arg(sensors_[1])));
    QTRY_VERIFY(second->isVisible() && second->isChecked());
    for (const std::size_t recorded : {std::size_t{1}, std::size_t{2}}) {
      second->setFocus();
      QTest::keyClick(second, Qt::Key_Space);
      QTRY_COMPARE(status().sensors.size(), recorded);
    }
    picture(QStringLiteral("connect-both"));
  }

  /// Each of them its mean, and its samples.
  void rowsAreOfBoth() {
    const auto& workbench = window_->workbench();
    QTRY_COMPARE(workbench.table().nodes.size(), 2 * kPlaces);
    const CalibrationTable table = workbench.table();
    const SampleTable samples = workbench.samples();
    for (std::size_t row = 0; row < table.nodes.size(); ++row) {
      const Node& node = table.nodes[row];
      QCOMPARE(node.sensor, sensors_[row % 2]);
      const Pose stood = inverse(kReferenceFromTracker) * node.reference_from_sensor;
      const Eigen::Vector3d seen_m = stood * jigToSensor_m(row % 2);
      FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m, seen_m, 1e-3));
      const auto is_of_it = [&](const SampleRow& sample) {
        return sample.node == node.node && sample.visit == node.visit && sample.sample.sensor == node.sensor;
      };
      QCOMPARE(std::count_if(samples.rows.begin(), samples.rows.end(), is_of_it), node.n_used + node.n_rejected);
    }
  }

  /// Each to where it sits on the jig.
  void correctsBoth(const calibration::Corrector& corrector, const Pose& truth) {
    for (std::size_t i = 0; i < 2; ++i) {
      const Pose own = truth * Pose{jigToSensor_m(i), Eigen::Quaterniond::Identity()};
      FT_VERIFY_MATCH(near(corrector.correct(inverse(kReferenceFromTracker) * own, sensors_[i]), own, 5e-4, 2e-3));
    }
  }

  void exportedIsOfBoth(const Pose& truth) {
    click("step_export");
    auto* formats = find<QListWidget>("exportList");
    const QList<QListWidgetItem*> rows = formats->findItems(QStringLiteral(".ftcal.json"), Qt::MatchContains);
    QVERIFY(!rows.isEmpty());
    formats->setCurrentItem(rows.front());
    const QString path = find<QLineEdit>("exportPath")->text();
    click("exportWrite");
    QTRY_VERIFY_WITH_TIMEOUT(QFile::exists(path), kWaitMs);
    const auto written = calibration::Corrector::load(path.toStdString());
    FT_VERIFY_OK(written);
    QCOMPARE(written->table().nodes.size(), 2 * kPlaces);
    correctsBoth(*written, truth);
  }

  void comparisonIsOfBoth() {
    click("step_compare");
    auto& workbench = window_->workbench();
    QTRY_VERIFY_WITH_TIMEOUT(workbench.comparison().has_value() && workbench.comparisonIsCurrent(), kWaitMs);
    QCOMPARE(workbench.comparison()->before_sensors.size(), std::size_t{2});
    QVERIFY(find<QComboBox>("compareSensor")->isVisible());
  }

  void connectTracker(const QString& kind) {
    click("step_connect");
    auto* kinds = find<QComboBox>("deviceKind");
    kinds->setCurrentIndex(kinds->findData(kind));
    QString address = emulator_->endpoint().address();
    if (kind == QStringLiteral("openigtlink")) address.remove(QStringLiteral("tcp:"));
    auto* line = find<QComboBox>("deviceAddress")->lineEdit();
    QTest::keyClick(line, Qt::Key_A, Qt::ControlModifier);
    QTest::keyClicks(line, address);
    click("connectButton");
    QTRY_VERIFY2_WITH_TIMEOUT(status().device == acquisition::DeviceState::kRunning && status().live,
                              qPrintable(status().device_text), kConnectMs);
  }

  void makePlan() {
    const QString before = window_->workbench().sessionPath();
    click("step_plan");
    for (const char* axis : {"count_x", "count_y", "count_z"}) find<QSpinBox>(axis)->setValue(2);
    find<QSpinBox>("samplesPerNode")->setValue(20);
    click("createSession");
    QTRY_VERIFY_WITH_TIMEOUT(window_->workbench().sessionPath() != before, kConnectMs);
    QTRY_VERIFY_WITH_TIMEOUT(status().session->path == window_->workbench().sessionPath(), kConnectMs);
    QCOMPARE(status().session->places.size(), std::size_t{8});
  }

  void take(std::size_t place) {
    const Pose stands = status().session->places[place].reference_from_sensor;
    put(stands);
    const Eigen::Vector3d seen_m = (inverse(kReferenceFromTracker) * stands).position_m;
    const auto is_there = [&] {
      return status().live && status().still && (status().live->tracker_from_sensor.position_m - seen_m).norm() < 0.002;
    };
    QTRY_VERIFY2_WITH_TIMEOUT(is_there(), qPrintable(status().reason), kConnectMs);
    QTest::keyClick(window_.get(), Qt::Key_Space);
    QTRY_COMPARE_WITH_TIMEOUT(status().recorded->n_done, place + 1, kConnectMs);
    const auto* lines = find<QLabel>("sensorLines");
    QVERIFY(lines->isVisible());
    for (const int sensor : sensors_) QVERIFY(lines->text().contains(QStringLiteral("Sensor %1").arg(sensor)));
  }

  std::unique_ptr<acquisition::EmulatorRunner> emulator_;
  acquisition::StandingSource* source_ = nullptr;
  std::vector<int> sensors_;  ///< As the tracker numbers them.
};

FIELDTRUE_WINDOW_TEST(EveryTrackerTest)
#include "every_tracker_test.moc"
