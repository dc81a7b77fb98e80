#include <Eigen/LU>
#include <QTest>

#include "calib/gap/diagnosis.h"
#include "tests/calib/gap/diagnosis_checks.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

/// What stands in the room, withheld from the diagnosis and strong, is named, placed, and gone once it is added.
class DiagnosisRoomTest : public QObject {
  Q_OBJECT
 private slots:
  void namesWhatWasWithheld_data() {
    QTest::addColumn<QByteArray>("effect");
    QTest::addColumn<QByteArray>("parameters");
    QTest::newRow("compact metal") << QByteArray("compact_metal")
                                   << QByteArray(R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.15})");
    QTest::newRow("floor") << QByteArray("metal_plane") << QByteArray(R"({"distance_m": 1.5})");
    QTest::newRow("plate") << QByteArray("finite_plate")
                           << QByteArray(R"({"center_m": [0.7, 0.1, -0.9], "length_m": 0.8, "width_m": 0.8})");
    QTest::newRow("loop") << QByteArray("closed_loop")
                          << QByteArray(R"({"center_m": [0.8, 0.75, 0.2], "normal": [0, 1, 0], "radius_m": 0.3})");
    QTest::newRow("metal moved") << QByteArray("metal_moved")
                                 << QByteArray(R"({"center_m": [1.2, 0.5, 0.3], "radius_m": 0.15, "change_s": 200})");
  }
  void namesWhatWasWithheld() {
    QFETCH(QByteArray, effect);
    QFETCH(QByteArray, parameters);
    const Withheld made = withheldFrom(effect.toStdString(), parameters.toStdString());
    const auto report = diagnose(made.table, nullptr, &made.believed);
    FT_VERIFY_OK(report);
    FT_VERIFY_MATCH(names(*report, effect.toStdString()));
    QVERIFY(report->origin.room > report->origin.sensor && report->origin.room > report->origin.transmitter);
    QVERIFY2(report->remaining.fraction <= 0.1, qPrintable(QString::number(report->remaining.fraction)));
    FT_VERIFY_MATCH(isSettled(*report, made));
  }

  /// Within what its own covariance allows (chi-square of three dimensions, 99.9 %), and that within 0.15 m.
  void placesACompactBody() {
    const Withheld made = withheldFrom("compact_metal", R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.15})");
    const auto report = diagnose(made.table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY(!report->selected.empty() && report->selected.front().location_m);
    const SelectedEffect& body = report->selected.front();
    FT_VERIFY_MATCH(near(*body.location_m, {1.3, 0.5, 0.3}, 0.15));
    QVERIFY(body.location_covariance_m2.has_value());
    const Eigen::Vector3d off_m = *body.location_m - Eigen::Vector3d(1.3, 0.5, 0.3);
    const double distance2 = off_m.dot(body.location_covariance_m2->inverse() * off_m);
    QVERIFY2(distance2 < 16.3, qPrintable(QString::number(distance2)));
    QCOMPARE(report->selected.front().material.value_or(""), std::string("conductive"));
  }
};

FIELDTRUE_TEST(DiagnosisRoomTest)
#include "diagnosis_room_test.moc"
