#include <QElapsedTimer>
#include <QTest>
#include <atomic>
#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>

#include "calib/gap/report_json.h"
#include "tests/calib/gap/diagnosis_checks.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

namespace {

constexpr const char* kBody = R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.15})";

RunControl onThreads(std::size_t count) {
  RunControl control;
  control.parallel_for = [count](std::size_t n, const std::function<void(std::size_t)>& body) {
    std::atomic<std::size_t> next = 0;
    const auto work = [&] {
      for (std::size_t i = next++; i < n; i = next++) body(i);
    };
    std::vector<std::jthread> threads;
    for (std::size_t t = 1; t < count; ++t) threads.emplace_back(work);
    work();
  };
  return control;
}

}  // namespace

/// What every diagnosis must do, whatever the recording.
class DiagnosisTest : public QObject {
  Q_OBJECT
 private slots:
  void findsNoGapWhereNothingWasWithheld_data() {
    QTest::addColumn<int>("seed");
    for (const int seed : {1, 2, 3, 4}) QTest::addRow("seed %d", seed) << seed;
  }
  void findsNoGapWhereNothingWasWithheld() {
    QFETCH(int, seed);
    const auto report = diagnose(recordedIn(gapScene(), gapPlan(), static_cast<std::uint64_t>(seed)), nullptr, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY2(report->verdict == GapVerdict::kNoGap, report->text.c_str());
    QVERIFY(report->selected.empty());
    FT_VERIFY_MATCH(near(report->ratio_to_floor, 1.0, 0.15));
    QVERIFY(!report->smallest_detectable.empty());
    for (const SmallestDetectable& smallest : report->smallest_detectable)
      QVERIFY2(smallest.value > 0.0 && std::isfinite(smallest.value), smallest.effect.c_str());
  }

  /// A gain half as large as what is said to be the smallest visible stays unseen; three times as large, it is found.
  void smallestVisibleIsWhatItSays() {
    const auto none = diagnose(recordedIn(gapScene(), gapPlan()), nullptr, nullptr);
    FT_VERIFY_OK(none);
    double smallest = 0.0;
    for (const SmallestDetectable& one : none->smallest_detectable)
      if (one.effect == "global_gain") smallest = one.value;
    QVERIFY(smallest > 0.0);
    for (const auto& [factor, is_seen] : {std::pair{0.5, false}, std::pair{3.0, true}}) {
      const Withheld made = withheldFrom("global_gain", nlohmann::json{{"gain", factor * smallest}}.dump());
      const auto report = diagnose(made.table, nullptr, nullptr);
      FT_VERIFY_OK(report);
      QVERIFY2(report->selected.empty() != is_seen, report->text.c_str());
    }
  }

  void isTheSameOnAnyNumberOfThreads() {
    const Withheld made = withheldFrom("compact_metal", kBody);
    const auto one = diagnose(made.table, nullptr, nullptr);
    FT_VERIFY_OK(one);
    for (const std::size_t count : {std::size_t{2}, std::size_t{3}}) {
      const auto more = diagnose(made.table, nullptr, nullptr, {}, onThreads(count));
      FT_VERIFY_OK(more);
      QVERIFY(toJson(*more) == toJson(*one));
    }
  }

  void stopsSoonAfterItIsTold() {
    const Withheld made = withheldFrom("compact_metal", kBody);
    for (const double at : {0.0, 0.3, 0.75}) {
      std::stop_source source;
      QElapsedTimer since;
      RunControl control;
      control.stop = source.get_token();
      control.progress = [&](double fraction) {
        if (fraction < at || source.stop_requested()) return;
        source.request_stop();
        since.start();
      };
      const auto report = diagnose(made.table, nullptr, nullptr, {}, control);
      QVERIFY(!report && report.error().code == ErrorCode::kCancelled);
      QVERIFY2(since.elapsed() < 2000, qPrintable(QString("%1 ms after %2").arg(since.elapsed()).arg(at)));
    }
  }

  void tellsItsProgress() {
    double last = 0.0;
    bool only_grows = true;
    RunControl control;
    control.progress = [&](double fraction) {
      only_grows = only_grows && fraction >= last && fraction <= 1.0;
      last = fraction;
    };
    FT_VERIFY_OK(diagnose(recordedIn(gapScene(), gapPlan()), nullptr, nullptr, {}, control));
    QVERIFY(only_grows);
    QCOMPARE(last, 1.0);
  }

  void worksOnWhatPeopleHave_data() {
    QTest::addColumn<int>("shape");
    QTest::newRow("40 places") << 0;
    QTest::newRow("positions only") << 1;
    QTest::newRow("scattered") << 2;
    QTest::newRow("three orientations") << 3;
    QTest::newRow("no noise stated") << 4;
    QTest::newRow("no times") << 5;
    QTest::newRow("means and samples") << 6;
  }
  void worksOnWhatPeopleHave() {
    QFETCH(int, shape);
    GapPlan plan;
    if (shape == 0) plan.counts = {5, 4, 2};
    if (shape == 2) plan.is_scattered = true;
    if (shape == 3) plan = {.counts = {4, 3, 3}, .orientations = threeTurns()};
    simulation::Scene scene = gapScene();
    scene.effects.push_back({"compact_metal", nlohmann::json::parse(kBody)});
    SampleTable samples;
    CalibrationTable table = recordedIn(scene, gapPlan(plan), 1, shape == 6 ? &samples : nullptr);
    for (Node& node : table.nodes) {
      if (shape == 1) node.has_orientation = false;
      if (shape == 5) node.t_start_s = node.t_end_s = std::nullopt;
      if (shape != 4) continue;
      node.covariance_m2.reset();
      node.sd_rot_rad.reset();
    }
    if (shape == 4) table.metadata.jig_tolerance_m = table.metadata.jig_tolerance_rad = std::nullopt;
    const auto report = diagnose(table, shape == 6 ? &samples : nullptr, nullptr);
    FT_VERIFY_OK(report);
    QCOMPARE(report->input.places, shape == 0 ? 40 : shape == 3 ? 36 : 80);
    QCOMPARE(report->input.rows, static_cast<int>(table.nodes.size()));
    QCOMPARE(report->input.orientations, shape == 3 ? 3 : 1);
    QCOMPARE(report->input.position_only, shape == 1);
    QCOMPARE(report->input.samples, static_cast<int>(samples.rows.size()));
    QVERIFY2(report->verdict != GapVerdict::kNoGap, report->text.c_str());
    double sum = 0.0;
    for (const GapCandidate& candidate : report->candidates) sum += candidate.probability;
    FT_VERIFY_MATCH(near(sum, 1.0, 1e-9));
  }

  /// However sure the evidence, a share of a thing's name is left to what the catalogue does not hold.
  void noNameIsSurerThanTheCatalogueIsWhole() {
    const Withheld made = withheldFrom("compact_metal", kBody);
    const auto report = diagnose(made.table, nullptr, &made.believed);
    FT_VERIFY_OK(report);
    const GapCandidate& first = report->candidates.front();
    QCOMPARE(first.effect, std::string("compact_metal"));
    const double most = 1.0 - identify::Thresholds{}.unknown_as_thing;
    QVERIFY2(first.probability <= most + 1e-9 && first.probability > 0.5,
             qPrintable(QString::number(first.probability)));
  }

  void believesWhatTheSceneHas() {
    const Withheld made = withheldFrom("compact_metal", kBody);
    simulation::Scene complete = made.believed;
    complete.effects.push_back({"compact_metal", nlohmann::json::parse(kBody)});
    const auto report = diagnose(made.table, nullptr, &complete);
    FT_VERIFY_OK(report);
    QVERIFY2(report->verdict == GapVerdict::kNoGap, report->text.c_str());
  }

  void refusesWhatItCannotUse() {
    const CalibrationTable whole = recordedIn(gapScene(), gapPlan());
    CalibrationTable few = whole;
    few.nodes.resize(7);
    const auto too_few = diagnose(few, nullptr, nullptr);
    QVERIFY(!too_few && too_few.error().code == ErrorCode::kTooFewNodes);
    FT_VERIFY_MATCH(holdsAll(too_few.error().message, {"8 places", "has 7"}));
    simulation::Scene broken = gapScene();
    broken.effects.push_back({"ghost", {}});
    const auto unknown = diagnose(whole, nullptr, &broken);
    QVERIFY(!unknown && unknown.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(unknown.error().message, {"ghost"}));
  }

  /// A row that is not a number is left out, named, and changes nothing else.
  void saysWhichRowIsNotANumber() {
    const CalibrationTable whole = recordedIn(gapScene(), gapPlan());
    CalibrationTable damaged = whole;
    damaged.nodes[5].tracker_from_sensor.position_m.y() = std::nan("");
    CalibrationTable without = whole;
    without.nodes.erase(without.nodes.begin() + 5);
    const auto report = diagnose(damaged, nullptr, nullptr);
    FT_VERIFY_OK(report);
    QCOMPARE(report->findings.size(), std::size_t{1});
    QCOMPARE(report->findings.front().nodes, std::vector<int>{whole.nodes[5].node});
    const auto expected = diagnose(without, nullptr, nullptr);
    QVERIFY(toJson(*report).at("candidates") == toJson(*expected).at("candidates"));
  }
};

FIELDTRUE_TEST(DiagnosisTest)
#include "diagnosis_test.moc"
