#include "calib/correctors/harmonic/harmonic_field_choices.h"

#include <QTest>
#include <array>
#include <utility>

#include "tests/support/test_main.h"

using namespace fieldtrue::correctors;

namespace {

/// One source, at a place of its own for each number.
std::vector<Eigen::Vector3d> sourceAt(int number) { return {Eigen::Vector3d(0.1 * number, 0.0, 0.0)}; }

}  // namespace

/// When going on with other sources brings nothing better.
class HarmonicFieldChoicesTest : public QObject {
  Q_OBJECT
 private slots:
  void aRoundEndsAtItsBest() {
    HarmonicChoices choices;
    QVERIFY(!choices.isLastFinal());
    const std::array<std::pair<int, double>, 4> steps = {{{1, 3.0}, {2, 2.0}, {1, 3.0}, {2, 2.0}}};
    for (std::size_t i = 0; i < steps.size(); ++i) {
      choices.add(sourceAt(steps[i].first), steps[i].second);
      QCOMPARE(choices.isLastFinal(), i == 3);
    }
  }

  void theOrderOfSourcesIsNoOtherChoice() {
    HarmonicChoices choices;
    const Eigen::Vector3d a(0.1, 0.0, 0.0), b(0.0, 0.2, 0.0);
    choices.add({a, b}, 1.0);
    choices.add({a}, 2.0);
    choices.add({b, a}, 1.0);
    QVERIFY(choices.isLastFinal());
  }

  /// A choice that stays is settled by the fit itself.
  void aChoiceThatStaysIsNoRound() {
    HarmonicChoices choices;
    for (int i = 0; i < 4; ++i) {
      choices.add(sourceAt(1), 1.0);
      QVERIFY(!choices.isLastFinal());
    }
  }

  void wanderingEndsNearTheLeast() {
    HarmonicChoices choices;
    for (int i = 0; i < 6; ++i) {
      choices.add(sourceAt(i), 1.0);
      QVERIFY(!choices.isLastFinal());
    }
    choices.add(sourceAt(6), 1.1);  // A tenth more than the least of the last six.
    QVERIFY(!choices.isLastFinal());
    choices.add(sourceAt(7), 1.01);
    QVERIFY(choices.isLastFinal());
  }

  void gettingBetterIsNotWandering() {
    HarmonicChoices choices;
    for (int i = 0; i < 12; ++i) {
      choices.add(sourceAt(i), 1.0 - 0.05 * i);
      QVERIFY(!choices.isLastFinal());
    }
  }
};

FIELDTRUE_TEST(HarmonicFieldChoicesTest)
#include "harmonic_field_choices_test.moc"
