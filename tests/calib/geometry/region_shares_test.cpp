#include "calib/geometry/region_shares.h"

#include <QTest>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

class RegionSharesTest : public QObject {
  Q_OBJECT
 private slots:
  /// Of a grid of 3 x 3 x 3 the place in the middle is nearest to an eighth of the box, a face's to a sixteenth, an
  /// edge's to 1/32, a corner's to 1/64.
  void aPlaceStandsForWhatIsNearestToIt() {
    std::vector<Eigen::Vector3d> places_m;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        for (int k = 0; k < 3; ++k) places_m.push_back(0.3 * Eigen::Vector3d(i, j, k));
    const std::vector<double> shares = regionShares(places_m);
    FT_VERIFY_MATCH(near(shares[13], 1.0 / 8.0, 2e-3));
    FT_VERIFY_MATCH(near(shares[4], 1.0 / 16.0, 2e-3));
    FT_VERIFY_MATCH(near(shares[1], 1.0 / 32.0, 2e-3));
    FT_VERIFY_MATCH(near(shares[0], 1.0 / 64.0, 2e-3));
    double sum = 0.0;
    for (const double share : shares) sum += share;
    FT_VERIFY_MATCH(near(sum, 1.0, 1e-12));
  }

  /// In one plane the shares are of its area.
  void placesInAPlane() {
    std::vector<Eigen::Vector3d> places_m;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) places_m.emplace_back(0.3 * i, 0.3 * j, 0.5);
    const std::vector<double> shares = regionShares(places_m);
    FT_VERIFY_MATCH(near(shares[4], 1.0 / 4.0, 2e-3));
    FT_VERIFY_MATCH(near(shares[1], 1.0 / 8.0, 2e-3));
    FT_VERIFY_MATCH(near(shares[0], 1.0 / 16.0, 2e-3));
  }

  /// However it lies: a board held askew is measured as one that lies flat, by places exact or to a few millimetres.
  void aPlaneMayBeTilted_data() {
    QTest::addColumn<double>("off_m");
    QTest::newRow("exact") << 0.0;
    QTest::newRow("1 mm off it") << 0.001;
  }
  void aPlaneMayBeTilted() {
    QFETCH(double, off_m);
    const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 0.5).normalized()));
    std::vector<Eigen::Vector3d> places_m;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        places_m.push_back(tilt * Eigen::Vector3d(0.3 * i, 0.3 * j, 0.5 + ((i + j) % 2 == 0 ? off_m : -off_m)));
    const std::vector<double> shares = regionShares(places_m);
    FT_VERIFY_MATCH(near(shares[4], 1.0 / 4.0, 5e-3));
    FT_VERIFY_MATCH(near(shares[1], 1.0 / 8.0, 5e-3));
    FT_VERIFY_MATCH(near(shares[0], 1.0 / 16.0, 5e-3));
  }

  /// A slab held askew fills a seventh of its upright box: its places still share as those of one that lies flat.
  void aSlabMayBeTilted() {
    const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 0.5).normalized()));
    std::vector<Eigen::Vector3d> places_m;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        for (int k = 0; k < 2; ++k) places_m.push_back(tilt * Eigen::Vector3d(0.3 * i, 0.3 * j, 0.05 * k));
    const std::vector<double> shares = regionShares(places_m);
    FT_VERIFY_MATCH(near(shares[8], 1.0 / 8.0, 8e-3));
    FT_VERIFY_MATCH(near(shares[0], 1.0 / 32.0, 8e-3));
  }

  /// On a line they are of its length.
  void placesOnALine() {
    const std::vector<Eigen::Vector3d> on_a_line = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {5, 0, 0}};
    const std::vector<double> shares = regionShares(on_a_line);
    const std::vector<double> lengths = {0.5 / 5.0, 1.0 / 5.0, 2.0 / 5.0, 1.5 / 5.0};
    for (std::size_t i = 0; i < lengths.size(); ++i) FT_VERIFY_MATCH(near(shares[i], lengths[i], 2e-3));
    std::vector<Eigen::Vector3d> askew;
    for (const Eigen::Vector3d& at : on_a_line) askew.push_back(at.x() * Eigen::Vector3d(1, 2, -0.5).normalized());
    for (std::size_t i = 0; i < lengths.size(); ++i) FT_VERIFY_MATCH(near(regionShares(askew)[i], lengths[i], 2e-3));
  }

  void placesThatEncloseNothingShareAlike() {
    const std::vector<Eigen::Vector3d> at_one_point(4, {0.1, 0.2, 0.3});
    for (const double share : regionShares(at_one_point)) FT_VERIFY_MATCH(near(share, 0.25, 1e-12));
  }
};

FIELDTRUE_TEST(RegionSharesTest)
#include "region_shares_test.moc"
