#include "calib/field/plane_images.h"

#include <QTest>
#include <cmath>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::field;
using fieldtrue::testing::near;

Q_DECLARE_METATYPE(std::optional<double>)
Q_DECLARE_METATYPE(fieldtrue::field::Excitation)

class PlaneImagesTest : public QObject {
  Q_OBJECT
 private slots:
  void reflectAsTheSlabDoes_data();
  void reflectAsTheSlabDoes();
  void giveTheFieldOnTheAxis();
  void recedeAsMaxwellSays();
};

void PlaneImagesTest::reflectAsTheSlabDoes_data() {
  QTest::addColumn<Metal>("metal");
  QTest::addColumn<std::optional<double>>("thickness_m");
  QTest::addColumn<Excitation>("excitation");
  const std::optional<double> solid;
  const Excitation ac;
  const Excitation late{true, 0.0, 2e-3};
  QTest::newRow("aluminium 1 mm, carrier") << Metal{3.5e7, 1.0} << std::optional(1e-3) << ac;
  QTest::newRow("foil, carrier") << Metal{3.5e7, 1.0} << std::optional(20e-6) << ac;
  QTest::newRow("poor conductor, carrier") << Metal{1e2, 1.0} << solid << ac;
  QTest::newRow("solid steel, carrier") << Metal{6e6, 100.0} << solid << ac;
  QTest::newRow("steel 2 mm, carrier") << Metal{6e6, 100.0} << std::optional(2e-3) << ac;
  QTest::newRow("aluminium 5 mm, pulsed") << Metal{3.5e7, 1.0} << std::optional(5e-3) << late;
  QTest::newRow("foil, pulsed") << Metal{3.5e7, 1.0} << std::optional(20e-6) << late;
  QTest::newRow("solid steel, pulsed") << Metal{6e6, 100.0} << solid << late;
}

void PlaneImagesTest::reflectAsTheSlabDoes() {
  QFETCH(Metal, metal);
  QFETCH(std::optional<double>, thickness_m);
  QFETCH(Excitation, excitation);
  const std::vector<PlaneImage> images = planeImages(metal, thickness_m, excitation);
  for (double k_per_m = 0.02; k_per_m < 60.0; k_per_m *= 1.07) {
    const double expected = seenResponse(
        [&](std::complex<double> s) { return slabReflection(k_per_m, metal, thickness_m, s); }, excitation);
    FT_VERIFY_MATCH(near(reflectionOf(images, k_per_m), expected, 1e-4));
  }
}

// An upright dipole has the axial field of integral k^2 exp(-k D) dk = 2/D^3 at a distance D; behind a plane every k is
// reflected on its own. The integral is summed here without any image.
void PlaneImagesTest::giveTheFieldOnTheAxis() {
  const Metal aluminium{3.5e7, 1.0};
  const Excitation pulsed{true, 0.0, 1e-3};
  const std::vector<PlaneImage> images = planeImages(aluminium, 1e-3, pulsed);
  for (const double distance_m : {0.4, 1.0, 3.0}) {
    double from_images = 0.0;
    for (const PlaneImage& image : images) {
      from_images += 2.0 * image.strength / std::pow(distance_m + image.deeper_m, 3);
    }
    double integral = 0.0;
    constexpr int kSteps = 4000;
    const double step_per_m = 40.0 / distance_m / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      const double k_per_m = (i + 0.5) * step_per_m;
      const double reflected =
          seenResponse([&](std::complex<double> s) { return slabReflection(k_per_m, aluminium, 1e-3, s); }, pulsed);
      integral += k_per_m * k_per_m * reflected * std::exp(-k_per_m * distance_m) * step_per_m;
    }
    FT_VERIFY_MATCH(near(from_images / integral, 1.0, 2e-4));
  }
}

// Published speeds: the image in 1 mm of aluminium is 9 cm deeper after 2 ms and 36 cm after 8 ms, in 5 mm it moves at
// 9 m/s, in 20 um of foil at 2,274 m/s. The mean depth is the slope of the reflection at long waves; the currents
// spread through the sheet add at most its thickness.
void PlaneImagesTest::recedeAsMaxwellSays() {
  const auto depth_m = [](double thickness_m, double delay_s) {
    const std::vector<PlaneImage> images = planeImages({3.5e7, 1.0}, thickness_m, Excitation{true, 0.0, delay_s});
    return -std::log(reflectionOf(images, 0.2)) / 0.2;
  };
  FT_VERIFY_MATCH(near(depth_m(1e-3, 2e-3), 0.091, 0.002));
  FT_VERIFY_MATCH(near(depth_m(1e-3, 8e-3), 0.364, 0.002));
  FT_VERIFY_MATCH(near(depth_m(5e-3, 8e-3), 8.0e-3 * 9.1, 0.005));
  FT_VERIFY_MATCH(near(depth_m(20e-6, 1e-3), 2.274, 0.01));
}

FIELDTRUE_TEST(PlaneImagesTest)
#include "plane_images_test.moc"
