#include <QTest>
#include <cmath>

#include "calib/correctors/base/place_rotations.h"
#include "tests/calib/correctors/cell_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

Eigen::Quaterniond about(const Eigen::Vector3d& axis, double angle_rad) { return rotationFromVector(angle_rad * axis); }

/// A cube of 200 mm at the origin, with the error rotation of each corner.
FitData cubeWith(const std::array<Eigen::Quaterniond, 8>& q_error) {
  FitData data = fitDataOf(cube(0.2), nothing_m, [](const Eigen::Vector3d&) { return Eigen::Quaterniond::Identity(); });
  for (std::size_t c = 0; c < 8; ++c) data.q_tracked[c] = q_error[c];
  return data;
}

Eigen::Quaterniond errorAt(const std::string& id, const FitData& data, const Eigen::Vector3d& p_m,
                           const Given& given = {}) {
  const auto model = fitOrientation(id, data, given);
  FT_CHECK(model.has_value());
  // A sensor that shows no rotation at all is given the inverse of the error rotation.
  return (*model)->correct(p_m, Eigen::Quaterniond::Identity()).conjugate();
}

const std::vector<std::pair<std::string, Given>> kMethods = {
    {"slerp_trilinear", {}},
    {"tetrahedral_quaternion", {}},
    {"tetrahedral_quaternion", {{"split", "delaunay"}}},
    {"local_quaternion", {}},
    {"local_quaternion", {{"weight", "quadratic"}}},
    {"local_quaternion", {{"weight", "log"}}},
    {"local_quaternion", {{"weight", "bryson_linear"}}},
    {"local_quaternion", {{"weight", "bryson_bump"}}},
    {"local_quaternion", {{"weight", "briggs"}}},
};

void addMethods() {
  QTest::addColumn<int>("row");
  for (std::size_t i = 0; i < kMethods.size(); ++i)
    QTest::addRow("%s %s", kMethods[i].first.c_str(),
                  kMethods[i].second.empty() ? "" : kMethods[i].second.begin()->second.c_str())
        << static_cast<int>(i);
}

}  // namespace

class CellRotationTest : public QObject {
  Q_OBJECT
 private slots:
  void slerpsByHand() {
    std::array<Eigen::Quaterniond, 8> q;
    q.fill(Eigen::Quaterniond::Identity());
    for (const std::size_t c : {1U, 3U, 5U, 7U}) q[c] = about(Eigen::Vector3d::UnitZ(), 0.8);
    // A quarter of the way from no rotation to 0.8 rad.
    FT_VERIFY_MATCH(
        near(errorAt("slerp_trilinear", cubeWith(q), {0.05, 0.12, 0.03}), about(Eigen::Vector3d::UnitZ(), 0.2), 1e-9));
    // One corner alone: half of a half of a half.
    q.fill(Eigen::Quaterniond::Identity());
    q[6] = about(Eigen::Vector3d::UnitX(), 0.8);
    FT_VERIFY_MATCH(
        near(errorAt("slerp_trilinear", cubeWith(q), {0.1, 0.1, 0.1}), about(Eigen::Vector3d::UnitX(), 0.1), 1e-9));
    // Along r first, then s: the mixture of 1 rad about x and 1 rad about y over s, the same for every r.
    for (const std::size_t c : {0U, 1U, 4U, 5U}) q[c] = about(Eigen::Vector3d::UnitX(), 1.0);
    for (const std::size_t c : {2U, 3U, 6U, 7U}) q[c] = about(Eigen::Vector3d::UnitY(), 1.0);
    const double half = 0.5;
    // Between two unit quaternions half way is their sum, normalised.
    const Eigen::Quaterniond between =
        Eigen::Quaterniond(2.0 * std::cos(half), std::sin(half), std::sin(half), 0.0).normalized();
    FT_VERIFY_MATCH(near(errorAt("slerp_trilinear", cubeWith(q), {0.13, 0.1, 0.02}), between, 1e-9));
  }

  void quaternionsAreSummedWithTheirWeights() {
    // Weights 0.1, 0.2, 0.3 and 0.4 of corners 0, 3, 5 and 1, all turned about z.
    std::array<Eigen::Quaterniond, 8> q;
    q.fill(Eigen::Quaterniond::Identity());
    q[0] = about(Eigen::Vector3d::UnitZ(), 0.2);
    q[3] = about(Eigen::Vector3d::UnitZ(), 0.6);
    q[5] = about(Eigen::Vector3d::UnitZ(), 1.0);
    q[1] = about(Eigen::Vector3d::UnitZ(), -0.4);
    const double sine = 0.1 * std::sin(0.1) + 0.2 * std::sin(0.3) + 0.3 * std::sin(0.5) + 0.4 * std::sin(-0.2);
    const double cosine = 0.1 * std::cos(0.1) + 0.2 * std::cos(0.3) + 0.3 * std::cos(0.5) + 0.4 * std::cos(-0.2);
    FT_VERIFY_MATCH(near(errorAt("tetrahedral_quaternion", cubeWith(q), {0.2 - 0.02, 0.04, 0.06}),
                         about(Eigen::Vector3d::UnitZ(), 2.0 * std::atan2(sine, cosine)), 1e-9));
    // Kindratenko's squares at 40 and 60 mm from two edges: 31 : 1 : 11 for corners 0, 1 and 2.
    q[2] = about(Eigen::Vector3d::UnitZ(), 0.9);
    const double squares_sine = 31.0 * std::sin(0.1) + 1.0 * std::sin(-0.2) + 11.0 * std::sin(0.45);
    const double squares_cosine = 31.0 * std::cos(0.1) + 1.0 * std::cos(-0.2) + 11.0 * std::cos(0.45);
    FT_VERIFY_MATCH(near(errorAt("local_quaternion", cubeWith(q), {0.04, 0.06, 0.0}, {{"weight", "quadratic"}}),
                         about(Eigen::Vector3d::UnitZ(), 2.0 * std::atan2(squares_sine, squares_cosine)), 1e-9));
  }

  void signsAreAlignedBeforeTheyAreSummed() {
    const Eigen::Quaterniond q = about(Eigen::Vector3d::UnitY(), 3.1);
    const std::vector<Eigen::Quaterniond> both = {q, Eigen::Quaterniond(Eigen::Vector4d(-q.coeffs()))};
    FT_VERIFY_MATCH(near(weightedRotation(both, std::vector<double>{0.5, 0.5}), q, 1e-12));
    // Where the sum vanishes the one of the largest weight stands.
    const std::vector<Eigen::Quaterniond> opposite = {Eigen::Quaterniond(1, 0, 0, 0), Eigen::Quaterniond(1, 0, 0, 0)};
    FT_VERIFY_MATCH(near(weightedRotation(opposite, std::vector<double>{0.0, 0.0}), opposite[0], 1e-12));
  }

  /// Every node was seen in its own orientation; sensors held in others are corrected, in either frame.
  void anyTrueOrientationPerPlace_data() { addMethods(); }
  void anyTrueOrientationPerPlace() {
    QFETCH(int, row);
    const auto& [id, given] = kMethods[static_cast<std::size_t>(row)];
    for (const char* frame : {"tracker", "sensor"}) {
      const bool in_tracker = std::string(frame) == "tracker";
      const auto track = [in_tracker](const Eigen::Vector3d& p_m, const Eigen::Quaterniond& q_true) {
        return in_tracker ? smoothError(p_m) * q_true : q_true * smoothError(p_m);
      };
      FitData data = fitDataOf(shakenGrid({6, 6, 6}, 0.2, 0.01), nothing_m, smoothError);
      for (std::size_t i = 0; i < data.size(); ++i) {
        const auto turn = static_cast<double>(i);
        data.q_true[i] =
            rotationFromVector({std::sin(turn), 2.0 * std::cos(3.0 * turn), 0.1 * static_cast<double>(i % 7)});
        data.q_tracked[i] = track(data.p_tracked_m[i], data.q_true[i]);
      }
      Given with_frame = given;
      with_frame["error_frame"] = frame;
      const auto model = fitOrientation(id, data, with_frame);
      FT_VERIFY_OK(model);
      const Eigen::Vector3d between_m(0.93, 0.21, 0.33);
      for (const Eigen::Vector3d& turn : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1.2, -0.4, 2.0)}) {
        const Eigen::Quaterniond q_true = rotationFromVector(turn);
        for (const std::size_t i : {0U, 50U, 215U})
          FT_VERIFY_MATCH(
              near((*model)->correct(data.p_tracked_m[i], track(data.p_tracked_m[i], q_true)), q_true, 1e-7));
        // Between places the mixture of errors that differ by 0.03 rad over a cell.
        FT_VERIFY_MATCH(near((*model)->correct(between_m, track(between_m, q_true)), q_true, 0.015));
      }
    }
  }

  void visitsOfOnePlaceAreAveraged_data() { addMethods(); }
  void visitsOfOnePlaceAreAveraged() {
    QFETCH(int, row);
    const auto& [id, given] = kMethods[static_cast<std::size_t>(row)];
    FitData data = fitDataOf(shakenGrid({3, 3, 3}, 0.2, 0.01), nothing_m, smoothError);
    const std::size_t n_places = data.size();
    // Two more visits of each place, their readings off by as much to either side.
    for (const double off_rad : {0.02, -0.02}) {
      const Eigen::Quaterniond q_true = rotationFromVector({1.0, 0.5, -30.0 * off_rad});
      for (std::size_t i = 0; i < n_places; ++i) {
        data.p_tracked_m.push_back(data.p_tracked_m[i]);
        data.p_true_m.push_back(data.p_true_m[i]);
        data.node.push_back(data.node[i]);
        data.index.push_back(data.index[i]);
        data.q_true.push_back(q_true);
        data.q_tracked.push_back(about(Eigen::Vector3d::UnitX(), off_rad) * smoothError(data.p_tracked_m[i]) * q_true);
      }
    }
    const auto model = fitOrientation(id, data, given);
    FT_VERIFY_OK(model);
    for (std::size_t i = 0; i < n_places; ++i)
      FT_VERIFY_MATCH(near((*model)->correct(data.p_tracked_m[i], smoothError(data.p_tracked_m[i])),
                           Eigen::Quaterniond::Identity(), 1e-7));
  }

  void errorsAroundAHalfTurnStayContinuous_data() { addMethods(); }
  void errorsAroundAHalfTurnStayContinuous() {
    QFETCH(int, row);
    const auto& [id, given] = kMethods[static_cast<std::size_t>(row)];
    const auto q_error = [](const Eigen::Vector3d& p) {
      return about(Eigen::Vector3d::UnitZ(), M_PI + 0.3 * (p.x() - 0.8));
    };
    const auto model = fitOrientation(id, fitDataOf(shakenGrid({6, 5, 4}, 0.2, 0.0), nothing_m, q_error), given);
    FT_VERIFY_OK(model);
    for (const Eigen::Vector3d& p_m :
         {Eigen::Vector3d(0.71, 0.11, 0.12), Eigen::Vector3d(0.8, 0.1, 0.1), Eigen::Vector3d(0.85, 0.2, 0.3)})
      FT_VERIFY_MATCH(near((*model)->correct(p_m, q_error(p_m)), Eigen::Quaterniond::Identity(), 0.03));
  }

  void outsideNothingIsCorrected_data() { addMethods(); }
  void outsideNothingIsCorrected() {
    QFETCH(int, row);
    const auto& [id, given] = kMethods[static_cast<std::size_t>(row)];
    const auto model = fitOrientation(id, fitDataOf(shakenGrid({3, 3, 3}, 0.2, 0.0), nothing_m, smoothError), given);
    FT_VERIFY_OK(model);
    QVERIFY((*model)->covers({0.36, -0.1, 0.02}));
    QVERIFY(!(*model)->covers({0.34, -0.1, 0.02}));
    const Eigen::Quaterniond q_tracked = rotationFromVector({0.2, 0.4, -1.0});
    FT_VERIFY_MATCH(near((*model)->correct({0.34, -0.1, 0.02}, q_tracked), q_tracked, 1e-12));
  }

  void slerpAndTetrahedraAreContinuous() {
    const FitData data = fitDataOf(shakenGrid({4, 4, 4}, 0.2, 0.03), nothing_m, smoothError);
    for (const auto& [id, given] : {kMethods[0], kMethods[1]}) {
      const auto model = fitOrientation(id, data, given);
      FT_VERIFY_OK(model);
      // Steps of a micrometre along a line through all: a jump would show as more than the slope of the field allows.
      const Eigen::Vector3d from_m(0.42, -0.27, -0.18);
      const Eigen::Vector3d way_m(0.55, 0.52, 0.53);
      constexpr int kSteps = 200000;
      Eigen::Quaterniond last = (*model)->correct(from_m, Eigen::Quaterniond::Identity());
      for (int i = 1; i <= kSteps; ++i) {
        const Eigen::Quaterniond next = (*model)->correct(from_m + way_m * i / kSteps, Eigen::Quaterniond::Identity());
        // Compared by components: angles of 1e-6 rad are lost in acos.
        const double apart = std::min((next.coeffs() - last.coeffs()).norm(), (next.coeffs() + last.coeffs()).norm());
        QVERIFY(apart < 5e-6);
        last = next;
      }
    }
  }

  void scatteredPlacesNeedTetrahedra() {
    FitData data = fitDataOf(shakenGrid({4, 4, 4}, 0.2, 0.03), nothing_m, smoothError);
    data.index.clear();
    for (const char* id : {"slerp_trilinear", "local_quaternion"}) {
      const auto refused = fitOrientation(id, data);
      QVERIFY(!refused && refused.error().code == ErrorCode::kUnsupported);
      FT_VERIFY_MATCH(holdsAll(refused.error().message, {"grid", "tetrahedral_quaternion works"}));
    }
    FT_VERIFY_OK(fitOrientation("tetrahedral_quaternion", data));
  }
};

FIELDTRUE_TEST(CellRotationTest)
#include "cell_rotation_test.moc"
