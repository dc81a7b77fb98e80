#include <QComboBox>
#include <QLabel>
#include <QPushButton>
#include <QTest>
#include <random>

#include "calib/tables/table_writer.h"
#include "tests/support/matchers.h"
#include "tests/widgets/pages/window_driver.h"

/// A take whose time is over, on the page where places are taken, in the real window: the operator is asked in large
/// letters, and answers by a key, by a button or by the choice made with the plan.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

constexpr int kNoisyRate_hz = 60;
constexpr double kNoisyFor_s = 200.0;
constexpr int kNoisyFaster = 10;

/// A sensor that lies still, with so much noise that its mean is not known to a micrometre for hours.
SampleTable noisy() {
  SampleTable table;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0.0, 1e-3);
  for (int n = 0; n < kNoisyFor_s * kNoisyRate_hz; ++n) {
    const Eigen::Vector3d noise_m(normal(random), normal(random), normal(random));
    const Pose pose{Eigen::Vector3d(0.4, 0.0, 0.1) + noise_m, Eigen::Quaterniond::Identity()};
    table.rows.push_back({-1, 0, {n / static_cast<double>(kNoisyRate_hz), 0, pose, {}}});
  }
  return table;
}

}  // namespace

class HeldTakeWindowTest : public WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase() {
    showWindow();
    window_->activateWindow();
    recording_ = folder_.filePath("noisy.samples.csv");
    FT_VERIFY_OK(writeSampleTable(std::filesystem::path(recording_.toStdString()), noisy()));
  }
  void cleanupTestCase() { closeWindow(); }

  void theOperatorIsAskedInLargeLetters() {
    hold();
    if (QTest::currentTestFailed()) return;
    QCOMPARE(find<QLabel>("bannerPlace")->text(), QString("Time is up - what now?"));
    QVERIFY(find<QLabel>("bannerPosition")->text().startsWith("at "));
    QVERIFY2(find<QLabel>("bannerReason")->text().contains("not to 0.001 mm, after 30 s. Carrying the jig on keeps it"),
             qPrintable(find<QLabel>("bannerReason")->text()));
    QVERIFY(find<QWidget>("banner")->property("state") == "attention");
    for (const char* button : {"keepTake", "waitLonger", "takeAgain", "skipHeld"}) {
      QVERIFY(find<QPushButton>(button)->isVisible() && find<QPushButton>(button)->isEnabled());
      // Letters for 3 m: the reason's.
      QVERIFY(find<QPushButton>(button)->font().pixelSize() >= window_->height() / 30);
    }
    QVERIFY(!find<QPushButton>("take")->isEnabled());
    QVERIFY2(find<QPushButton>("keepTake")->property("primary").toBool(), "what the space bar does stands out");
    picture("held-take");
    theAnswersStayInATallWindow();
    QTest::keyClick(window_.get(), Qt::Key_Escape);
    QTRY_VERIFY(!find<QWidget>("heldTake")->isVisible());
    QCOMPARE(status().recorded->n_done, std::size_t{0});
    // Where it takes by itself, the operator is told how it goes on.
    window_->workbench().setAutomatic(true);
    QTRY_COMPARE(find<QLabel>("bannerReason")->text(),
                 QString("stopped: lift the sensor and set it down again; or press space"));
    picture("stopped-take");
    window_->workbench().setAutomatic(false);
  }

  void aKeyAnswers_data() {
    QTest::addColumn<int>("key");
    QTest::addColumn<QByteArray>("answer");
    QTest::newRow("space keeps") << static_cast<int>(Qt::Key_Space) << QByteArray("keep");
    QTest::newRow("page down keeps") << static_cast<int>(Qt::Key_PageDown) << QByteArray("keep");
    QTest::newRow("W waits") << static_cast<int>(Qt::Key_W) << QByteArray("wait");
    QTest::newRow("page up waits") << static_cast<int>(Qt::Key_PageUp) << QByteArray("wait");
    QTest::newRow("R takes again") << static_cast<int>(Qt::Key_R) << QByteArray("again");
    QTest::newRow("S skips") << static_cast<int>(Qt::Key_S) << QByteArray("skip");
  }
  void aKeyAnswers() {
    QFETCH(int, key);
    QFETCH(QByteArray, answer);
    hold();
    if (QTest::currentTestFailed()) return;
    QTest::keyClick(window_.get(), static_cast<Qt::Key>(key));
    expect(answer);
  }

  void aButtonAnswers_data() {
    QTest::addColumn<QByteArray>("button");
    QTest::addColumn<QByteArray>("answer");
    QTest::newRow("keep") << QByteArray("keepTake") << QByteArray("keep");
    QTest::newRow("wait") << QByteArray("waitLonger") << QByteArray("wait");
    QTest::newRow("again") << QByteArray("takeAgain") << QByteArray("again");
    QTest::newRow("skip") << QByteArray("skipHeld") << QByteArray("skip");
  }
  void aButtonAnswers() {
    QFETCH(QByteArray, button);
    QFETCH(QByteArray, answer);
    hold();
    if (QTest::currentTestFailed()) return;
    click(button.constData());
    expect(answer);
  }

  void thePlanSaysWhatBecomesOfIt_data() {
    QTest::addColumn<int>("choice");
    QTest::addColumn<QByteArray>("answer");
    QTest::newRow("keep") << static_cast<int>(acquisition::AtTimeLimit::kKeep) << QByteArray("keep");
    QTest::newRow("skip") << static_cast<int>(acquisition::AtTimeLimit::kSkip) << QByteArray("skip");
  }
  void thePlanSaysWhatBecomesOfIt() {
    QFETCH(int, choice);
    QFETCH(QByteArray, answer);
    auto* at_time_limit = find<QComboBox>("atTimeLimit");
    QCOMPARE(at_time_limit->currentData().toInt(), static_cast<int>(acquisition::AtTimeLimit::kAsk));
    at_time_limit->setCurrentIndex(at_time_limit->findData(choice));
    begin();
    window_->workbench().take();
    expect(answer);
    QVERIFY(!find<QWidget>("heldTake")->isVisible());
    at_time_limit->setCurrentIndex(at_time_limit->findData(static_cast<int>(acquisition::AtTimeLimit::kAsk)));
  }

 private:
  /// Letters grow with the height, and have the width that there is.
  void theAnswersStayInATallWindow() {
    const QSize size = window_->size();
    window_->resize(size.width(), 980);
    const auto right = [this] {
      const auto* last = find<QPushButton>("skipHeld");
      return last->mapTo(find<QWidget>("heldTake"), QPoint(last->width(), 0)).x();
    };
    QTRY_VERIFY(window_->height() == 980 && right() <= find<QWidget>("heldTake")->width());
    for (const char* button : {"keepTake", "waitLonger", "takeAgain", "skipHeld"})
      QTRY_VERIFY(find<QPushButton>(button)->width() >= find<QPushButton>(button)->sizeHint().width());
    picture("held-take-tall");
    window_->resize(size);
    QTRY_COMPARE(window_->size(), size);
  }
  const acquisition::AcquisitionStatus& status() { return window_->workbench().status(); }

  void begin() {
    acquisition::Plan plan;
    plan.counts = {2, 1, 1};
    Workbench& workbench = window_->workbench();
    const QString path = folder_.filePath(QStringLiteral("held-%1.fieldtrue").arg(n_sessions_++));
    workbench.createSession(path, plan, {acquisition::TakeLength::Until::kStandardError, 1e-6});
    QTRY_COMPARE_WITH_TIMEOUT(status().session->path, path, 60000);
    workbench.connectDevice(QStringLiteral("trace:%1,rate=%2").arg(recording_).arg(kNoisyFaster), {});
    QTRY_VERIFY_WITH_TIMEOUT(status().still, 60000);
    click("step_acquire");
    window_->activateWindow();
  }
  /// A take whose time has just run out.
  void hold() {
    begin();
    if (QTest::currentTestFailed()) return;
    window_->workbench().take();
    QTRY_COMPARE_WITH_TIMEOUT(status().take, acquisition::TakeState::kHeld, 60000);
    QTRY_VERIFY(find<QWidget>("heldTake")->isVisible());
  }
  void expect(const QByteArray& answer) {
    if (answer == "keep") {
      QTRY_COMPARE_WITH_TIMEOUT(status().recorded->n_done, std::size_t{1}, 20000);
      QVERIFY(status().recorded->states[0] == acquisition::PlaceState::kSuspicious);
    } else if (answer == "skip") {
      QTRY_COMPARE_WITH_TIMEOUT(status().recorded->n_skipped, std::size_t{1}, 20000);
    } else {
      // What it had is 30 s of 60 readings: more come with it, or all come anew, to be held at as many again.
      if (answer == "wait") {
        QTRY_VERIFY_WITH_TIMEOUT(status().collected >= 1900, 60000);
      } else {
        QTRY_VERIFY(status().take == acquisition::TakeState::kCollecting && status().collected < 1800);
      }
      window_->workbench().cancelTake();
    }
  }

  QString recording_;
  int n_sessions_ = 0;
};

FIELDTRUE_WINDOW_TEST(HeldTakeWindowTest)
#include "held_take_window_test.moc"
