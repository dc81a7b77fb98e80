#include <QTest>
#include <memory>

#include "calib/tables/metadata_keys.h"
#include "tests/acquisition/session/controller_bench.h"
#include "tests/acquisition/session/session_folder.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// Which tracker and which set-up a session states.
using namespace fieldtrue;
using namespace fieldtrue::acquisition;

using testing::Bench;
using testing::kRate_hz;
using testing::planOf;

class SessionTrackerTest : public QObject {
  Q_OBJECT

  testing::SessionFolder folder_;

 private slots:
  void metadataComesFromTheDevice() {
    Bench bench(folder_.newPath());
    bench.readTables();
    QVERIFY(bench.table.metadata.tracker == "fake" && bench.table.metadata.rate_hz == kRate_hz);
    QVERIFY(bench.table.metadata.rig == "wooden jig");
    QCOMPARE(*bench.table.metadata.date, std::string("2024-02-29"));
  }

  void aTrackerThatStatesNothingTakesNothingBack() {
    Bench bench(folder_.newPath());
    const auto setup = [&bench] {
      bench.readTables();
      return bench.table.metadata.setup;
    };
    bench.controller.setSetup({{"room", "Lab 9"}, {"sensor_serial", "S7"}});
    bench.controller.setSetupOfTracker({});
    QCOMPARE(setup(), (Setup{{"room", "Lab 9"}, {"sensor_serial", "S7"}}));
    bench.controller.setSetupOfTracker({{"sensor_serial", "S8"}});
    QCOMPARE(setup(), (Setup{{"room", "Lab 9"}, {"sensor_serial", "S8"}}));
    // A person takes back what was said.
    bench.controller.setSetup({});
    QCOMPARE(setup(), (Setup{{"room", "Lab 9"}}));
    bench.controller.openSession(folder_.newPath(), QString::fromStdString(toJson(planOf({2, 1, 1})).dump()));
    QCOMPARE(setup(), Setup());
    QVERIFY2(bench.failures.isEmpty(), qPrintable(bench.failures.join(' ')));
  }

  void anotherTrackerOnTheWayIsTold() {
    const QString path = folder_.newPath();
    {
      Bench first(path);
      first.takeHere();
      QCOMPARE(first.stored.size(), std::size_t{1});
    }
    Bench second(path, {}, false);
    QStringList remarks;
    QObject::connect(&second.controller, &AcquisitionController::remarked,
                     [&](const QString& remark) { remarks << remark; });
    auto other = std::make_unique<testing::FakeTracker>();
    second.tracker = other.get();
    other->tracker_name = QStringLiteral("another");
    second.controller.adoptDevice(std::move(other));
    QCOMPARE(remarks.size(), 1);
    QVERIFY2(remarks[0].contains("begun with fake") && remarks[0].contains("of another") &&
                 remarks[0].contains("one calibration of both is wrong"),
             qPrintable(remarks[0]));
    // The table says so as soon as something was taken with it, and not before.
    second.readTables();
    QVERIFY(!second.table.metadata.other.contains(kOtherTracker));
    second.takeHere();
    QCOMPARE(second.stored.size(), std::size_t{1});
    second.readTables();
    QCOMPARE(QString::fromStdString(second.table.metadata.other[kOtherTracker]), QString("another"));
    QCOMPARE(QString::fromStdString(*second.table.metadata.tracker), QString("fake"));
  }

  void aTrackerThatComesBackAfterItsSessionWasClosedHarmsNothing() {
    const QString path = folder_.newPath();
    {
      Bench first(path);
      first.takeHere();
    }
    Bench second(path, {}, false);
    auto other = std::make_unique<testing::FakeTracker>();
    other->tracker_name = QStringLiteral("another");
    second.controller.adoptDevice(std::move(other));
    second.controller.closeSession();
    QStringList remarks;
    QObject::connect(&second.controller, &AcquisitionController::remarked,
                     [&](const QString& remark) { remarks << remark; });
    auto again = std::make_unique<testing::FakeTracker>();
    again->tracker_name = QStringLiteral("another");
    second.tracker = again.get();
    second.controller.adoptDevice(std::move(again));
    QVERIFY2(remarks.isEmpty(), qPrintable(remarks.join('\n')));
    QVERIFY(second.controller.status().session->places.empty());
  }

  void aTrackerBeforeTheFirstTakeIsForgotten() {
    Bench bench(folder_.newPath());
    QStringList remarks;
    QObject::connect(&bench.controller, &AcquisitionController::remarked,
                     [&](const QString& remark) { remarks << remark; });
    auto other = std::make_unique<testing::FakeTracker>();
    bench.tracker = other.get();
    other->tracker_name = QStringLiteral("another");
    bench.controller.adoptDevice(std::move(other));
    bench.takeHere();
    bench.readTables();
    QCOMPARE(QString::fromStdString(*bench.table.metadata.tracker), QString("another"));
    QVERIFY2(remarks.isEmpty() && !bench.table.metadata.other.contains(kOtherTracker), qPrintable(remarks.join('\n')));
  }
};

FIELDTRUE_TEST(SessionTrackerTest)
#include "session_tracker_test.moc"
