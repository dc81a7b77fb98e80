#include "widgets/pages/signal_page.h"

#include <QComboBox>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QTableWidget>
#include <QTest>
#include <cmath>
#include <memory>
#include <random>

#include "acquisition/emulators/fastrak_emulator.h"
#include "tests/support/matchers.h"
#include "tests/widgets/pages/window_driver.h"
#include "widgets/views/charts/sketch_view.h"

/// What a person does on the page Signal with a tracker of two sensors: looks, and moves one of them as shown.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

constexpr int kSoonMs = 20000;

const Pose kFirst{{0.4, 0.1, -0.2}, Eigen::Quaterniond::Identity()};
const Pose kSecond{{0.4, 0.3, -0.2}, Eigen::Quaterniond::Identity()};

/// Sensors that stand where they are put, with noise and a hum that 120 readings a second show at 48 Hz.
class HummingSource : public acquisition::StandingSource {
 public:
  using StandingSource::StandingSource;
  std::vector<Sample> readNow(std::span<const int> sensors, double time_s) override {
    auto samples = StandingSource::readNow(sensors, time_s);
    for (Sample& sample : samples) {
      for (double& x : sample.tracker_from_sensor.position_m) x += noise_(random_);
      sample.tracker_from_sensor.position_m.y() += 5e-5 * std::sin(2.0 * 3.14159265358979 * 72.0 * time_s);
    }
    return samples;
  }

 private:
  std::mt19937_64 random_{5};
  std::normal_distribution<double> noise_{0.0, 3e-5};
};

}  // namespace

class SignalPageTest : public WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase() {
    showWindow();
    click("step_signal");
  }
  void init() {
    auto source = std::make_unique<HummingSource>(std::vector{kFirst, kSecond});
    source_ = source.get();
    emulator_ = std::make_unique<acquisition::EmulatorRunner>(
        std::make_unique<acquisition::FastrakEmulatorCore>(std::move(source), acquisition::FastrakEmulatorOptions{}),
        std::make_unique<acquisition::TcpEndpoint>(quint16{0}));
    FT_VERIFY_OK(emulator_->start());
  }
  void cleanup() {
    window_->workbench().disconnectDevice();
    QTRY_COMPARE(window_->workbench().status().device, acquisition::DeviceState::kClosed);
    emulator_.reset();
  }
  void cleanupTestCase() { closeWindow(); }

  void everySensorIsShown() {
    connectTracker(QString());
    auto* table = find<QTableWidget>("sensorTable");
    QTRY_COMPARE_WITH_TIMEOUT(table->rowCount(), 2, kSoonMs);
    QTRY_VERIFY_WITH_TIMEOUT(table->item(1, 4)->text().endsWith(QStringLiteral(" mm")), kSoonMs);
    QCOMPARE(table->item(0, 1)->text(), QStringLiteral("x 0.400 m   y 0.100 m   z -0.200 m"));
    QCOMPARE(table->item(1, 1)->text(), QStringLiteral("x 0.400 m   y 0.300 m   z -0.200 m"));
    const auto rate_hz = [table] { return table->item(0, 3)->text().section(' ', 0, 0).toDouble(); };
    QTRY_VERIFY2_WITH_TIMEOUT(std::abs(rate_hz() - 60.0) < 1.0, qPrintable(table->item(0, 3)->text()), kSoonMs);
    QCOMPARE(table->item(0, 5)->text(), QStringLiteral("good"));
    QTRY_VERIFY2_WITH_TIMEOUT(answer("hemisphere").contains(QStringLiteral("on its side +x")),
                              qPrintable(answer("hemisphere")), kSoonMs);
    QVERIFY2(answer("warm_up").contains(QStringLiteral("let the sensor lie"), Qt::CaseInsensitive),
             qPrintable(answer("warm_up")));
    // Of 60 readings a second 72 Hz shows at 12.
    QTRY_VERIFY2_WITH_TIMEOUT(answer("noise").contains(QStringLiteral("a line stands out at")),
                              qPrintable(answer("noise")), kSoonMs);
    QTest::qWait(6000);
    picture("3-signal");
  }

  void movesAnswerTheQuestions_data() {
    QTest::addColumn<QString>("hemisphere");
    QTest::addColumn<bool>("is_right");
    QTest::newRow("right") << QStringLiteral("+x") << true;
    QTest::newRow("mirrored") << QStringLiteral("-x") << false;
  }

  void movesAnswerTheQuestions() {
    QFETCH(QString, hemisphere);
    QFETCH(bool, is_right);
    connectTracker(QStringLiteral(",hemisphere=") + hemisphere);
    QTRY_VERIFY2_WITH_TIMEOUT(answer("hemisphere").contains(QStringLiteral("on its side ") + hemisphere),
                              qPrintable(answer("hemisphere")), kSoonMs);
    click("moveButton");
    QTRY_VERIFY2_WITH_TIMEOUT(answer("axes").contains(QStringLiteral("along +x")), qPrintable(answer("axes")), kSoonMs);
    picture(is_right ? "3-signal-move" : "3-signal-move-mirrored");
    Eigen::Vector3d at_m = kFirst.position_m;
    for (int axis = 0; axis < 3; ++axis) {
      at_m[axis] += 0.12;
      source_->put(0, {at_m, kFirst.orientation});
      const QString next = axis == 2 ? QStringLiteral("came out") : QStringLiteral("along +%1").arg(QChar('y' + axis));
      const QString good = QStringLiteral("go where you think");
      QTRY_VERIFY2_WITH_TIMEOUT(answer("axes").contains(next) || (axis == 2 && answer("axes").contains(good)),
                                qPrintable(answer("axes")), kSoonMs);
    }
    picture(is_right ? "3-signal-moved" : "3-signal-mirrored");
    FT_VERIFY_MATCH(
        holdsAll(answer("hemisphere").toStdString(), {is_right ? "came out right-handed" : "came out left-handed"}));
    FT_VERIFY_MATCH(holdsAll(answer("axes").toStdString(),
                             {is_right ? "go where you think" : "+x came out as -x, +y came out as -y"}));
  }

 private:
  QString answer(const char* question) {
    return find<QLabel>(qPrintable(QStringLiteral("answer_") + QLatin1String(question)))->text();
  }
  void connectTracker(const QString& settings) {
    window_->workbench().connectDevice(QStringLiteral("fastrak:") + emulator_->endpoint().address() + settings, {});
    QTRY_COMPARE_WITH_TIMEOUT(window_->workbench().status().device, acquisition::DeviceState::kRunning, kSoonMs);
  }
  std::unique_ptr<acquisition::EmulatorRunner> emulator_;
  acquisition::StandingSource* source_ = nullptr;
};

FIELDTRUE_WINDOW_TEST(SignalPageTest)
#include "signal_page_test.moc"
