#include "calib/correctors/cells/corner_weights.h"

#include <QTest>
#include <cmath>
#include <numeric>

#include "tests/calib/correctors/cell_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

using Weights = std::array<double, 8>;

/// A cube of 100 mm, its low corner at the origin.
HexahedralCells oneCube() { return {cube(0.1), {{0, 1, 2, 3, 4, 5, 6, 7}}}; }

Weights weightsAt(const HexahedralCells& cells, WeightKind kind, const Eigen::Vector3d& p_m,
                  double length_unit_m = 0.3048) {
  WeightRule rule;
  rule.kind = kind;
  rule.length_unit_m = length_unit_m;
  Weights d_m{};
  for (std::size_t c = 0; c < 8; ++c) d_m[c] = (cells.corner_m(0, c) - p_m).norm();
  return cornerWeights(rule, cellLengths(cells, 0), d_m);
}

double sum(const Weights& weights) { return std::accumulate(weights.begin(), weights.end(), 0.0); }

const std::vector<WeightKind> kNormalised = {WeightKind::kBrysonLinear,      WeightKind::kBrysonBump,
                                             WeightKind::kKindratenkoLinear, WeightKind::kKindratenkoSquares,
                                             WeightKind::kKindratenkoLog,    WeightKind::kBriggs};

/// In the bottom face, 20 and 30 mm from two edges: squared distances 13, 73 and 53 cm2 from corners 0, 1 and 2, the
/// others beyond half the diagonal, whose square is 75 cm2, and beyond the edge of 10 cm.
const Eigen::Vector3d kNearCorner(0.02, 0.03, 0.0);

/// A quarter of the way between two faces: squared distances 56.25 cm2 from four corners, 106.25 from the others.
const Eigen::Vector3d kQuarterWay(0.025, 0.05, 0.05);

}  // namespace

class CornerWeightsTest : public QObject {
  Q_OBJECT
 private slots:
  void lengthsOfACell() {
    std::vector<Eigen::Vector3d> corners_m = cube(0.1);
    corners_m[7] = {0.1, 0.1, 0.2};  // Diagonal 0-7 becomes sqrt(0.06), edge 3-7 twice as long.
    const CellLengths lengths = cellLengths({corners_m, {{0, 1, 2, 3, 4, 5, 6, 7}}}, 0);
    FT_VERIFY_MATCH(near(lengths.smallest_distance_m, 0.1, 1e-12));
    FT_VERIFY_MATCH(near(lengths.longest_diagonal_m, std::sqrt(0.06), 1e-12));
  }

  void kindratenkoByHand() {
    const HexahedralCells cells = oneCube();
    const Weights squares = weightsAt(cells, WeightKind::kKindratenkoSquares, kNearCorner);
    // 1 - 13/75, 1 - 73/75 and 1 - 53/75 are as 31 : 1 : 11.
    FT_VERIFY_MATCH(near(squares[0], 31.0 / 43.0, 1e-12));
    FT_VERIFY_MATCH(near(squares[1], 1.0 / 43.0, 1e-12));
    FT_VERIFY_MATCH(near(squares[2], 11.0 / 43.0, 1e-12));
    const Weights linear = weightsAt(cells, WeightKind::kKindratenkoLinear, kNearCorner);
    FT_VERIFY_MATCH(near(linear[0] / linear[2], (1.0 - std::sqrt(13.0 / 75.0)) / (1.0 - std::sqrt(53.0 / 75.0)), 1e-9));
    FT_VERIFY_MATCH(near(linear[1] / linear[2], (1.0 - std::sqrt(73.0 / 75.0)) / (1.0 - std::sqrt(53.0 / 75.0)), 1e-9));
    const Weights log = weightsAt(cells, WeightKind::kKindratenkoLog, kNearCorner);
    FT_VERIFY_MATCH(near(log[0] / log[2], std::log(75.0 / 13.0) / std::log(75.0 / 53.0), 1e-9));
    FT_VERIFY_MATCH(near(log[1] / log[2], std::log(75.0 / 73.0) / std::log(75.0 / 53.0), 1e-9));
    for (const Weights& weights : {squares, linear, log})
      for (std::size_t c = 3; c < 8; ++c) QCOMPARE(weights[c], 0.0);
  }

  void brysonLinearByHand() {
    // The product of the other seven distances is as 1 / d.
    const Weights weights = weightsAt(oneCube(), WeightKind::kBrysonLinear, kQuarterWay);
    const double low = std::sqrt(56.25);
    const double high = std::sqrt(106.25);
    for (std::size_t c = 0; c < 8; ++c)
      FT_VERIFY_MATCH(near(weights[c], 0.25 * (c % 2 == 0 ? high : low) / (low + high), 1e-12));
  }

  void brysonBumpByHand() {
    const Weights feet = weightsAt(oneCube(), WeightKind::kBrysonBump, kNearCorner);
    const Weights decimetres = weightsAt(oneCube(), WeightKind::kBrysonBump, kNearCorner, 0.1);
    const double nearer_m = std::sqrt(0.0053) - std::sqrt(0.0013);
    FT_VERIFY_MATCH(near(feet[0] / feet[2], std::exp(nearer_m / 0.3048), 1e-9));
    FT_VERIFY_MATCH(near(decimetres[0] / decimetres[2], std::exp(nearer_m / 0.1), 1e-9));
    for (const Weights& weights : {feet, decimetres})
      for (std::size_t c = 3; c < 8; ++c) QCOMPARE(weights[c], 0.0);
  }

  void aSmallUnitOfTheBumpDoesNotUnderflow() {
    const Weights weights =
        weightsAt({cube(5.0), {{0, 1, 2, 3, 4, 5, 6, 7}}}, WeightKind::kBrysonBump, {2.0, 2.0, 2.0}, 0.001);
    FT_VERIFY_MATCH(near(weights[0], 1.0, 1e-12));
  }

  void theBumpsEndCanBeGiven() {
    WeightRule rule;
    rule.kind = WeightKind::kBrysonBump;
    rule.d_max_m = 0.05;
    const Weights weights = cornerWeights(rule, {0.1, 0.2}, {0.04, 0.06, 0.07, 0.08, 0.09, 0.1, 0.11, 0.12});
    QCOMPARE(weights[0], 1.0);
    // Beyond it from every corner, the eight count alike.
    rule.d_max_m = 0.03;
    QCOMPARE(cornerWeights(rule, {0.1, 0.2}, {0.04, 0.06, 0.07, 0.08, 0.09, 0.1, 0.11, 0.12})[7], 0.125);
  }

  void briggsByHand() {
    const Weights weights = weightsAt(oneCube(), WeightKind::kBriggs, kQuarterWay);
    const Weights published = weightsAt(oneCube(), WeightKind::kBriggsAsPublished, kQuarterWay);
    for (std::size_t c = 0; c < 8; ++c) {
      const bool is_near = c % 2 == 0;
      // 1/56.25 and 1/106.25 are as 17 and 9, and eight of them are 104.
      FT_VERIFY_MATCH(near(weights[c], (is_near ? 17.0 : 9.0) / 104.0, 1e-12));
      // The eight squared distances add up to 650 cm2.
      FT_VERIFY_MATCH(near(published[c], 650.0 / (is_near ? 56.25 : 106.25), 1e-9));
    }
  }

  void inTheCentreOfACubeTheEightCountAlike() {
    for (const WeightKind kind : kNormalised) {
      const Weights weights = weightsAt(oneCube(), kind, {0.05, 0.05, 0.05});
      for (const double weight : weights) FT_VERIFY_MATCH(near(weight, 0.125, 1e-12));
    }
    // With eight equal distances the published weights are 8 each: 64 times too much.
    for (const double weight : weightsAt(oneCube(), WeightKind::kBriggsAsPublished, {0.05, 0.05, 0.05}))
      FT_VERIFY_MATCH(near(weight, 8.0, 1e-9));
  }

  void atACornerItAloneCounts() {
    std::vector<Eigen::Vector3d> flat_m = cube(0.1);
    for (Eigen::Vector3d& corner_m : flat_m) corner_m.z() *= 0.2;
    for (const HexahedralCells& cells : {oneCube(), HexahedralCells(flat_m, {{0, 1, 2, 3, 4, 5, 6, 7}})})
      for (const WeightKind kind : kNormalised)
        for (std::size_t c = 0; c < 8; ++c) {
          const Weights weights = weightsAt(cells, kind, cells.corner_m(0, c));
          for (std::size_t other = 0; other < 8; ++other)
            FT_VERIFY_MATCH(near(weights[other], other == c ? 1.0 : 0.0, 1e-12));
        }
  }

  void allButThePublishedAddUpToOne() {
    const HexahedralCells cells = oneCube();
    for (const Eigen::Vector3d& p_m : randomPoints(200)) {
      const Eigen::Vector3d inside_m = 0.05 * p_m;
      for (const WeightKind kind : kNormalised)
        FT_VERIFY_MATCH(near(sum(weightsAt(cells, kind, inside_m)), 1.0, 1e-12));
      QVERIFY(sum(weightsAt(cells, WeightKind::kBriggsAsPublished, inside_m)) >= 64.0 - 1e-9);
    }
  }
};

FIELDTRUE_TEST(CornerWeightsTest)
#include "corner_weights_test.moc"
