#include <Eigen/LU>
#include <QTest>
#include <cmath>

#include "calib/correctors/regrid/regrid_error.h"
#include "calib/correctors/regrid/surrounding_tetrahedron.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

const std::vector<Eigen::Vector3d> kUnitTetrahedron = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const std::vector<Eigen::Vector3d> kOctahedron = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
const std::vector<RegridMethod> kAll = {RegridMethod::kBriggs, RegridMethod::kLivingston, RegridMethod::kCzernuszenko};

RegridOptions options(RegridMethod method, double pitch_m = 1.0, double width_pitches = 1.0) {
  return {method, pitch_m, width_pitches};
}

/// Weights by place, 0 where a place has none.
std::vector<double> dense(const std::vector<Eigen::Vector3d>& places_m, const Eigen::Vector3d& target_m,
                          const RegridOptions& how) {
  std::vector<double> weights(places_m.size(), 0.0);
  for (const auto& of_target : regridWeights(places_m, std::span(&target_m, 1), how))
    for (const RegridWeight& w : of_target) weights[w.place] += w.weight;
  return weights;
}

bool isSupported(const std::vector<Eigen::Vector3d>& places_m, const Eigen::Vector3d& target_m,
                 const RegridOptions& how) {
  return !regridWeights(places_m, std::span(&target_m, 1), how).front().empty();
}

/// Volume of the smallest tetrahedron that holds a point, by solving for the shares of its corners; 0 without one.
double smallestVolume_m3(const std::vector<Eigen::Vector3d>& places_m, const Eigen::Vector3d& point_m) {
  double smallest_m3 = 0.0;
  const std::size_t n = places_m.size();
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a + 1; b < n; ++b)
      for (std::size_t c = b + 1; c < n; ++c)
        for (std::size_t d = c + 1; d < n; ++d) {
          Eigen::Matrix4d corners;
          corners << places_m[a], places_m[b], places_m[c], places_m[d], 1, 1, 1, 1;
          const Eigen::Vector4d shares = corners.inverse() * point_m.homogeneous();
          const double volume_m3 = std::abs(corners.determinant()) / 6.0;
          if (shares.minCoeff() >= 0.0 && (smallest_m3 == 0.0 || volume_m3 < smallest_m3)) smallest_m3 = volume_m3;
        }
  return smallest_m3;
}

FitData withDisplacement(const std::vector<Eigen::Vector3d>& places_m, const Displacement& displacement_m) {
  return fitDataOf(places_m, displacement_m);
}

}  // namespace

class RegridTest : public QObject {
  Q_OBJECT
 private slots:
  void methodsHaveNames() {
    for (const RegridMethod method : kAll) QVERIFY(findRegridMethod(regridMethodId(method)).value() == method);
    const auto unknown = findRegridMethod("kriging");
    QVERIFY(!unknown && unknown.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(unknown.error().message, {"kriging", "briggs", "livingston", "czernuszenko"}));
  }

  void tetrahedronByHand() {
    // Squared distances 3/16 and three times 11/16: 1/3 against 1/11, so 11/20 and three times 3/20.
    const Eigen::Vector3d target_m(0.25, 0.25, 0.25);
    const std::vector<double> weights = dense(kUnitTetrahedron, target_m, options(RegridMethod::kBriggs));
    FT_VERIFY_MATCH(near(weights[0], 0.55, 1e-14));
    for (std::size_t corner = 1; corner < 4; ++corner) FT_VERIFY_MATCH(near(weights[corner], 0.15, 1e-14));
    // The field x is 0.25 there; inverse squared distance makes 0.15 of it: linear fields are not reproduced.
    double value = 0.0;
    for (std::size_t i = 0; i < 4; ++i) value += weights[i] * kUnitTetrahedron[i].x();
    FT_VERIFY_MATCH(near(value, 0.15, 1e-14));
  }

  void takesTheSmallestTetrahedron() {
    // With e = (0.5, 0.3, 0.1) the target is 0.5 e + 0.1 y + 0.2 z + 0.2 o: half the volume of the unit tetrahedron.
    // Squared distances to o, e, y, z: 3/16, 0.0875, 11/16, 11/16.
    std::vector<Eigen::Vector3d> places_m = kUnitTetrahedron;
    places_m.emplace_back(0.5, 0.3, 0.1);
    places_m.emplace_back(-3.0, -3.0, -3.0);
    const Eigen::Vector3d target_m(0.25, 0.25, 0.25);
    const double sum = 16.0 / 3.0 + 1.0 / 0.0875 + 2.0 * 16.0 / 11.0;
    const std::vector<double> weights = dense(places_m, target_m, options(RegridMethod::kBriggs));
    const std::vector<double> expected = {16.0 / 3.0 / sum,   0.0, 16.0 / 11.0 / sum, 16.0 / 11.0 / sum,
                                          1.0 / 0.0875 / sum, 0.0};
    for (std::size_t i = 0; i < expected.size(); ++i) FT_VERIFY_MATCH(near(weights[i], expected[i], 1e-13));
  }

  void smallestTetrahedronIsThatOfAnExhaustiveSearch() {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      const std::vector<Eigen::Vector3d> places_m = randomPoints(11, seed);
      const Eigen::Vector3d target_m = randomPoints(1, 1000 + seed).front();
      const double expected_m3 = smallestVolume_m3(places_m, target_m);
      const auto corners = smallestSurroundingTetrahedron(places_m, target_m);
      QCOMPARE(corners.has_value(), expected_m3 > 0.0);
      if (!corners) continue;
      const Eigen::Vector3d& o = places_m[(*corners)[0]];
      Eigen::Matrix3d edges_m;
      edges_m << places_m[(*corners)[1]] - o, places_m[(*corners)[2]] - o, places_m[(*corners)[3]] - o;
      FT_VERIFY_MATCH(near(std::abs(edges_m.determinant()) / 6.0, expected_m3, 1e-12));
    }
  }

  void asksFartherPlacesWhereTheNearestDoNotSurround_data() {
    QTest::addColumn<int>("crowd");
    QTest::addColumn<bool>("supported");
    QTest::newRow("a crowd on one side") << 40 << true;
    QTest::newRow("a crowd larger than what is tried") << 70 << false;
  }
  void asksFartherPlacesWhereTheNearestDoNotSurround() {
    QFETCH(int, crowd);
    QFETCH(bool, supported);
    std::vector<Eigen::Vector3d> places_m = {{-1, -1, -1}, {1, -1, -1}, {0, 1.5, -1}, {0, 0, 1.5}};
    for (int i = 0; i < crowd; ++i)
      places_m.emplace_back(0.1 + 0.01 * (i % 3), 0.02 * std::sin(i), 0.02 * std::cos(2.0 * i));
    QCOMPARE(isSupported(places_m, {0, 0, 0}, options(RegridMethod::kBriggs)), supported);
  }

  void gaussianKernelByHand() {
    // From (0.5, 0, 0) the corners stand at squared distances 0.25, 2.25 and four times 1.25.
    const Eigen::Vector3d target_m(0.5, 0, 0);
    const double sum = std::exp(-0.125) + std::exp(-1.125) + 4.0 * std::exp(-0.625);
    const std::vector<double> weights = dense(kOctahedron, target_m, options(RegridMethod::kLivingston));
    FT_VERIFY_MATCH(near(weights[0], std::exp(-0.125) / sum, 1e-14));
    FT_VERIFY_MATCH(near(weights[1], std::exp(-1.125) / sum, 1e-14));
    for (std::size_t i = 2; i < 6; ++i) FT_VERIFY_MATCH(near(weights[i], std::exp(-0.625) / sum, 1e-14));
  }

  void gaussianKernelEndsAtThreePitches() {
    // Pitch 0.4 m: cut off at 1.2 m, so the far corner at 1.5 m is out; width two pitches, 0.8 m.
    const Eigen::Vector3d target_m(0.5, 0, 0);
    const double near_part = std::exp(-0.25 / 1.28);
    const double side_part = std::exp(-1.25 / 1.28);
    const std::vector<double> weights = dense(kOctahedron, target_m, options(RegridMethod::kLivingston, 0.4, 2.0));
    FT_VERIFY_MATCH(near(weights[0], near_part / (near_part + 4.0 * side_part), 1e-14));
    QCOMPARE(weights[1], 0.0);
    FT_VERIFY_MATCH(near(weights[4], side_part / (near_part + 4.0 * side_part), 1e-14));
    // Pitch 0.3 m: nothing within 0.9 m of the centre.
    QVERIFY(!isSupported(kOctahedron, {0, 0, 0}, options(RegridMethod::kLivingston, 0.3)));
  }

  void equation19ByHand() {
    // 1/d^2: 4, 4/9, four times 4/5; in 86ths 45, 5 and 9.
    const std::vector<double> weights = dense(kOctahedron, {0.5, 0, 0}, options(RegridMethod::kCzernuszenko));
    FT_VERIFY_MATCH(near(weights[0], 45.0 / 86.0, 1e-14));
    FT_VERIFY_MATCH(near(weights[1], 5.0 / 86.0, 1e-14));
    for (std::size_t i = 2; i < 6; ++i) FT_VERIFY_MATCH(near(weights[i], 9.0 / 86.0, 1e-14));
  }

  void nothingIsExtrapolated() {
    const std::vector<Eigen::Vector3d> grid_m = shakenGrid({4, 4, 4}, 0.2, 0.0);
    const std::vector<Eigen::Vector3d> shaken_m = shakenGrid({4, 4, 4}, 0.2, 0.02);
    for (const RegridMethod method : kAll) {
      const RegridOptions how = options(method, 0.2);
      QVERIFY(isSupported(grid_m, {0.45, -0.1, 0.0}, how));
      QVERIFY(isSupported(grid_m, {0.4, -0.12, 0.03}, how));  // On a face.
      QVERIFY(!isSupported(grid_m, {0.39, -0.1, 0.0}, how));
      QVERIFY(!isSupported(grid_m, {0.45, -0.1, 0.41}, how));
      QVERIFY(!isSupported(grid_m, {std::nan(""), 0, 0}, how));
      QVERIFY(isSupported(shaken_m, {0.7, 0.0, 0.1}, how));
      QVERIFY(!isSupported(shaken_m, {0.37, -0.33, -0.23}, how));
      QVERIFY(!isSupported({}, {0, 0, 0}, how));
      QVERIFY(!isSupported(shakenGrid({5, 5, 1}, 0.2, 0.0), {0.5, 0.0, -0.2}, how));  // Places in one plane.
    }
  }

  void weightsAddUpToOneAndAreNotNegative() {
    const std::vector<Eigen::Vector3d> shaken_m = shakenGrid({4, 4, 4}, 0.2, 0.02);
    for (const RegridMethod method : kAll) {
      int n_supported = 0;
      for (const auto& weights : regridWeights(shaken_m, randomPoints(100), options(method, 0.2))) {
        double sum = 0.0;
        for (const RegridWeight& w : weights) {
          QVERIFY(w.weight >= 0.0 && w.place < shaken_m.size());
          sum += w.weight;
        }
        if (weights.empty()) continue;
        ++n_supported;
        FT_VERIFY_MATCH(near(sum, 1.0, 1e-12));
        if (method == RegridMethod::kBriggs) QCOMPARE(weights.size(), std::size_t{4});
      }
      QVERIFY(n_supported > 0 && n_supported < 100);
    }
  }

  void aTargetAtAPlaceTakesItsValue() {
    const std::vector<Eigen::Vector3d> grid_m = shakenGrid({3, 3, 3}, 0.2, 0.01);
    for (const RegridMethod method : {RegridMethod::kBriggs, RegridMethod::kCzernuszenko})
      for (std::size_t place = 0; place < grid_m.size(); ++place) {
        const auto weights = regridWeights(grid_m, std::span(&grid_m[place], 1), options(method)).front();
        QVERIFY(weights.size() == 1 && weights.front().place == place && weights.front().weight == 1.0);
      }
  }

  void errorOfTheResamplingByHand() {
    // Six corners without error and a centre, seen twice, 1 and 3 mm off in x: the corners say 0, so 2 mm is lost.
    // A corner left out is not surrounded by the rest.
    std::vector<Eigen::Vector3d> places_m = kOctahedron;
    places_m.emplace_back(0, 0, 0);
    places_m.emplace_back(0, 0, 0);
    FitData data = withDisplacement(places_m, [](const Eigen::Vector3d&) { return Eigen::Vector3d::Zero(); });
    data.node.back() = 6;
    data.p_true_m[6].x() += 0.001;
    data.p_true_m[7].x() += 0.003;
    for (const RegridMethod method : kAll) {
      const RegridError error = regridError(data, options(method));
      QCOMPARE(error.n_scored, std::size_t{1});
      QCOMPARE(error.n_without_support, std::size_t{6});
      FT_VERIFY_MATCH(near(error.rms_mm, 2.0, 1e-12));
    }
  }

  void onlyTheCornersOfAnExactGridCannotBeLeftOut() {
    const FitData data = withDisplacement(shakenGrid({4, 3, 3}, 0.2, 0.0),
                                          [](const Eigen::Vector3d& p) { return Eigen::Vector3d(0, 0.01 * p.x(), 0); });
    for (const RegridMethod method : kAll) {
      const RegridError error = regridError(data, options(method, 0.2));
      QCOMPARE(error.n_without_support, std::size_t{8});
      QCOMPARE(error.n_scored, std::size_t{28});
      // A step of the grid changes the field by 2 mm.
      QVERIFY(error.rms_mm > 0.0 && error.rms_mm < 2.0);
    }
  }

  void aConstantFieldLosesNothing() {
    const FitData data = withDisplacement(shakenGrid({4, 4, 4}, 0.2, 0.03),
                                          [](const Eigen::Vector3d&) { return Eigen::Vector3d(0.01, 0.02, -0.03); });
    for (const RegridMethod method : kAll) {
      const RegridError error = regridError(data, options(method, 0.2));
      QVERIFY(error.n_scored > 0);
      FT_VERIFY_MATCH(near(error.rms_mm, 0.0, 1e-9));
    }
  }
};

FIELDTRUE_TEST(RegridTest)
#include "regrid_test.moc"
