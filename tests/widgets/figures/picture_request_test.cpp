#include "widgets/figures/picture_request.h"

#include <QTest>
#include <cmath>
#include <limits>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;
using namespace fieldtrue::widgets;

namespace {

/// Every member away from its default.
PictureRequest fieldRequest() {
  BelievedBody body{effects::DrawnShape::kPlate,
                    "Steel \xC2\xB1",
                    {0.1, 0.2, 0.3},
                    {0.0, 1.0, 0.0},
                    {0.0, 0.0, 1.0},
                    0.4,
                    0.5,
                    0.6,
                    Eigen::Matrix3d::Constant(0.7),
                    -0.8,
                    0.9};
  FieldArrow arrow;
  arrow.from_m = {1.0 / 3.0, -2.0, std::numeric_limits<double>::denorm_min()};
  arrow.error_m = {std::nan(""), std::numeric_limits<double>::infinity(), -0.0};
  arrow.node = -7;
  arrow.angle_deg = 1.5;
  arrow.validation = arrow.flagged = true;
  arrow.better_mm = -0.25;
  arrow.rotation_axis = Eigen::Vector3d{1.0, 2.0, 3.0};
  arrow.name = QStringLiteral("C4, pipe 3");
  ErrorField field{QStringLiteral("Before"), {arrow, FieldArrow{}}, {{1.0, 2.0, 3.0}, {0.5, 0.5, -0.5, 0.5}}, {body}};
  return {FieldPicture{field, 12.5, 3.0}, 900, 700, true};
}

PictureRequest roomRequest() {
  PlannedPlace place;
  place.node = 3;
  place.visit = 2;
  place.index = {1, 2, 3};
  place.reference_from_sensor.position_m = {0.1, 0.2, 0.3};
  place.role = NodeRole::kValidation;
  return {RoomPicture{{place}, {acquisition::PlaceState::kSuspicious}, {}}, 10, 20, false};
}

PictureRequest histogramRequest() {
  return {HistogramPicture{{QStringLiteral("Before"), QStringLiteral("After")}, {{1.0, 2.0}, {}}, QStringLiteral("mm")},
          30, 40, false};
}

}  // namespace

class PictureRequestTest : public QObject {
  Q_OBJECT

 private slots:
  /// Bytes that come back as the same bytes have lost nothing; the members that matter most are looked at too.
  void whatIsWrittenIsRead() {
    const std::vector<PictureRequest> asked = {fieldRequest(), roomRequest(), histogramRequest()};
    const auto read = requestsFromBytes(toBytes(asked));
    FT_VERIFY_OK(read);
    QCOMPARE(read->size(), std::size_t{3});
    const auto& field = std::get<FieldPicture>(read->at(0).content);
    QCOMPARE(field.scale_max_mm, 12.5);
    QCOMPARE(read->at(0).width_px, 900);
    QVERIFY(read->at(0).dark);
    QCOMPARE(field.field.arrows.size(), std::size_t{2});
    const FieldArrow& arrow = field.field.arrows[0];
    QVERIFY(arrow.from_m == Eigen::Vector3d(1.0 / 3.0, -2.0, std::numeric_limits<double>::denorm_min()));
    QVERIFY(std::isnan(arrow.error_m.x()) && std::isinf(arrow.error_m.y()) && std::signbit(arrow.error_m.z()));
    QCOMPARE(arrow.better_mm.value(), -0.25);
    QVERIFY(!arrow.uncertainty_mm);
    QCOMPARE(arrow.name, QStringLiteral("C4, pipe 3"));
    QVERIFY(!field.field.arrows[1].rotation_axis);
    QVERIFY(field.field.reference_from_tracker.orientation.coeffs() == Eigen::Vector4d(0.5, -0.5, 0.5, 0.5));
    QVERIFY(field.field.bodies.at(0).shape == effects::DrawnShape::kPlate);
    QCOMPARE(field.field.bodies.at(0).name, std::string("Steel \xC2\xB1"));
    QCOMPARE(field.field.bodies.at(0).farthest_m.value(), 0.9);
    const auto& room = std::get<RoomPicture>(read->at(1).content);
    QCOMPARE(room.places.at(0).visit, 2);
    QVERIFY(room.places.at(0).role == NodeRole::kValidation);
    QVERIFY(room.states.at(0) == acquisition::PlaceState::kSuspicious);
    const auto& histogram = std::get<HistogramPicture>(read->at(2).content);
    QCOMPARE(histogram.names.at(1), QStringLiteral("After"));
    QCOMPARE(histogram.values_mm.at(0).at(1), 2.0);
  }

  void picturesComeBackAndReasonsToo() {
    const std::vector<Result<QByteArray>> drawn = {QByteArray("\x89PNG\0 and so on", 15),
                                                   fail(ErrorCode::kUnsupported, "no way to draw")};
    const auto read = picturesFromBytes(toBytes(drawn));
    FT_VERIFY_OK(read);
    QCOMPARE(read->size(), std::size_t{2});
    QCOMPARE(read->at(0).value(), drawn[0].value());
    QCOMPARE(read->at(1).error().message, std::string("no way to draw"));
  }

  void bytesCutAnywhereAreRefused() {
    const QByteArray whole = toBytes(std::vector{fieldRequest(), roomRequest(), histogramRequest()});
    for (qsizetype size = 0; size < whole.size(); ++size)
      QVERIFY2(!requestsFromBytes(whole.first(size)), qPrintable(QString::number(size)));
    QVERIFY(!requestsFromBytes(whole + '\0'));
  }

  void damagedBytesAreReadOrRefused() {
    const QByteArray whole = toBytes(std::vector{fieldRequest(), roomRequest(), histogramRequest()});
    for (qsizetype i = 0; i < whole.size(); ++i) {
      QByteArray damaged = whole;
      damaged[i] = static_cast<char>(damaged[i] ^ 0xFF);
      const auto read = requestsFromBytes(damaged);
      if (!read) continue;
      // What was accepted is a whole value: it comes back as itself.
      const QByteArray written = toBytes(*read);
      QCOMPARE(toBytes(*requestsFromBytes(written)), written);
    }
  }

  /// Behind the version (its length and text) and the number of requests stands the first one's kind.
  void aPictureOfNoKnownKindIsRefused() {
    QByteArray bytes = toBytes(std::vector{histogramRequest()});
    const qsizetype kind_at =
        bytes.indexOf("fieldtrue pictures") + QByteArray("fieldtrue pictures " FIELDTRUE_VERSION).size() + 4;
    QCOMPARE(bytes.mid(kind_at, 4), QByteArray("\0\0\0\1", 4));
    bytes[kind_at + 3] = 3;
    QVERIFY(!requestsFromBytes(bytes));
  }

  void anotherVersionIsNamed() {
    const auto read = requestsFromBytes(QByteArray("nothing of ours"));
    QVERIFY(!read);
    FT_VERIFY_MATCH(holdsAll(read.error().message, {"not of one version"}));
  }
};

FIELDTRUE_TEST(PictureRequestTest)
#include "picture_request_test.moc"
