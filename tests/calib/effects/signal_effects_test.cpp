#include <QTest>

#include "tests/calib/effects/reading_of.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::effectOf;
using fieldtrue::testing::near;

/// range_noise, correlated_samples, quantization and hemisphere_flip: what they ask of the electronics. What becomes of
/// it in a reading is the simulator's test.
class SignalEffectsTest : public QObject {
  Q_OBJECT
 private slots:
  void noiseMultiplies();
  void theStrongerFilterHolds();
  void theCoarserStepHolds();
  void eitherMayFlip();
};

void SignalEffectsTest::noiseMultiplies() {
  field::SignalModel signal;
  effectOf("range_noise", {{"factor", 2.0}, {"power", 0.5}})->disturb(signal);
  effectOf("range_noise", {{"factor", 1.5}, {"power", 1.0}})->disturb(signal);
  QCOMPARE(signal.noise_factor, 3.0);
  QCOMPARE(signal.noise_range_power, 1.5);
}

void SignalEffectsTest::theStrongerFilterHolds() {
  field::SignalModel signal;
  signal.correlation = 0.5;
  effectOf("correlated_samples", {{"correlation", 0.3}})->disturb(signal);
  QCOMPARE(signal.correlation, 0.5);
  effectOf("correlated_samples", {{"correlation", 0.9}})->disturb(signal);
  QCOMPARE(signal.correlation, 0.9);
}

void SignalEffectsTest::theCoarserStepHolds() {
  field::SignalModel signal;
  signal.quantum_m = 1e-3;
  effectOf("quantization", {{"quantum_m", 1e-4}, {"quantum_rad", 0.01}})->disturb(signal);
  QCOMPARE(signal.quantum_m, 1e-3);
  QCOMPARE(signal.quantum_rad, 0.01);
}

// Two independent reasons of 10 % and 20 %: 1 - 0.9 * 0.8.
void SignalEffectsTest::eitherMayFlip() {
  field::SignalModel signal;
  effectOf("hemisphere_flip", {{"probability", 0.1}})->disturb(signal);
  effectOf("hemisphere_flip", {{"probability", 0.2}})->disturb(signal);
  FT_VERIFY_MATCH(near(signal.flip_probability, 0.28, 1e-15));
}

FIELDTRUE_TEST(SignalEffectsTest)
#include "signal_effects_test.moc"
