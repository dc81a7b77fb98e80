#include <QTest>

#include "tests/studies/halves.h"
#include "tests/support/real_data.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

const std::vector<MethodText> kMethods = {{"affine", {}}, {"polynomial", {}},       {"hmq", {}},
                                          {"rbf", {}},    {"gaussian_process", {}}, {"harmonic_field", {}}};

int appliedOf(const CalibrationTable& table, const std::vector<MethodText>& methods, int n_splits) {
  int n_applied = 0;
  for (int split = 1; split <= n_splits; ++split)
    n_applied += saysApply(splitInHalves(table, static_cast<std::uint64_t>(split)), methods) ? 1 : 0;
  return n_applied;
}

}  // namespace

/// Calibrations made on one half of the places and judged on the other: the verdict must not be fooled by chance, and
/// must see what stands out.
class AnserFalseApplyTest : public QObject {
  Q_OBJECT
 private slots:
  void splitsPlacesInHalves();
  void isNotFooledByChance();
  void seesAMixedRoom();
};

void AnserFalseApplyTest::splitsPlacesInHalves() {
  CalibrationTable table;
  table.nodes.resize(41);
  for (std::size_t i = 0; i < 41; ++i) table.nodes[i].node = static_cast<int>(i);
  const auto fitted = [&](std::uint64_t seed) {
    std::vector<int> places;
    for (const Node& node : splitInHalves(table, seed).nodes)
      if (node.role == NodeRole::kFit) places.push_back(node.node);
    return places;
  };
  QCOMPARE(fitted(1).size(), std::size_t{21});
  QVERIFY(fitted(1) == fitted(1));
  QVERIFY(fitted(1) != fitted(2));
}

// The recordings that no method improves when each place is left out in turn: to apply one would be wrong.
void AnserFalseApplyTest::isNotFooledByChance() {
  FT_REQUIRE_REAL_DATA();
  constexpr int kSplits = 20;
  int n_tables = 0;
  int n_applied = 0;
  for (const char* condition : kAnserConditions) {
    const CalibrationTable table = readAnser(*realData("anser_duplo/nodes.csv"), condition);
    if (helpsByAllPlaces(table, kMethods)) continue;
    ++n_tables;
    n_applied += appliedOf(table, kMethods, kSplits);
  }
  QVERIFY2(n_tables >= 2, "most of these recordings hold little smooth error");
  QVERIFY2(n_applied <= n_tables * kSplits / 20,
           qPrintable(QString("%1 of %2").arg(n_applied).arg(n_tables * kSplits)));
}

void AnserFalseApplyTest::seesAMixedRoom() {
  const Scene scene = readRoom(FIELDTRUE_RESOURCES, "mixed");
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const CalibrationTable table = splitInHalves(tableToFit(recordRoom(scene, seed, 0, 2)), seed);
    QVERIFY(saysApply(table, {{"harmonic_field", {}}}));
    QVERIFY(saysApply(table, {{"polynomial", {{"degree", "2"}}}}));
    QVERIFY(!saysApply(table, {{"rigid", {}}}));
  }
}

QTEST_GUILESS_MAIN(AnserFalseApplyTest)
#include "anser_false_apply_test.moc"
