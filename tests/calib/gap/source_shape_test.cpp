#include "calib/gap/source_shape.h"

#include <QTest>
#include <numbers>

#include "calib/gap/diagnosis.h"
#include "tests/calib/gap/diagnosis_checks.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

/// What stands in the room tells its shape by how it answers along each of its axes.
class SourceShapeTest : public QObject {
  Q_OBJECT
 private slots:
  /// Polarizabilities of ideal things in units of the strongest, and what an SD takes away from them.
  void threeAxesTellAShape_data() {
    QTest::addColumn<QVector<double>>("values");
    QTest::addColumn<double>("sd");
    QTest::addColumn<QByteArray>("shape");
    QTest::newRow("ball that conducts") << QVector<double>{-1, -1, -1} << 0.05 << QByteArray("body");
    QTest::newRow("block of iron") << QVector<double>{1, 0.8, 0.7} << 0.05 << QByteArray("body");
    QTest::newRow("sheet or loop") << QVector<double>{-1, 0, 0} << 0.05 << QByteArray("flat_or_loop");
    QTest::newRow("pipe") << QVector<double>{-1, -1, -0.1} << 0.05 << QByteArray("long_conductor");
    QTest::newRow("bar of iron") << QVector<double>{1, 0.1, 0.1} << 0.05 << QByteArray("iron_bar");
    QTest::newRow("sheet of iron") << QVector<double>{1, 0.9, 0.1} << 0.05 << QByteArray("iron_sheet");
    QTest::newRow("of two minds") << QVector<double>{-1, 0.9, 0} << 0.05 << QByteArray("unclear");
    QTest::newRow("too faint for its other axes") << QVector<double>{-1, 0, 0} << 0.28 << QByteArray("unclear");
    QTest::newRow("noise") << QVector<double>{-1, -1, -1} << 0.4 << QByteArray("unclear");
  }
  void threeAxesTellAShape() {
    QFETCH(QVector<double>, values);
    QFETCH(double, sd);
    QFETCH(QByteArray, shape);
    const Shape found =
        shapeOf({values[0], values[1], values[2]}, Eigen::Vector3d::Constant(sd), identify::Thresholds{}.silent_axis);
    QCOMPARE(QByteArray(idOf(found).data()), shape);
  }

  void thingsInARoomTellTheirShape_data() {
    QTest::addColumn<QByteArray>("effect");
    QTest::addColumn<QByteArray>("parameters");
    QTest::addColumn<QByteArray>("shape");
    QTest::newRow("ball") << QByteArray("compact_metal")
                          << QByteArray(R"({"center_m": [0.7, 0.1, -0.6], "radius_m": 0.25})") << QByteArray("body");
    QTest::newRow("loop") << QByteArray("closed_loop")
                          << QByteArray(R"({"center_m": [0.7, 0.1, -0.6], "normal": [0, 0, 1], "radius_m": 0.3})")
                          << QByteArray("flat_or_loop");
    QTest::newRow("bar of iron") << QByteArray("compact_metal") << QByteArray(R"({"center_m": [0.7, 0.1, -0.6],
                                                   "polarizability_m3": [0.2, 0, 0, 0, 0.01, 0, 0, 0, 0.01]})")
                                 << QByteArray("iron_bar");
    QTest::newRow("pipe") << QByteArray("compact_metal") << QByteArray(R"({"center_m": [0.7, 0.1, -0.6],
                                            "polarizability_m3": [-0.01, 0, 0, 0, -0.15, 0, 0, 0, -0.15]})")
                          << QByteArray("long_conductor");
    QTest::newRow("sheet of iron") << QByteArray("finite_plate")
                                   << QByteArray(R"({"center_m": [0.7, 0.1, -0.6], "length_m": 0.5, "width_m": 0.5,
                                                     "material": "ferromagnetic"})")
                                   << QByteArray("iron_sheet");
  }
  void thingsInARoomTellTheirShape() {
    QFETCH(QByteArray, effect);
    QFETCH(QByteArray, parameters);
    QFETCH(QByteArray, shape);
    const Withheld made = withheldFrom(effect.toStdString(), parameters.toStdString());
    const auto report = diagnose(made.table, nullptr, &made.believed);
    FT_VERIFY_OK(report);
    QVERIFY(report->source_shape.has_value());
    QVERIFY2(idOf(report->source_shape->shape) == shape.toStdString(),
             qPrintable(QString::fromStdString(sourceShapeText(*report->source_shape))));
    FT_VERIFY_MATCH(near(report->source_shape->center_m, {0.7, 0.1, -0.6}, 0.15));
  }

  /// A ball of radius a has -2 pi a^3 along every axis (Wait 1951); within 3.3 SDs each, 99.9 %.
  void aBallHasThePolarizabilityOfABall() {
    const double radius_m = 0.25;
    const Withheld made = withheldFrom("compact_metal", R"({"center_m": [0.7, 0.1, -0.6], "radius_m": 0.25})");
    const auto report = diagnose(made.table, nullptr, &made.believed);
    FT_VERIFY_OK(report);
    QVERIFY(report->source_shape.has_value());
    const double ball_m3 = -2.0 * std::numbers::pi * radius_m * radius_m * radius_m;
    for (int k = 0; k < 3; ++k) {
      const double off = (report->source_shape->values_m3[k] - ball_m3) / report->source_shape->sds_m3[k];
      QVERIFY2(std::abs(off) < 3.3, qPrintable(QString::number(off)));
      QVERIFY(report->source_shape->sds_m3[k] < 0.1 * std::abs(ball_m3));
    }
  }

  /// The image of the transmitter in a plane is a dipole at twice its distance d, whose moment is -4 pi (2 d)^3 times
  /// the field there across the plane's normal and half of that along it: above 0.4, so that a floor would pass for a
  /// block. Where a plane is named, alone or beside a body, nothing is told.
  void aPlaneIsNoBlock_data() {
    QTest::addColumn<QByteArray>("beside");
    QTest::newRow("floor") << QByteArray();
    QTest::newRow("floor and ball") << QByteArray(R"({"center_m": [0.7, 0.1, -0.6], "radius_m": 0.25})");
  }
  void aPlaneIsNoBlock() {
    QFETCH(QByteArray, beside);
    QVERIFY(shapeOf({-1.0, -1.0, -0.5}, Eigen::Vector3d::Constant(0.01), identify::Thresholds{}.silent_axis) ==
            Shape::kBody);
    const simulation::Scene believed = gapScene();
    simulation::Scene actual = believed;
    actual.effects.push_back({"metal_plane", nlohmann::json::parse(R"({"toward": [0, 0, -1], "distance_m": 1.2})")});
    if (!beside.isEmpty()) actual.effects.push_back({"compact_metal", nlohmann::json::parse(beside.toStdString())});
    const auto report = diagnose(recordedIn(actual, gapPlan()), nullptr, &believed);
    FT_VERIFY_OK(report);
    const auto is_plane = [](const SelectedEffect& effect) { return effect.effect == "metal_plane"; };
    QVERIFY(std::any_of(report->selected.begin(), report->selected.end(), is_plane));
    QVERIFY(!report->source_shape.has_value());
  }

  void aSentenceHasNoMinusNothing() {
    SourceShape shape;
    shape.shape = Shape::kFlatOrLoop;
    shape.axes.col(0) = Eigen::Vector3d(0.6, -0.001, 0.8);
    QVERIFY(sourceShapeText(shape).find("(0.6, 0, 0.8)") != std::string::npos);
  }

  void withoutAThingInTheRoomThereIsNoShape() {
    const simulation::Scene scene = gapScene();
    const auto report = diagnose(recordedIn(scene, gapPlan()), nullptr, &scene);
    FT_VERIFY_OK(report);
    QVERIFY(!report->source_shape.has_value());
  }
};

FIELDTRUE_TEST(SourceShapeTest)
#include "source_shape_test.moc"
