#include "calib/gap/judgement.h"

#include <QTest>
#include <array>

#include "tests/calib/gap/gap_fixtures.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

namespace {

/// A body that stands there in some of six equal parts of the session.
CalibrationTable recordedWhileABodyStood(const std::array<bool, 6>& parts) {
  const std::vector<PlannedPlace> plan = gapPlan({.counts = {5, 5, 5}});
  simulation::Scene scene = gapScene();
  CalibrationTable table = recordedIn(scene, plan);
  scene.effects.push_back(
      {"compact_metal", nlohmann::json::parse(R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.15})")});
  const CalibrationTable beside = recordedIn(scene, plan);
  for (std::size_t i = 0; i < table.nodes.size(); ++i)
    if (parts[6 * i / table.nodes.size()]) table.nodes[i] = beside.nodes[i];
  return table;
}

QString tracesOf(const CalibrationTable& table) {
  const identify::GapRows rows = identify::makeGapRows(table.nodes, table.metadata).value();
  const identify::GapSearch search(rows, {});
  const identify::EffectSelection selection = identify::selectEffects(search, {}, {});
  QStringList texts;
  for (const identify::Trace& trace : leftBy(search, selection.model.model).traces)
    if (trace.p_value < search.thresholds().sure_trace) texts << QString::fromStdString(trace.text);
  return texts.join("; ");
}

}  // namespace

class JudgementTest : public QObject {
  Q_OBJECT
 private slots:
  /// Taking the best at each step, folds take the body that passes for all three errors, which foretells worse than a
  /// field without a name: what the whole recording names must compete in them.
  void namesErrorsThatOneBodyHides() {
    const CalibrationTable table = instrumentErrors();
    const identify::GapRows rows = identify::makeGapRows(table.nodes, table.metadata).value();
    const identify::GapSearch search(rows, {});
    const Judgement judgement = judge(search, identify::selectEffects(search, {}, {}), {});
    QVERIFY(judgement.refusal == Refusal::kNone);
    QCOMPARE(judgement.selection.ways.size(), std::size_t{3});
    const double left = judgement.far.remaining().value;
    QVERIFY2(std::abs(left) < 0.1, qPrintable(QString::number(left)));
  }

  void whatStoodThereAllTheTimeLeavesNoTrace() {
    QCOMPARE(tracesOf(recordedWhileABodyStood({true, true, true, true, true, true})), QString());
  }

  void whatCameAndWentIsTold() {
    const QString told = tracesOf(recordedWhileABodyStood({false, true, false, true, false, true}));
    QVERIFY2(told.contains("did not stand there alike all the time"), qPrintable(told));
  }
};

FIELDTRUE_TEST(JudgementTest)
#include "judgement_test.moc"
