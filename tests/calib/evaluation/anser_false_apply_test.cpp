#include <QTest>

#include "tests/studies/verdict_outcome.h"
#include "tests/support/real_data.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

const std::vector<MethodText> kMethods = {{"affine", {}}, {"polynomial", {}},       {"hmq", {}},
                                          {"rbf", {}},    {"gaussian_process", {}}, {"harmonic_field", {}}};

/// Over many splits: how often the verdict said "apply", how often that did harm, and how often the best method would
/// have done harm had it always been applied.
struct Tally {
  int n_splits = 0;
  int n_applied = 0;
  int n_false = 0;
  int n_worse = 0;

  void add(const VerdictOutcome& outcome) {
    ++n_splits;
    n_applied += outcome.applied ? 1 : 0;
    n_false += outcome.isFalse() ? 1 : 0;
    n_worse += outcome.bestIsWorse() ? 1 : 0;
  }
  QString text() const {
    return QString("%1 splits, %2 applied, %3 of them wrongly; %4 had everything been applied")
        .arg(n_splits)
        .arg(n_applied)
        .arg(n_false)
        .arg(n_worse);
  }
};

/// At most one split in twenty may be applied wrongly, and a verdict that applies whatever looks best would be caught.
void judge(const Tally& tally) {
  QVERIFY2(20 * tally.n_false <= tally.n_splits, qPrintable(tally.text()));
  QVERIFY2(20 * tally.n_worse > 2 * tally.n_splits, qPrintable(tally.text()));
}

}  // namespace

/// Calibrations made on one half of the places, judged on a quarter and tried on the quarter that is left: the verdict
/// must not be fooled by chance, and must see what stands out.
class AnserFalseApplyTest : public QObject {
  Q_OBJECT
 private slots:
  void splitsPlaces();
  void isNotFooledByNoise();
  void isNotFooledByRecordings();
  void seesAMixedRoom();
};

void AnserFalseApplyTest::splitsPlaces() {
  CalibrationTable table;
  table.nodes.resize(41);
  for (std::size_t i = 0; i < 41; ++i) table.nodes[i].node = static_cast<int>(i);
  const auto placesOf = [&](std::uint64_t seed, NodeRole role) {
    std::vector<int> places;
    for (const Node& node : splitForVerdict(table, seed).nodes)
      if (node.role == role) places.push_back(node.node);
    return places;
  };
  QCOMPARE(placesOf(1, NodeRole::kFit).size(), std::size_t{21});
  QCOMPARE(placesOf(1, NodeRole::kValidation).size(), std::size_t{10});
  QCOMPARE(placesOf(1, NodeRole::kSkipped).size(), std::size_t{10});
  QVERIFY(placesOf(1, NodeRole::kFit) == placesOf(1, NodeRole::kFit));
  QVERIFY(placesOf(1, NodeRole::kFit) != placesOf(2, NodeRole::kFit));
}

// A tracker without any error but noise: every correction is wrong, whatever a split makes of it.
void AnserFalseApplyTest::isNotFooledByNoise() {
  SyntheticOptions straight;
  straight.counts = {5, 4, 2};
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const CalibrationTable table = syntheticTable(straight, {.seed = seed, .position_sd_m = 0.002});
    VerdictOutcome outcome = verdictOutcome(splitForVerdict(table, seed), kMethods);
    if (outcome.applied) outcome.after_m = HUGE_VAL;
    tally.add(outcome);
  }
  judge(tally);
}

// Every recording counts, also those that a correction helps: a split may still choose one that does harm.
void AnserFalseApplyTest::isNotFooledByRecordings() {
  FT_REQUIRE_REAL_DATA();
  Tally tally;
  for (const char* condition : kAnserConditions) {
    const CalibrationTable table = readAnser(*realData("anser_duplo/nodes.csv"), condition);
    for (std::uint64_t seed = 1; seed <= 40; ++seed) tally.add(verdictOutcome(splitForVerdict(table, seed), kMethods));
  }
  judge(tally);
}

void AnserFalseApplyTest::seesAMixedRoom() {
  const simulation::Scene scene = readRoom(FIELDTRUE_RESOURCES, "mixed");
  int n_harmonic = 0;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    const CalibrationTable split = splitForVerdict(tableToFit(recordRoom(scene, seed, 0, 2)), seed);
    const VerdictOutcome polynomial = verdictOutcome(split, {MethodText{"polynomial", {{"degree", "2"}}}});
    QVERIFY(polynomial.applied);
    QVERIFY(polynomial.after_m < 0.9 * polynomial.before_m);
    const VerdictOutcome harmonic = verdictOutcome(split, {MethodText{"harmonic_field", {}}});
    QVERIFY(harmonic.after_m < 0.9 * harmonic.before_m);
    n_harmonic += harmonic.applied ? 1 : 0;
    QVERIFY(!verdictOutcome(split, {{"rigid", {}}}).applied);
  }
  // Of one split's 25 places the harmonic field takes one from 153 to 348 mm: that may be refused.
  QVERIFY(n_harmonic >= 3);
}

FIELDTRUE_TEST(AnserFalseApplyTest)
#include "anser_false_apply_test.moc"
