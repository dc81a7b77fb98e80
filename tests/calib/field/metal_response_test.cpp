#include "calib/field/metal_response.h"

#include <QTest>
#include <cmath>

#include "calib/core/units.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::field;
using fieldtrue::testing::near;

namespace {

const Metal kAluminium{3.5e7, 1.0};
const Metal kCopper{5.8e7, 1.0};
const Metal kSteel{6e6, 100.0};
const Metal kStainless{1.4e6, 1.0};

std::complex<double> atFrequency(double radius_m, const Metal& metal, double frequency_hz) {
  return sphereSusceptibility(radius_m, metal, std::complex<double>(0.0, 2.0 * kPi * frequency_hz));
}

Excitation pulsed(double delay_s) { return {true, 0.0, delay_s}; }

}  // namespace

class MetalResponseTest : public QObject {
  Q_OBJECT
 private slots:
  void sphereAnswersAsTabulated_data();
  void sphereAnswersAsTabulated();
  void sphereHasItsLimits();
  void sphereIsSmoothWhereTheSeriesTakesOver();
  void sphereDecaysByItsModes_data();
  void sphereDecaysByItsModes();
  void sphereForgetsAtItsSlowestRate_data();
  void sphereForgetsAtItsSlowestRate();
  void steelTurnsFromConductorToMagnet();
  void knowsTheSkinDepth();
  void thinSheetRecedes_data();
  void thinSheetRecedes();
  void thickMetalReflectsFromItsComplexDepth();
  void slabHasItsLimits();
  void cableLoopAnswersAsTabulated();
};

// Wait 1951: the table of an independent numerical study of the same formula, to two digits.
void MetalResponseTest::sphereAnswersAsTabulated_data() {
  QTest::addColumn<Metal>("metal");
  QTest::addColumn<double>("radius_m");
  QTest::addColumn<double>("frequency_hz");
  QTest::addColumn<double>("in_phase");
  QTest::addColumn<double>("quadrature");
  struct Row {
    const char* name;
    Metal metal;
    double radius_m;
    double chi[4][2];
  };
  const Row rows[] = {
      {"aluminium 1.25 cm", kAluminium, 0.0125, {{0.00, -0.04}, {-0.15, -0.37}, {-1.02, -0.38}, {-1.35, -0.14}}},
      {"aluminium 5 cm", kAluminium, 0.05, {{-0.22, -0.43}, {-1.12, -0.32}, {-1.38, -0.12}, {-1.46, -0.04}}},
      {"steel 1.25 cm", kSteel, 0.0125, {{2.90, -0.05}, {2.73, -0.24}, {2.18, -0.59}, {0.95, -0.93}}},
      {"steel 5 cm", kSteel, 0.05, {{2.69, -0.27}, {1.99, -0.68}, {0.64, -0.93}, {-0.63, -0.62}}},
      {"steel 10 cm", kSteel, 0.1, {{2.40, -0.47}, {1.23, -0.90}, {-0.20, -0.79}, {-1.05, -0.38}}},
      {"stainless 5 cm", kStainless, 0.05, {{0.00, -0.02}, {-0.07, -0.26}, {-0.90, -0.44}, {-1.31, -0.18}}}};
  constexpr double kFrequencies_hz[] = {8.0, 100.0, 1e3, 1e4};
  for (const Row& row : rows) {
    for (int i = 0; i < 4; ++i) {
      QTest::addRow("%s, %g Hz", row.name, kFrequencies_hz[i])
          << row.metal << row.radius_m << kFrequencies_hz[i] << row.chi[i][0] << row.chi[i][1];
    }
  }
}

void MetalResponseTest::sphereAnswersAsTabulated() {
  QFETCH(Metal, metal);
  QFETCH(double, radius_m);
  QFETCH(double, frequency_hz);
  QFETCH(double, in_phase);
  QFETCH(double, quadrature);
  const std::complex<double> chi = atFrequency(radius_m, metal, frequency_hz);
  FT_VERIFY_MATCH(near(chi.real(), in_phase, 0.0056));
  FT_VERIFY_MATCH(near(chi.imag(), quadrature, 0.0056));
  const double seen = sphereSusceptibility(radius_m, metal, Excitation{false, frequency_hz, 0.0});
  FT_VERIFY_MATCH(near(seen, chi.real(), 1e-12));
}

// 3 (mu_r - 1)/(mu_r + 2) at rest, -3/2 when nothing has soaked in yet.
void MetalResponseTest::sphereHasItsLimits() {
  FT_VERIFY_MATCH(near(atFrequency(0.05, kSteel, 1e-9).real(), 3.0 * 99.0 / 102.0, 1e-6));
  FT_VERIFY_MATCH(near(std::abs(atFrequency(0.05, kAluminium, 1e-9)), 0.0, 1e-6));
  FT_VERIFY_MATCH(near(std::abs(atFrequency(0.05, kSteel, 1e16) + 1.5), 0.0, 1e-3));
  FT_VERIFY_MATCH(near(sphereSusceptibility(0.05, kAluminium, pulsed(0.0)), -1.5, 1e-6));
  FT_VERIFY_MATCH(near(sphereSusceptibility(0.05, kSteel, pulsed(1e4)), 3.0 * 99.0 / 102.0, 1e-6));
}

void MetalResponseTest::sphereIsSmoothWhereTheSeriesTakesOver() {
  // |alpha|^2 = 1e-2 at this frequency; the quadrature is linear in it there, but for a part of 1e-4 of itself squared.
  const double frequency_hz = 1e-2 / (2.0 * kPi * kMu0_h_per_m * 3.5e7 * 0.05 * 0.05);
  const double below = atFrequency(0.05, kAluminium, 0.999 * frequency_hz).imag() / 0.999;
  const double above = atFrequency(0.05, kAluminium, 1.001 * frequency_hz).imag() / 1.001;
  FT_VERIFY_MATCH(near(below / above, 1.0, 1e-6));
}

void MetalResponseTest::sphereDecaysByItsModes_data() {
  QTest::addColumn<double>("delay_s");
  for (const double delay_s : {2e-5, 2e-4, 1e-3, 5e-3, 2e-2}) QTest::addRow("%g s", delay_s) << delay_s;
}

// Not magnetic: tanh has its poles at alpha = i n pi, and the residues give
// chi(t) = -(9/pi^2) sum exp(-n^2 t/tau)/n^2, tau = mu_0 sigma a^2/pi^2.
void MetalResponseTest::sphereDecaysByItsModes() {
  QFETCH(double, delay_s);
  const double tau_s = kMu0_h_per_m * 3.5e7 * 0.05 * 0.05 / (kPi * kPi);
  double expected = 0.0;
  for (int n = 1; n < 4000; ++n) expected -= 9.0 / (kPi * kPi * n * n) * std::exp(-n * n * delay_s / tau_s);
  FT_VERIFY_MATCH(near(sphereSusceptibility(0.05, kAluminium, pulsed(delay_s)), expected, 1e-7));
}

void MetalResponseTest::sphereForgetsAtItsSlowestRate_data() {
  QTest::addColumn<Metal>("metal");
  QTest::addColumn<double>("radius_m");
  QTest::addColumn<double>("tau_ms");
  QTest::addColumn<double>("half_digit_ms");
  QTest::newRow("aluminium 1.25 cm") << kAluminium << 0.0125 << 0.70 << 0.005;
  QTest::newRow("aluminium 5 cm") << kAluminium << 0.05 << 11.0 << 0.5;
  QTest::newRow("aluminium 10 cm") << kAluminium << 0.1 << 45.0 << 0.5;
  QTest::newRow("copper 1.25 cm") << kCopper << 0.0125 << 1.2 << 0.05;
  QTest::newRow("copper 5 cm") << kCopper << 0.05 << 18.0 << 0.5;
  QTest::newRow("copper 10 cm") << kCopper << 0.1 << 74.0 << 0.5;
  QTest::newRow("stainless 1.25 cm") << kStainless << 0.0125 << 0.03 << 0.005;
  QTest::newRow("stainless 5 cm") << kStainless << 0.05 << 0.45 << 0.005;
  QTest::newRow("stainless 10 cm") << kStainless << 0.1 << 1.8 << 0.05;
}

// Late decay between 3 and 4 tau, tabulated by an independent study to the digits shown.
void MetalResponseTest::sphereForgetsAtItsSlowestRate() {
  QFETCH(Metal, metal);
  QFETCH(double, radius_m);
  QFETCH(double, tau_ms);
  QFETCH(double, half_digit_ms);
  const double early = sphereSusceptibility(radius_m, metal, pulsed(3e-3 * tau_ms));
  const double late = sphereSusceptibility(radius_m, metal, pulsed(4e-3 * tau_ms));
  FT_VERIFY_MATCH(near(tau_ms / std::log(early / late), tau_ms, half_digit_ms));
}

// At a Fastrak's four carriers a fist of steel keeps the field out, at rest it draws it in.
void MetalResponseTest::steelTurnsFromConductorToMagnet() {
  for (const double carrier_hz : {8013.0, 10016.0, 12019.0, 14022.0}) {
    QVERIFY(sphereSusceptibility(0.05, kSteel, Excitation{false, carrier_hz, 0.0}) < -0.4);
  }
  QVERIFY(sphereSusceptibility(0.05, kSteel, pulsed(2e-3)) > 1.5);
}

// sqrt(2/(w mu sigma)): 0.85 mm in aluminium and 0.21 mm in this steel at 10 kHz, by hand.
void MetalResponseTest::knowsTheSkinDepth() {
  FT_VERIFY_MATCH(near(skinDepth_m(kAluminium, 1e4) * 1e3, 0.8507, 1e-4));
  FT_VERIFY_MATCH(near(skinDepth_m(kSteel, 1e4) * 1e3, 0.2055, 1e-4));
}

void MetalResponseTest::thinSheetRecedes_data() {
  QTest::addColumn<double>("conductivity_s_per_m");
  QTest::addColumn<double>("thickness_m");
  QTest::addColumn<double>("speed_m_per_s");
  QTest::newRow("aluminium 1 mm") << 3.5e7 << 1e-3 << 45.5;
  QTest::newRow("foil 20 um") << 3.5e7 << 20e-6 << 2274.0;
  QTest::newRow("1 mm of 6e6 S/m") << 6e6 << 1e-3 << 265.0;
}

// Maxwell's receding image (Saslow 1992): a thin sheet's reflection at a delay t is exp(-k w t), w = 2/(mu_0 sigma d).
// Its own diffusion time mu sigma d^2/pi^2 is far below t here.
void MetalResponseTest::thinSheetRecedes() {
  QFETCH(double, conductivity_s_per_m);
  QFETCH(double, thickness_m);
  QFETCH(double, speed_m_per_s);
  const double receded_m = 0.5;
  const double delay_s = receded_m / speed_m_per_s;
  for (const double k_per_m : {0.2, 1.0, 3.0}) {
    const double seen = seenResponse(
        [&](std::complex<double> s) {
          return slabReflection(k_per_m, {conductivity_s_per_m, 1.0}, thickness_m, s);
        },
        pulsed(delay_s));
    FT_VERIFY_MATCH(near(-std::log(seen) / k_per_m, receded_m, 0.005));
  }
}

// Complex image: total distance 2 h + (1 - i) delta, so a field of k delta << 1 reflects as exp(-k (1 - i) delta).
void MetalResponseTest::thickMetalReflectsFromItsComplexDepth() {
  const double delta_m = skinDepth_m(kAluminium, 50.0);
  for (const double k_delta : {0.01, 0.05}) {
    const std::complex<double> seen =
        slabReflection(k_delta / delta_m, kAluminium, std::nullopt, std::complex<double>(0.0, 2.0 * kPi * 50.0));
    const std::complex<double> expected = std::exp(-k_delta * std::complex<double>(1.0, -1.0));
    FT_VERIFY_MATCH(near(std::abs(seen - expected), 0.0, 0.5 * std::pow(k_delta, 3)));
  }
}

// A perfect conductor reflects 1, a permeable half-space at rest -(mu_r - 1)/(mu_r + 1); a slab many skins deep is a
// half-space.
void MetalResponseTest::slabHasItsLimits() {
  FT_VERIFY_MATCH(near(std::abs(slabReflection(2.0, kAluminium, std::nullopt, 1e18) - 1.0), 0.0, 1e-6));
  FT_VERIFY_MATCH(near(slabReflection(2.0, kSteel, std::nullopt, 0.0).real(), -99.0 / 101.0, 1e-12));
  const std::complex<double> s(0.0, 2.0 * kPi * 1e3);
  const std::complex<double> thick = slabReflection(2.0, kSteel, 0.02, s);
  FT_VERIFY_MATCH(near(std::abs(thick - slabReflection(2.0, kSteel, std::nullopt, s)), 0.0, 1e-12));
}

// Copper cable, ring of 0.5 m radius, wire of 1 mm radius: L = 3.95 uH, R = 17 mohm, so 0.23 ms; nearly all of the
// current at 10 kHz and nothing after some milliseconds.
void MetalResponseTest::cableLoopAnswersAsTabulated() {
  const double rate_per_s = 17.25e-3 / 3.95e-6;
  FT_VERIFY_MATCH(near(1e3 / rate_per_s, 0.23, 0.005));
  FT_VERIFY_MATCH(near(inductiveShare(rate_per_s, Excitation{}), 0.995, 0.001));
  FT_VERIFY_MATCH(near(inductiveShare(rate_per_s, pulsed(1e-3)), 0.0127, 0.001));
  FT_VERIFY_MATCH(near(inductiveShare(rate_per_s, pulsed(0.0)), 1.0, 1e-12));
}

FIELDTRUE_TEST(MetalResponseTest)
#include "metal_response_test.moc"
