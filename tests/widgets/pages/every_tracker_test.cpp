#include <QComboBox>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSpinBox>
#include <QTableWidget>
#include <QTest>
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
/// and clicks: connect, look at the signals, plan, take every place, fit.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

using Source = std::unique_ptr<acquisition::PoseSource>;
using Unit = std::unique_ptr<acquisition::EmulatedTracker>;

const Pose kReferenceFromTracker{{0.1, 0.05, -0.02}, rotationFromVector({0.0, 0.0, 0.2})};
const Eigen::Vector3d kToSecond_m{0.0, 0.04, 0.0};
constexpr int kConnectMs = 30000;

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
    QTRY_VERIFY_WITH_TIMEOUT(find<QLabel>("answer_noise")->text().contains(QStringLiteral("SD")), kConnectMs);
    picture(QStringLiteral("signal-") + kind);
    makePlan();
    if (QTest::currentTestFailed()) return;
    for (std::size_t place = 0; place < 8; ++place) {
      take(place);
      if (QTest::currentTestFailed()) return;
    }
    // A calibration of what was recorded puts the sensor where the rig says it was.
    click("step_compare");
    calibration::CorrectorChoice choice;
    choice.position_id = "affine";
    window_->workbench().fit(choice, calibration::AlignMode::kRigid);
    QTRY_VERIFY_WITH_TIMEOUT(window_->workbench().corrector().has_value(), kWaitMs);
    const Pose truth = status().session->places[5].reference_from_sensor;
    const Pose found = window_->workbench().corrector()->correct(inverse(kReferenceFromTracker) * truth);
    FT_VERIFY_MATCH(near(found, truth, 5e-4, 2e-3));
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

  void put(const Pose& reference_from_sensor) {
    source_->put(0, inverse(kReferenceFromTracker) * reference_from_sensor);
    source_->put(1, inverse(kReferenceFromTracker) *
                        Pose{reference_from_sensor.position_m + kToSecond_m, reference_from_sensor.orientation});
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
  }

  std::unique_ptr<acquisition::EmulatorRunner> emulator_;
  acquisition::StandingSource* source_ = nullptr;
};

FIELDTRUE_WINDOW_TEST(EveryTrackerTest)
#include "every_tracker_test.moc"
