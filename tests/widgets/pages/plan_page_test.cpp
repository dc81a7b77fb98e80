#include "widgets/pages/plan_page.h"

#include <QComboBox>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSpinBox>
#include <QTest>
#include <limits>
#include <nlohmann/json.hpp>

#include "acquisition/session/session_store.h"
#include "tests/support/matchers.h"
#include "tests/widgets/pages/window_driver.h"

/// The page shows a plan in any unit without changing it, builds a large one beside the window, and refuses one that is
/// too large before it is built.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

class PlanPageTest : public WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase() {
    showWindow();
    click("step_plan");
    page_ = window_->findChild<PlanPage*>();
    QVERIFY(page_);
  }
  void cleanup() { choose(LengthUnit::kMetre); }
  void cleanupTestCase() { closeWindow(); }

  void anotherUnitChangesNoLength() {
    find<QDoubleSpinBox>("pitch_x")->setValue(0.25);
    find<QDoubleSpinBox>("pitch_y")->setValue(0.3333);
    const acquisition::Plan before = page_->plan();
    QCOMPARE(before.pitch_m.x(), 0.25);
    for (const LengthUnit unit : {LengthUnit::kFoot, LengthUnit::kMillimetre, LengthUnit::kInch, LengthUnit::kMetre}) {
      choose(unit);
      QVERIFY2(isSame(page_->plan(), before), qPrintable(unitSymbol(unit)));
    }
    QCOMPARE(find<QDoubleSpinBox>("pitch_x")->text(), QStringLiteral("0.2500"));
  }

  void aPlanIsKeptInAnotherUnit() {
    acquisition::Plan plan;
    plan.counts = {2, 3, 6};
    plan.pitch_m = {0.25, 0.35, 0.45};
    plan.origin_m = Eigen::Vector3d(0.51, -0.101, -1.0 / 3.0);
    plan.order = acquisition::PlanOrder::kRandom;
    plan.seed = std::numeric_limits<std::uint64_t>::max();
    plan.pipe_base_m = -1.2345;
    const QString path = folder_.filePath(QStringLiteral("kept.fieldtrue"));
    FT_VERIFY_OK(acquisition::SessionStore::create(path, plan, TableMetadata{}));
    choose(LengthUnit::kFoot);
    window_->workbench().openSession(path);
    QTRY_COMPARE_WITH_TIMEOUT(page_->plan().counts, plan.counts, kWaitMs);
    QVERIFY(isSame(page_->plan(), plan));
    QCOMPARE(find<QDoubleSpinBox>("pitch_x")->text(), QStringLiteral("0.820"));
    // Only what is entered changes.
    find<QDoubleSpinBox>("pitch_y")->setValue(2.0);
    plan.pitch_m.y() = 2.0 * 0.3048;
    QVERIFY(isSame(page_->plan(), plan));

    auto* seed = find<QLineEdit>("seed");
    QCOMPARE(seed->text(), QStringLiteral("18446744073709551615"));
    seed->selectAll();
    QTest::keyClicks(seed, QStringLiteral("18446744073709551616"));
    QVERIFY2(problem().startsWith(QStringLiteral("The seed must be")), qPrintable(problem()));
    QVERIFY(!find<QPushButton>("createSession")->isEnabled());
    seed->selectAll();
    QTest::keyClicks(seed, QStringLiteral("17"));
    QCOMPARE(problem(), QString());
    QCOMPARE(page_->plan().seed, std::uint64_t{17});
  }

  void aPlanThatIsTooLargeIsNotBuilt() {
    for (const char* name : {"count_x", "count_y", "count_z"}) find<QSpinBox>(name)->setValue(1);
    for (const auto& [name, count] : {std::pair("count_x", 40), {"orientations", 24}, {"seatings", 8}})
      find<QSpinBox>(name)->setValue(count);
    QCOMPARE(problem(), QString());
    QVERIFY(find<QPushButton>("createSession")->isEnabled());
    find<QSpinBox>("count_y")->setValue(40);
    QVERIFY2(problem().contains(QStringLiteral("more than 100000 stops")), qPrintable(problem()));
    QVERIFY(!find<QPushButton>("createSession")->isEnabled());
    QVERIFY(find<QLabel>("planSummary")->text().isEmpty());
    find<QSpinBox>("count_y")->setValue(1);
    QCOMPARE(problem(), QString());
    QVERIFY(find<QPushButton>("createSession")->isEnabled());
  }

  void aLargePlanIsBuiltBesideTheWindow() {
    const auto summary = [this] { return find<QLabel>("planSummary")->text(); };
    const auto ended = [] {
      QThreadPool::globalInstance()->waitForDone();
      QCoreApplication::sendPostedEvents();
    };
    for (const auto& [name, count] :
         {std::pair("count_z", 1), {"count_x", 40}, {"count_y", 11}, {"orientations", 24}, {"seatings", 8}})
      find<QSpinBox>(name)->setValue(count);
    // 40 x 13 x 24 x 8; the last of those asked for is shown.
    find<QSpinBox>("count_y")->setValue(12);
    find<QSpinBox>("count_y")->setValue(13);
    QVERIFY2(summary().startsWith(QStringLiteral("Laying out 99840 placements")), qPrintable(summary()));
    QVERIFY(find<QPushButton>("createSession")->isEnabled());
    ended();
    QVERIFY2(summary().startsWith(QStringLiteral("99840 placements on 1 level, ")), qPrintable(summary()));

    find<QSpinBox>("count_y")->setValue(12);
    QVERIFY2(summary().startsWith(QStringLiteral("Laying out 92160 placements")), qPrintable(summary()));
    find<QSpinBox>("count_y")->setValue(40);
    ended();
    QVERIFY2(problem().contains(QStringLiteral("more than 100000 stops")) && summary().isEmpty(),
             qPrintable(summary()));

    find<QSpinBox>("count_y")->setValue(12);
    for (const char* name : {"orientations", "seatings"}) find<QSpinBox>(name)->setValue(1);
    const QString small = summary();
    QVERIFY2(small.startsWith(QStringLiteral("480 placements on 1 level, ")), qPrintable(small));
    ended();
    QCOMPARE(summary(), small);
  }

 private:
  QString problem() { return find<QLabel>("planProblem")->text(); }
  void choose(LengthUnit unit) {
    auto* box = find<QComboBox>("placingUnit");
    box->setCurrentIndex(box->findData(static_cast<int>(unit)));
  }
  /// To the bit, which a text of it need not tell.
  static bool isSame(const acquisition::Plan& a, const acquisition::Plan& b) {
    return a.pitch_m == b.pitch_m && a.origin_m == b.origin_m && a.pipe_base_m == b.pipe_base_m &&
           toJson(a) == toJson(b);
  }
  PlanPage* page_ = nullptr;
};

FIELDTRUE_WINDOW_TEST(PlanPageTest)
#include "plan_page_test.moc"
