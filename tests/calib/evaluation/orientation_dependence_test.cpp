#include "calib/evaluation/orientation/orientation_dependence.h"

#include <Eigen/Eigenvalues>
#include <QTest>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>

#include "calib/importers/importer.h"
#include "calib/importers/registry.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/real_data.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

/// Error of a place and a true orientation, tracker frame: rotation vector [rad], or shift [m].
using ErrorLaw = std::function<Eigen::Vector3d(const Eigen::Vector3d& p_m, const Eigen::Quaterniond& q)>;

Eigen::Vector3d placeOnly(const Eigen::Vector3d& p_m, const Eigen::Quaterniond&) {
  return {0.05 * std::sin(2.0 * p_m.x()) + 0.02, 0.04 * p_m.y() * p_m.z(), 0.03 * std::cos(3.0 * p_m.x() + p_m.y())};
}

/// As from a sensor with unequal coils: the direction in which it sees the transmitter is bent by its gains.
Eigen::Vector3d unequalCoils(const Eigen::Vector3d& p_m, const Eigen::Quaterniond& q) {
  const Eigen::Matrix3d R = q.toRotationMatrix();
  const Eigen::Vector3d seen = R.transpose() * p_m.normalized();
  const Eigen::Vector3d bent = Eigen::Vector3d(0.06, -0.04, -0.02).cwiseProduct(seen);
  return placeOnly(p_m, q) + R * seen.cross(bent);
}

/// Proportional to the turn itself.
Eigen::Vector3d turnedShort(const Eigen::Vector3d& p_m, const Eigen::Quaterniond& q) {
  return placeOnly(p_m, q) + 0.03 * rotationVector_rad(q);
}

/// Any law of degree two, no matter of what.
Eigen::Vector3d degreeTwo(const Eigen::Vector3d& p_m, const Eigen::Quaterniond& q) {
  const Eigen::Matrix3d R = q.toRotationMatrix();
  const Eigen::Matrix3d turned = R * Eigen::Vector3d(0.05, -0.03, -0.02).asDiagonal() * R.transpose();
  return placeOnly(p_m, q) + Eigen::Vector3d(turned(1, 2), turned(2, 0), turned(0, 0) - turned(1, 1));
}

Eigen::Vector3d bentField(const Eigen::Vector3d& p_m, const Eigen::Quaterniond&) {
  return 0.03 * Eigen::Vector3d(std::sin(4.0 * p_m.y()), p_m.x() * p_m.z(), std::cos(3.0 * p_m.x()));
}

/// What a holder does whose sensor sits 6 mm from where its table says.
Eigen::Vector3d leverArm(const Eigen::Vector3d& p_m, const Eigen::Quaterniond& q) {
  return bentField(p_m, q) + q * Eigen::Vector3d(0.004, -0.003, 0.0034);
}

/// Where a tracker sees a sensor whose coils differ by 2 %, from the signals S = E R^T (3 u u^T - 1) / r^3 as they are:
/// the direction is the principal axis of S^T S, the range by the power of all signals, 6 / r^6.
Eigen::Vector3d seenByUnequalCoils(const Eigen::Vector3d& p_m, const Eigen::Quaterniond& q) {
  const Eigen::Vector3d u = p_m.normalized();
  const Eigen::Matrix3d field = (3.0 * u * u.transpose() - Eigen::Matrix3d::Identity()) / std::pow(p_m.norm(), 3);
  const Eigen::Matrix3d coupled =
      Eigen::Vector3d(1.02, 0.99, 0.99).asDiagonal() * q.toRotationMatrix().transpose() * field;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> power(coupled.transpose() * coupled);
  const Eigen::Vector3d axis = power.eigenvectors().col(2);
  const double range_m = std::pow(6.0 / power.eigenvalues().sum(), 1.0 / 6.0);
  return bentField(p_m, q) + (axis.dot(u) < 0.0 ? -range_m : range_m) * axis - p_m;
}

struct Room {
  int places = 60;
  std::vector<Eigen::Quaterniond> orientations;  ///< Each place is visited in all; empty = one random each.
  ErrorLaw law = placeOnly;
  PosePart part = PosePart::kOrientation;
  double noise = 0.003;  ///< [rad] or [m], each axis.
};

CalibrationTable tableOf(const Room& room, unsigned seed) {
  RandomGeometry random(seed);
  CalibrationTable table;
  table.metadata.alignment_known = true;
  for (int place = 0; place < room.places; ++place) {
    const Eigen::Vector3d p_m =
        Eigen::Vector3d(0.0, 0.0, room.part == PosePart::kPosition ? 1.1 : 0.0) + random.pointInCube_m(0.6);
    std::vector<Eigen::Quaterniond> turned = room.orientations;
    if (turned.empty()) turned = {random.rotation()};
    for (std::size_t visit = 0; visit < turned.size(); ++visit) {
      Node node;
      node.node = place;
      node.visit = static_cast<int>(visit);
      node.reference_from_sensor = {p_m, canonical(turned[visit])};
      const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
      const Eigen::Vector3d error = room.law(p_m, turned[visit]) + room.noise * noise;
      node.tracker_from_sensor = room.part == PosePart::kPosition
                                     ? Pose{p_m + error, canonical(turned[visit])}
                                     : Pose{p_m, canonical(rotationFromVector(error) * turned[visit])};
      table.nodes.push_back(node);
    }
  }
  return table;
}

std::vector<Eigen::Quaterniond> manyOrientations(int count) {
  RandomGeometry random(77);
  std::vector<Eigen::Quaterniond> orientations;
  for (int i = 0; i < count; ++i) orientations.push_back(random.rotation());
  return orientations;
}

/// Up to 60 degrees from where the sensor usually points.
std::vector<Eigen::Quaterniond> tiltedOrientations(int count) {
  RandomGeometry random(78);
  std::vector<Eigen::Quaterniond> orientations;
  for (int i = 0; i < count; ++i)
    orientations.push_back(rotationFromVector(random.between(0.3, 1.05) * random.direction()));
  return orientations;
}

std::vector<Eigen::Quaterniond> threeOrientations() {
  return {Eigen::Quaterniond::Identity(), rotationFromVector({1.2, 0.0, 0.0}), rotationFromVector({0.0, 0.0, 1.4})};
}

using Answer = OrientationDependence::Answer;

}  // namespace

Q_DECLARE_METATYPE(Room)

class OrientationDependenceTest : public QObject {
  Q_OBJECT
 private slots:
  void answers_data() {
    QTest::addColumn<Room>("room");
    QTest::addColumn<QByteArray>("answer");
    QTest::addColumn<bool>("by_neighbours");
    const auto add = [](const char* name, int places, const std::vector<Eigen::Quaterniond>& turned, ErrorLaw law,
                        const char* answer, bool by_neighbours) {
      QTest::newRow(name) << Room{places, turned, std::move(law)} << QByteArray(answer) << by_neighbours;
    };
    add("eight orientations, place only", 60, manyOrientations(8), placeOnly, "no", false);
    add("eight orientations, unequal coils", 60, manyOrientations(8), unequalCoils, "yes", false);
    add("six orientations, unequal coils", 30, manyOrientations(6), unequalCoils, "yes", false);
    add("eight orientations, turned short", 40, tiltedOrientations(8), turnedShort, "yes", false);
    add("forty orientations, degree two", 24, manyOrientations(40), degreeTwo, "yes", false);
    add("forty orientations, place only", 24, manyOrientations(40), placeOnly, "no", false);
    add("three orientations, place only", 40, threeOrientations(), placeOnly, "no", false);
    add("three orientations, unequal coils", 40, threeOrientations(), unequalCoils, "yes", false);
    add("three orientations, turned short", 40, threeOrientations(), turnedShort, "yes", false);
    add("twenty places are enough", 20, threeOrientations(), unequalCoils, "yes", false);
    add("nineteen are not", 19, threeOrientations(), unequalCoils, "cannot tell", false);
    add("two orientations are not", 60, {threeOrientations()[0], threeOrientations()[1]}, unequalCoils, "cannot tell",
        false);
    add("one orientation is not", 60, {threeOrientations()[1]}, unequalCoils, "cannot tell", false);
    add("single visits, turned short", 400, {}, turnedShort, "yes", true);
    add("single visits, place only", 400, {}, placeOnly, "no", true);
    const auto moved = [](const char* name, int places, const std::vector<Eigen::Quaterniond>& turned, ErrorLaw law,
                          const char* answer, bool by_neighbours) {
      QTest::newRow(name) << Room{places, turned, std::move(law), PosePart::kPosition, 0.001} << QByteArray(answer)
                          << by_neighbours;
    };
    moved("positions of a bent field", 60, manyOrientations(8), bentField, "no", false);
    moved("positions of a bent field, three orientations", 40, threeOrientations(), bentField, "no", false);
    moved("positions, lever arm", 30, manyOrientations(6), leverArm, "yes", false);
    moved("positions, lever arm, three orientations", 20, threeOrientations(), leverArm, "yes", false);
    moved("positions, unequal coils", 60, manyOrientations(8), seenByUnequalCoils, "yes", false);
    moved("positions, unequal coils, three orientations", 40, threeOrientations(), seenByUnequalCoils, "yes", false);
    moved("positions, forty orientations, unequal coils", 24, manyOrientations(40), seenByUnequalCoils, "yes", false);
    moved("positions, one orientation", 60, {threeOrientations()[1]}, leverArm, "cannot tell", false);
    moved(
        "positions, single visits, lever arm", 400, {},
        [](const Eigen::Vector3d&, const Eigen::Quaterniond& q) {
          return Eigen::Vector3d(q * Eigen::Vector3d(0.006, 0.0, 0.0));
        },
        "yes", true);
  }
  void answers() {
    QFETCH(Room, room);
    QFETCH(QByteArray, answer);
    QFETCH(bool, by_neighbours);
    const auto seen = orientationDependence(tableOf(room, 5), room.part);
    FT_VERIFY_OK(seen);
    const nlohmann::json json = nlohmann::json::parse(toJson(*seen).dump());
    QVERIFY2(json.at("answer") == answer.toStdString(), seen->text.c_str());
    QCOMPARE(seen->by_neighbours, by_neighbours);
    const bool is_position = room.part == PosePart::kPosition;
    QVERIFY(json.contains(is_position ? "with_orientation_mm" : "with_orientation_deg"));
    FT_VERIFY_MATCH(holdsAll(seen->text, {is_position ? "position error" : "orientation error"}));
    QVERIFY(seen->text.back() == '.' && seen->text.find('\n') == std::string::npos);
    if (by_neighbours) FT_VERIFY_MATCH(holdsAll(seen->text, {"weaker"}));
    if (seen->answer == Answer::kYes) QVERIFY(seen->with_orientation < seen->place_only);
  }

  void whatIsLeftIsTheNoise() {
    // Centred within a place of 8 rows, noise of 0.003 rad an axis leaves sqrt(3) * 0.003 * sqrt(7/8) at best, and the
    // dependence itself leaves several times that where it is not modelled.
    const auto seen =
        orientationDependence(tableOf({60, manyOrientations(8), unequalCoils}, 6), PosePart::kOrientation);
    FT_VERIFY_OK(seen);
    const double noise_deg = std::sqrt(3.0 * 7.0 / 8.0) * 0.003 * 180.0 / M_PI;
    QVERIFY(seen->with_orientation > 0.9 * noise_deg);
    QVERIFY(seen->place_only > 2.0 * noise_deg && seen->with_orientation < 1.4 * noise_deg);
  }

  void ofPositionsTheNoiseIsLeftToo() {
    // As above: what is not noise of an axis of 1 mm is the lever arm's and the coils'.
    for (const ErrorLaw& law : {ErrorLaw(leverArm), ErrorLaw(seenByUnequalCoils)}) {
      const auto seen = orientationDependence(tableOf({60, manyOrientations(8), law, PosePart::kPosition, 0.001}, 6),
                                              PosePart::kPosition);
      FT_VERIFY_OK(seen);
      const double noise_mm = std::sqrt(3.0 * 7.0 / 8.0);
      QVERIFY2(seen->with_orientation > 0.9 * noise_mm && seen->with_orientation < 1.5 * noise_mm, seen->text.c_str());
      QVERIFY2(seen->place_only > 2.2 * noise_mm, seen->text.c_str());
    }
  }

  void aReadingsOwnNoiseForetellsNothing() {
    // What is tracked of a place whose readings scatter holds their errors: terms in it would find them again.
    for (unsigned seed = 200; seed < 204; ++seed) {
      const auto seen = orientationDependence(
          tableOf({150, threeOrientations(), bentField, PosePart::kPosition, 0.01}, seed), PosePart::kPosition);
      FT_VERIFY_OK(seen);
      QVERIFY2(seen->answer == Answer::kNo, seen->text.c_str());
    }
  }

  void chanceIsSeldomTakenForDependence_data() {
    QTest::addColumn<Room>("room");
    QTest::newRow("orientation") << Room{24, manyOrientations(6), placeOnly};
    QTest::newRow("position") << Room{24, manyOrientations(6), bentField, PosePart::kPosition, 0.001};
  }
  void chanceIsSeldomTakenForDependence() {
    QFETCH(Room, room);
    // 5 % of intervals exclude zero on this side by chance; 3 or more of 12 then have a probability below 2 %.
    int n_yes = 0;
    for (unsigned seed = 100; seed < 112; ++seed) {
      const auto seen = orientationDependence(tableOf(room, seed), room.part);
      FT_VERIFY_OK(seen);
      n_yes += seen->answer == Answer::kYes;
    }
    QVERIFY2(n_yes < 3, QByteArray::number(n_yes).constData());
  }

  void aFixtureThatHoldsOrientationsWronglyIsNotTheTracker() {
    // Each of eight orientations has an offset of its own, not a smooth function of the orientation.
    const std::vector<Eigen::Quaterniond> turned = manyOrientations(8);
    RandomGeometry random(3);
    std::vector<Eigen::Vector3d> offsets;
    for (std::size_t i = 0; i < turned.size(); ++i)
      offsets.push_back(0.01 * Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
    const ErrorLaw law = [&](const Eigen::Vector3d& p_m, const Eigen::Quaterniond& q) {
      Eigen::Vector3d error = placeOnly(p_m, q);
      for (std::size_t i = 0; i < turned.size(); ++i)
        if (angleBetween_rad(turned[i], q) < 1e-6) error += offsets[i];
      return error;
    };
    const auto seen = orientationDependence(tableOf({60, turned, law}, 8), PosePart::kOrientation);
    FT_VERIFY_OK(seen);
    QVERIFY2(seen->answer != Answer::kYes, seen->text.c_str());
  }

  void withoutOrientationsItCannotBeAsked() {
    CalibrationTable table = tableOf({30, threeOrientations(), placeOnly}, 5);
    table.nodes[4].has_orientation = false;
    const auto seen = orientationDependence(table, PosePart::kPosition);
    QVERIFY(!seen && seen.error().code == ErrorCode::kUnsupported);
    FT_VERIFY_MATCH(holdsAll(seen.error().message, {"1 of 90 rows"}));
  }

  void realLandmarksHaveNoOrientation() {
    FT_REQUIRE_REAL_DATA();
    const importers::Importer& importer = *importers::findImporter("plus").value();
    const auto read = importer.read(*realData("pluslib_fcal/samples.csv"), std::nullopt,
                                    resolveSettings("plus", importer.settings, {}).value());
    FT_VERIFY_OK(read);
    const auto seen = orientationDependence(read->table.value(), PosePart::kOrientation);
    // A pivoting stylus has a place and no orientation.
    QVERIFY(!seen && seen.error().code == ErrorCode::kUnsupported);
    FT_VERIFY_MATCH(holdsAll(seen.error().message, {"8 of 8 rows have none"}));
  }
};

FIELDTRUE_TEST(OrientationDependenceTest)
#include "orientation_dependence_test.moc"
