#include <QTemporaryDir>
#include <QTest>

#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// `signal` as a script reads it, and what it says where nothing can be heard.
using namespace fieldtrue;
using namespace fieldtrue::testing;

class CliSignalTest : public QObject {
  Q_OBJECT
 private slots:
  void aRecordingOfTwoSensors() {
    // A second of each is at rest at 50 a second; x of sensor 1 goes up and down by 0.2 mm: an SD of 0.2 mm.
    QByteArray table = "node,sensor,visit,t_s,x_m,y_m,z_m,qw,qx,qy,qz,status\n";
    for (int i = 0; i < 1000; ++i) {
      const QByteArray t_s = QByteArray::number(i / 50.0, 'f', 2);
      table += "-1,0,0," + t_s + ",0.3,0.0,0.4,1,0,0,0," + (i % 10 == 0 ? "k" : "") + "\n";
      table += "-1,1,0," + t_s + "," + (i % 2 == 0 ? "0.5002" : "0.4998") + ",0.0,0.0,1,0,0,0,\n";
    }
    const QString file = folder_.filePath("two.samples.csv");
    QVERIFY(writeWhole(file, table));
    const CliRun run = runCli({"signal", "--device", "trace:" + file + ",rate=50", "--seconds", "15", "--json"});
    FT_VERIFY_STATUS(run, 0);
    const auto told = run.json();
    QCOMPARE(told.at("schema").get<std::string>(), std::string("fieldtrue.signal/1"));
    const auto& sensors = told.at("sensors");
    QCOMPARE(sensors.size(), std::size_t{2});
    // 15 s at 50 a second; the one at 15 s is too late.
    QCOMPARE(sensors[0].at("readings").get<int>(), 750);
    QCOMPARE(sensors[0].at("marks").at("k").get<int>(), 75);
    QVERIFY(std::abs(sensors[0].at("rate_hz").get<double>() - 50.0) < 1e-6);
    QCOMPARE(sensors[0].at("answers").at("noise").at("verdict").get<std::string>(), std::string("look"));
    QVERIFY(std::abs(sensors[1].at("position_m")[0].get<double>() - 0.5) < 1e-6);
    QVERIFY(std::abs(sensors[1].at("sd_m")[0].get<double>() - 2e-4) < 2e-6);
    QVERIFY(sensors[1].at("expected_sd_m").is_null());
    // The same bytes whenever it is played.
    const CliRun again = runCli({"signal", "--device", "trace:" + file + ",rate=80", "--seconds", "15", "--json"});
    QCOMPARE(again.out, run.out);
    const CliRun people = runCli({"signal", "--device", "trace:" + file + ",rate=50"});
    FT_VERIFY_STATUS(people, 0);
    FT_VERIFY_MATCH(holdsAll(people.out.toStdString(),
                             {"Sensor 0  50.0 Hz, 50 readings marked k", "Sensor 1  50.0 Hz",
                              "Still warming up? let the sensor lie for a minute", "every reading is the same"}));
  }

  void nothingToHear() {
    const CliRun run = runCli({"signal", "--device", "fastrak:/dev/ttyUSB77"});
    FT_VERIFY_STATUS(run, 1);
    QVERIFY2(run.err.contains("does not exist"), run.err.constData());
    FT_VERIFY_STATUS(runCli({"signal", "--device", "sonar"}), 2);
  }

 private:
  QTemporaryDir folder_;
};

FIELDTRUE_TEST(CliSignalTest)
#include "cli_signal_test.moc"
