#include "calib/core/setup.h"

#include <QTest>
#include <algorithm>
#include <sstream>

#include "calib/tables/table_io.h"
#include "calib/tables/table_setup.h"
#include "calib/tables/table_writer.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;

class SetupTest : public QObject {
  Q_OBJECT
 private slots:
  void anUnknownValueIsNotStated() {
    Setup setup;
    FT_VERIFY_OK(state(setup, "room", "  Lab 2 "));
    QCOMPARE(setup.at("room"), std::string("Lab 2"));
    FT_VERIFY_OK(state(setup, "room", "Unknown"));
    QVERIFY(setup.empty());
    const auto refused = state(setup, "colour", "red");
    QVERIFY(!refused);
    QVERIFY(refused.error().message.find("transmitter_serial") != std::string::npos);
  }

  void matches_data() {
    QTest::addColumn<QString>("calibrated");
    QTest::addColumn<QString>("readings");
    QTest::addColumn<QString>("expected");
    QTest::newRow("nothing is stated") << ""
                                       << ""
                                       << "unknown";
    QTest::newRow("one side states") << "room=A"
                                     << ""
                                     << "unknown";
    QTest::newRow("the other side states") << ""
                                           << "room=A"
                                           << "unknown";
    QTest::newRow("the same") << "room=A"
                              << "room=a"
                              << "yes";
    QTest::newRow("more is known of the readings") << "room=A"
                                                   << "room=A;filter=off"
                                                   << "yes";
    QTest::newRow("less is known of the readings") << "room=A;filter=off"
                                                   << "room=A"
                                                   << "unknown";
    QTest::newRow("one fact differs") << "room=A;filter=off"
                                      << "room=A;filter=on"
                                      << "no";
    QTest::newRow("another day is no other set-up") << "room=A;date=2026-01-01"
                                                    << "room=A;date=2026-02-01"
                                                    << "yes";
    QTest::newRow("the day alone tells nothing") << "date=2026-01-01"
                                                 << "date=2026-01-01"
                                                 << "unknown";
  }
  void matches() {
    QFETCH(QString, calibrated);
    QFETCH(QString, readings);
    QFETCH(QString, expected);
    QCOMPARE(QString::fromStdString(std::string(nameOf(match(of(calibrated), of(readings))))), expected);
  }

  void tablesCarryIt() {
    std::istringstream text(
        "# setup.room: Lab 2\n# setup.tracker_serial: unknown\n# setup.rom: Lab 3\n# date: 2026-05-01\n"
        "node,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m,sensor\n0,0,0,0,0,0,0,3\n1,1,0,0,1,0,0,3\n");
    const auto read = readNodeTable(text, "t.csv");
    FT_VERIFY_OK(read);
    const Setup expected{{"room", "Lab 2"}};
    QVERIFY(read->table.metadata.setup == expected);
    const Setup whole{{"date", "2026-05-01"}, {"room", "Lab 2"}, {"sensor", "3"}};
    QVERIFY(setupOf(read->table) == whole);
    const bool is_told = std::any_of(read->notes.begin(), read->notes.end(), [](const std::string& note) {
      return note.find("the metadata setup.rom is not known and changes nothing; is setup.room meant?") !=
             std::string::npos;
    });
    QVERIFY(is_told);
    std::ostringstream written;
    writeNodeTable(written, read->table);
    QVERIFY(written.str().find("# setup.room: Lab 2\n") != std::string::npos);
    QVERIFY(written.str().find("# setup.rom: Lab 3\n") != std::string::npos);
  }

 private:
  static Setup of(const QString& text) {
    Setup setup;
    for (const QString& part : text.split(QLatin1Char(';'), Qt::SkipEmptyParts)) {
      const auto stated = state(setup, part.section('=', 0, 0).toStdString(), part.section('=', 1).toStdString());
      FT_CHECK(stated.has_value());
    }
    return setup;
  }
};

FIELDTRUE_TEST(SetupTest)
#include "setup_test.moc"
