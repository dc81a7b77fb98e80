#include "calib/gap/how_far.h"

#include <QTest>
#include <random>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

namespace {

identify::GapRows rowsAt(const std::vector<Eigen::Vector3d>& places_m) {
  identify::GapRows rows;
  for (std::size_t p = 0; p < places_m.size(); ++p) {
    identify::GapRow row;
    row.node = static_cast<int>(p);
    row.place = p;
    row.reference_from_sensor.position_m = places_m[p];
    rows.rows.push_back(row);
    rows.place_nodes.push_back(row.node);
  }
  return rows;
}

identify::GapRows gridRows() {
  std::vector<Eigen::Vector3d> places_m;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) places_m.push_back(0.3 * Eigen::Vector3d(i, j, k));
  return rowsAt(places_m);
}

}  // namespace

class HowFarTest : public QObject {
  Q_OBJECT
 private slots:
  /// Mean squares of 25, 9 and 4 mm2 over a floor of 4: 21 at the start, 5 with one effect, nothing with two; a floor
  /// above what is left gives a share below nothing.
  void squaresLessTheFloor() {
    const identify::GapRows rows = gridRows();
    const auto all = [&](double square_mm2) {
      return std::vector<UnseenRow>(rows.rows.size(), {1e-6 * square_mm2, 0.0, square_mm2});
    };
    RowNoise noise;
    noise.square_m2.assign(rows.rows.size(), 4e-6);
    noise.square_rad2.assign(rows.rows.size(), 0.0);
    noise.whitened.assign(rows.rows.size(), 4.0);
    const HowFar far = howFar({{all(25.0), all(9.0), all(4.0), all(3.0)}, {}, {}}, noise, rows);
    FT_VERIFY_MATCH(near(far.floor_m2, 4e-6, 1e-12));
    FT_VERIFY_MATCH(near(far.excess_m2[0].value, 21e-6, 1e-12));
    FT_VERIFY_MATCH(near(far.left_of_start[1].value, 5.0 / 21.0, 1e-9));
    FT_VERIFY_MATCH(near(far.left_of_start[2].value, 0.0, 1e-9));
    FT_VERIFY_MATCH(near(far.remaining().value, -1.0 / 21.0, 1e-9));
    FT_VERIFY_MATCH(near(signedRoot_mm(-4e-6), -2.0, 1e-12));
  }

  /// By hand: a = (1, 2, 3), b = (4, 5, 9). Means 2 and 6, variances of the means 1/3 and 7/3, covariance 5/6,
  /// t of two degrees 2.920.
  void aRatioByFieller() {
    const std::vector<double> a = {1, 2, 3};
    const std::vector<double> b = {4, 5, 9};
    const Bounded ratio = ratioOfMeans(a, b);
    FT_VERIFY_MATCH(near(ratio.value, 1.0 / 3.0, 1e-12));
    QVERIFY(ratio.low90 && ratio.high90);
    const double t2 = 2.920 * 2.920;
    for (const double f : {*ratio.low90, *ratio.high90}) {
      const double z2 = std::pow(2.0 - 6.0 * f, 2) / (1.0 / 3.0 - 2.0 * f * 5.0 / 6.0 + f * f * 7.0 / 3.0);
      FT_VERIFY_MATCH(near(z2, t2, 1e-3 * t2));
    }
  }

  /// Where the start is not clear of the floor no interval can be told.
  void noIntervalWithoutAStart() {
    const Bounded ratio = ratioOfMeans(std::vector<double>{1, 2, 3}, std::vector<double>{-5, 6, 1});
    QVERIFY(!ratio.low90 && !ratio.high90);
  }

  /// 90 % of intervals hold the true ratio, 1/4, of means of 60 places.
  void coversWhatItSays() {
    std::mt19937_64 generator(5);
    std::normal_distribution<double> normal(0.0, 1.0);
    int held = 0;
    constexpr int kDraws = 2000;
    for (int draw = 0; draw < kDraws; ++draw) {
      std::vector<double> a;
      std::vector<double> b;
      for (int p = 0; p < 60; ++p) {
        const double common = normal(generator);
        a.push_back(1.0 + common + normal(generator));
        b.push_back(4.0 + common + 2.0 * normal(generator));
      }
      const Bounded ratio = ratioOfMeans(a, b);
      held += ratio.low90 && *ratio.low90 <= 0.25 && 0.25 <= *ratio.high90 ? 1 : 0;
    }
    FT_VERIFY_MATCH(near(static_cast<double>(held) / kDraws, 0.90, 0.025));
  }
};

FIELDTRUE_TEST(HowFarTest)
#include "how_far_test.moc"
