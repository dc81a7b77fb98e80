#include <QTemporaryDir>
#include <QTest>
#include <QThread>
#include <algorithm>

#include "acquisition/session/acquisition_controller.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;

class SimulatedSessionTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;
  QString newPath() { return folder_.filePath("simulated.fieldtrue"); }

 private slots:
  /// The simulated tracker, in a worker thread as in the window: emulated Fastrak, virtual operator, automatic mode.
  void simulatedTrackerRecordsAPlanByItself() {
    qRegisterMetaType<AcquisitionStatus>();
    qRegisterMetaType<Node>();
    qRegisterMetaType<CalibrationTable>();
    qRegisterMetaType<SampleTable>();
    QThread thread;
    auto* controller = new AcquisitionController;
    controller->moveToThread(&thread);
    connect(&thread, &QThread::finished, controller, &QObject::deleteLater);
    std::vector<Node> nodes;
    QStringList troubles;
    bool finished = false;
    SampleTable samples;
    connect(controller, &AcquisitionController::nodesStored, this,
            [&](int, const std::vector<Node>& rows) { nodes.insert(nodes.end(), rows.begin(), rows.end()); });
    connect(controller, &AcquisitionController::failed, this, [&](const QString& text) { troubles << text; });
    connect(controller, &AcquisitionController::takeFailed, this, [&](const QString& text) { troubles << text; });
    connect(controller, &AcquisitionController::finished, this, [&] { finished = true; });
    connect(controller, &AcquisitionController::tablesReady, this,
            [&](const CalibrationTable&, const SampleTable& all) { samples = all; });
    thread.start();
    const QString path = newPath();
    const QString plan = "grid:2x2x2@0.2:reseat=2";
    QMetaObject::invokeMethod(controller, [=] {
      controller->openSession(path, plan);
      controller->setAutomatic(true);
      controller->connectDevice("simulated:speed=10,seed=1", {});
    });
    QTRY_VERIFY2_WITH_TIMEOUT(finished, qPrintable(troubles.join('\n')), 120000);
    QMetaObject::invokeMethod(controller, [=] {
      controller->requestTables();
      controller->disconnectDevice();
      controller->closeSession();
    });
    QTRY_VERIFY_WITH_TIMEOUT(!samples.rows.empty(), 10000);
    const auto at_places =
        std::count_if(samples.rows.begin(), samples.rows.end(), [](const SampleRow& row) { return row.node >= 0; });
    QCOMPARE(at_places, 16 * 60);
    thread.quit();
    QVERIFY(thread.wait());
    QVERIFY2(troubles.isEmpty(), qPrintable(troubles.join('\n')));
    QCOMPARE(nodes.size(), std::size_t{16});
    for (const Node& node : nodes) {
      // A clean room: what is left is the tracker's noise and the Fastrak's resolution, well below a centimetre here.
      FT_VERIFY_MATCH(testing::near(node.tracker_from_sensor.position_m, node.reference_from_sensor.position_m, 0.01));
    }
  }
};

FIELDTRUE_TEST(SimulatedSessionTest)
#include "simulated_session_test.moc"
