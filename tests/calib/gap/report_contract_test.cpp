#include <QTest>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "calib/gap/report_json.h"
#include "tests/calib/gap/diagnosis_checks.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;
using nlohmann::json;

namespace {

double signedRoot(double square) { return std::copysign(std::sqrt(std::abs(square)), square); }

bool isNear(double a, double b) { return std::abs(a - b) <= 1e-9 * std::max({1.0, std::abs(a), std::abs(b)}); }

/// The verdict as the contract of the file words it.
std::string verdictByContract(const json& report) {
  if (report["verdict"] == "no_gap") return "no_gap";
  const json& end = report["remaining"]["fraction_low90"];
  const double low = end.is_number() ? end : report["remaining"]["fraction_of_start"];
  const bool is_named = std::any_of(report["selected"].begin(), report["selected"].end(), [](const json& s) {
    return s.contains("credit_fraction") && s["bic_gain"] != 0.0;
  });
  if (!is_named || low > 0.5) return "unexplained";
  return low > 0.15 ? "partly_explained" : "explained";
}

/// One thing that is wrong with a recording, and how it is recorded.
struct Room {
  const char* effect;
  const char* parameters;
  int orientations = 1;
  bool position_only = false;
};

const std::map<std::string, Room> kRooms = {
    {"nothing", {"", "{}"}},
    {"body", {"compact_metal", R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.15})"}},
    {"weak body", {"compact_metal", R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.07})"}},
    {"floor", {"metal_plane", R"({"distance_m": 1.5})"}},
    {"floor, positions", {"metal_plane", R"({"distance_m": 1.5})", 1, true}},
    {"tilt", {"jig_tilt", R"({"shear_rad": [0.02, -0.01, 0.0]})"}},
    {"drift", {"gain_drift", R"({"slope_per_s": 5e-5})"}},
    {"coils, three turns", {"coil_gain", R"({"receiver_gain": [0.02, -0.01, -0.01]})", 3}},
};

CalibrationTable recordedRoom(const Room& room) {
  simulation::Scene scene = gapScene();
  if (*room.effect != '\0') {
    json parameters = json::parse(room.parameters);
    scene.effects.push_back({room.effect, std::move(parameters)});
  }
  GapPlan plan;
  if (room.orientations == 3) plan = {.counts = {4, 3, 3}, .orientations = threeTurns()};
  CalibrationTable table = recordedIn(scene, gapPlan(plan));
  for (Node& node : table.nodes) node.has_orientation = !room.position_only;
  return table;
}

/// A floor, a bar, a loop and a sphere at once, on a hundred places above the floor.
CalibrationTable recordedInMixedRoom() {
  const simulation::Scene scene = simulation::readScene(FIELDTRUE_RESOURCES "/rooms/mixed.scene.json").value();
  std::vector<PlannedPlace> plan = gapPlan({.counts = {5, 5, 4}, .pitch_m = 0.3}, 11);
  for (PlannedPlace& place : plan) place.reference_from_sensor.position_m += Eigen::Vector3d(-0.2, 0.6, 0.3);
  return recordedIn(scene, plan, 11);
}

/// Errors that no physics of the catalogue makes: smooth over the grid, or of each place alone.
CalibrationTable foreign(const std::string& kind) {
  CalibrationTable table = recordedIn(gapScene(), gapPlan());
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (Node& node : table.nodes) {
    Eigen::Vector3d& p_m = node.tracker_from_sensor.position_m;
    const Eigen::Vector3d at = 4.0 * p_m;
    if (kind == "swirl")
      p_m += 0.01 * Eigen::Vector3d(std::sin(at.y() + at.z()), std::sin(at.z() - at.x()), std::cos(at.x() * at.y()));
    if (kind == "scatter") p_m += 0.03 * Eigen::Vector3d(normal(generator), normal(generator), normal(generator));
    if (kind == "less exact") p_m += 0.002 * Eigen::Vector3d(normal(generator), normal(generator), normal(generator));
  }
  return table;
}

std::string textOf(const json& value) { return value.dump(); }

json reportOf(const CalibrationTable& table) {
  const auto report = gap::diagnose(table, nullptr, nullptr);
  if (!report) qFatal("%s", report.error().message.c_str());
  return toJson(*report);
}

/// Of each room one report serves all tests.
const json& reportNamed(const QString& room) {
  static std::map<QString, json> made;
  const auto known = made.find(room);
  if (known != made.end()) return known->second;
  const auto found = kRooms.find(room.toStdString());
  const CalibrationTable table = found != kRooms.end() ? recordedRoom(found->second)
                                 : room == "mixed"     ? recordedInMixedRoom()
                                                       : foreign(room.toStdString());
  return made.emplace(room, reportOf(table)).first->second;
}

}  // namespace

/// Every report says one thing in all its places.
class ReportContractTest : public QObject {
  Q_OBJECT
 private slots:
  void agreesWithItself_data() {
    QTest::addColumn<QString>("room");
    for (const auto& [name, room] : kRooms) QTest::newRow(name.c_str()) << QString::fromStdString(name);
    for (const char* kind : {"swirl", "scatter", "less exact", "mixed"}) QTest::newRow(kind) << QString(kind);
  }
  void agreesWithItself() {
    QFETCH(QString, room);
    const json report = reportNamed(room);
    const json& remaining = report["remaining"];
    const json& selected = report["selected"];
    const json& sequence = report["sequence"];
    QCOMPARE(report["verdict"].get<std::string>(), verdictByContract(report));
    QCOMPARE(sequence.size(), selected.size() + 1);
    // Who leads the ranking is named, where anything is: what nobody would believe stands behind it.
    const json& first = report["candidates"][0];
    const json same = first.value("equivalents", json::array());
    const auto is_first = [&](const json& one) {
      return one["effect"] == first["effect"] || std::find(same.begin(), same.end(), one["effect"]) != same.end();
    };
    QVERIFY2(selected.empty() || std::any_of(selected.begin(), selected.end(), is_first), first.dump().c_str());
    // The way from start to end, in the waterfall, in the effects and in what remains.
    double excess2 = remaining["excess2_before_mm2"];
    QVERIFY(isNear(sequence[0]["excess_mm"], signedRoot(excess2)));
    for (std::size_t s = 0; s < selected.size(); ++s) {
      const json& effect = selected[s];
      QVERIFY(effect["effect"] == sequence[s + 1]["effect"]);
      QVERIFY(isNear(effect["excess2_before_mm2"], excess2));
      excess2 = effect["excess2_after_mm2"];
      const json& shrinkage = effect["shrinkage"];
      QVERIFY(isNear(shrinkage["before_mm"], signedRoot(effect["excess2_before_mm2"])));
      QVERIFY(isNear(shrinkage["after_mm"], signedRoot(excess2)));
      QVERIFY(isNear(sequence[s + 1]["excess_mm"], signedRoot(excess2)));
      if (remaining["of"] == "position")
        QVERIFY(isNear(shrinkage["fraction"], 1.0 - excess2 / effect["excess2_before_mm2"].get<double>()));
      const bool is_second = std::any_of(selected.begin(), selected.begin() + static_cast<std::ptrdiff_t>(s),
                                         [&](const json& other) { return other["effect"] == effect["effect"]; });
      for (const json& candidate : report["candidates"])
        if (candidate["effect"] == effect["effect"] && !is_second) QVERIFY(candidate["shrinkage"] == shrinkage);
      QVERIFY(report["text"].get<std::string>().find("falls") != std::string::npos ||
              report["text"].get<std::string>().find("goes from") != std::string::npos ||
              remaining["of"] == "rotation");
      // No effect stays that makes unseen places worse.
      const char* excess = remaining["of"] == "position" ? "excess_mm" : "excess_deg";
      QVERIFY2(sequence[s + 1][excess] < sequence[s][excess], effect.dump().c_str());
      QVERIFY2(effect["bic_gain"] > 0.0 && effect["probability"] > 0.0, effect.dump().c_str());
    }
    QVERIFY(isNear(remaining["excess2_after_mm2"], excess2));
    if (remaining["of"] == "position" && !selected.empty())
      QVERIFY(isNear(remaining["fraction_of_start"], excess2 / remaining["excess2_before_mm2"].get<double>()));
    // What is left has one interval, in the sentence's millimetres and as a share.
    if (remaining["of"] == "position" && !selected.empty() && remaining["fraction_high90"].is_number()) {
      for (const auto& [share, mm] :
           {std::pair("fraction_low90", "low90_mm"), std::pair("fraction_high90", "high90_mm")})
        QVERIFY(isNear(sequence.back()[mm],
                       signedRoot(remaining[share].get<double>() * remaining["excess2_before_mm2"].get<double>())));
    }
    for (const json& candidate : report["candidates"]) {
      const json radius_m = candidate.value("parameters", json::object()).value("radius_m", json::object());
      if (radius_m.contains("low90") && radius_m["low90"].is_number()) QVERIFY(radius_m["low90"] >= 0.0);
    }
    if (selected.empty()) QCOMPARE(remaining["fraction_of_start"].get<double>(), 1.0);
    // The floor beside it.
    const double floor_mm = report["gap"]["floor_position_mm"];
    const double rms_mm = remaining["position_rms_mm"];
    QVERIFY(isNear(rms_mm * rms_mm - floor_mm * floor_mm, excess2));
    QVERIFY(remaining["p50_mm"] <= remaining["p90_mm"] && remaining["p90_mm"] <= remaining["p95_mm"] &&
            remaining["p95_mm"] <= remaining["worst_mm"]);
  }

  /// Rows that are said to stand out stand out more than any that are not, and what is measured next separates what the
  /// sentence cannot tell.
  void advisesOnWhatItSays_data() { agreesWithItself_data(); }
  void advisesOnWhatItSays() {
    QFETCH(QString, room);
    const json report = reportNamed(room);
    double least_flagged = std::numeric_limits<double>::infinity(), most_other = 0.0;
    for (const json& node : report["where"]["nodes"]) {
      if (node["flagged"]) least_flagged = std::min<double>(least_flagged, node["excess"]);
      if (!node["flagged"]) most_other = std::max<double>(most_other, node["excess"]);
    }
    QVERIFY(least_flagged >= most_other);
    if (report["text"].get<std::string>().find("these readings cannot tell") == std::string::npos) return;
    const json& separates = report["next_measurement"]["separates"];
    const json& alike = report["selected"][0]["class"];
    QCOMPARE(separates.size(), std::size_t{2});
    for (const json& one : separates)
      QVERIFY2(std::find(alike.begin(), alike.end(), one) != alike.end(), one.dump().c_str());
  }

  /// A body and a swirl of no physics: the body is named, and what it leaves is told to have another cause.
  void namesAPartOfWhatItCannotExplain() {
    CalibrationTable table = recordedRoom(kRooms.at("body"));
    const CalibrationTable swirling = foreign("swirl"), plain = recordedIn(gapScene(), gapPlan());
    for (std::size_t i = 0; i < table.nodes.size(); ++i) {
      table.nodes[i].tracker_from_sensor.position_m +=
          0.3 * (swirling.nodes[i].tracker_from_sensor.position_m - plain.nodes[i].tracker_from_sensor.position_m);
    }
    const json report = reportOf(table);
    QCOMPARE(report["verdict"].get<std::string>(), std::string("partly_explained"));
    QCOMPARE(verdictByContract(report), std::string("partly_explained"));
    QCOMPARE(report["selected"][0]["effect"].get<std::string>(), std::string("compact_metal"));
    QVERIFY(report["remaining"]["fraction_low90"] > 0.15);
    QVERIFY(report["text"].get<std::string>().find("partly explained by: Compact metal body") != std::string::npos);
  }

  /// What single readings show is in no mean: nothing of the means' figures is told of it.
  void effectsOfTheSignalTakeNothing() {
    simulation::Scene scene = gapScene();
    scene.tracker.correlation = 0.9;
    SampleTable samples;
    const CalibrationTable table = recordedIn(scene, gapPlan({.counts = {3, 3, 3}}), 1, &samples);
    const auto made = gap::diagnose(table, &samples, nullptr);
    FT_VERIFY_OK(made);
    const json report = toJson(*made);
    const auto found = std::find_if(report["selected"].begin(), report["selected"].end(),
                                    [](const json& one) { return one["effect"] == "correlated_samples"; });
    QVERIFY(found != report["selected"].end());
    for (const char* key : {"excess2_before_mm2", "excess2_after_mm2", "credit_fraction"})
      QVERIFY2((*found)[key].is_null(), key);
    for (const auto& [key, value] : (*found)["shrinkage"].items()) QVERIFY2(value.is_null(), key.c_str());
  }

  /// Rivals without a name stand in every ranking, and what is likeliest is what is said.
  void theRankingIsWhole_data() { agreesWithItself_data(); }
  void theRankingIsWhole() {
    QFETCH(QString, room);
    const json report = reportNamed(room);
    double sum = 0.0;
    std::set<std::string> ids;
    for (const json& candidate : report["candidates"]) {
      sum += candidate["probability"].get<double>();
      ids.insert(candidate["effect"].get<std::string>());
    }
    QVERIFY(isNear(sum, 1.0));
    for (const char* id : {"none", "unnamed_smooth", "unnamed_scattered"}) QVERIFY2(ids.count(id) == 1, id);
    const std::string first = report["candidates"][0]["effect"];
    if (report["verdict"] == "no_gap") QCOMPARE(first, std::string("none"));
    if (report["selected"].empty() && report["verdict"] == "unexplained")
      QVERIFY2(first.starts_with("unnamed_"), first.c_str());
    if (!report["selected"].empty()) QVERIFY2(!first.starts_with("unnamed_") && first != "none", first.c_str());
    if (report["odds_over_next"].is_null()) return;  // The next has no probability at all.
    const double odds = report["odds_over_next"];
    QVERIFY(isNear(odds, report["candidates"][0]["probability"].get<double>() /
                             report["candidates"][1]["probability"].get<double>()));
  }

  void whatHasNoNameGetsNone() {
    const json swirl = reportOf(foreign("swirl"));
    QVERIFY2(swirl["verdict"] == "unexplained", textOf(swirl["verdict"]).c_str());
    QVERIFY2(swirl["selected"].empty(), swirl["text"].dump().c_str());
    QVERIFY2(swirl["candidates"][0]["effect"] == "unnamed_smooth", textOf(swirl["candidates"][0]["effect"]).c_str());
    const json scatter = reportOf(foreign("scatter"));
    QVERIFY2(scatter["verdict"] == "unexplained", textOf(scatter["verdict"]).c_str());
    QVERIFY2(scatter["selected"].empty(), scatter["text"].dump().c_str());
    QVERIFY2(scatter["candidates"][0]["effect"] == "unnamed_scattered",
             textOf(scatter["candidates"][0]["effect"]).c_str());
  }

  /// A tolerance that is stated at half of what it is says that it is too small: a finding, and no gap.
  void aToleranceTooSmallIsNoGap() {
    for (const double factor : {0.5, 2.0}) {
      for (const std::uint64_t seed : {std::uint64_t{1}, std::uint64_t{2}, std::uint64_t{3}}) {
        CalibrationTable table = recordedIn(gapScene(), gapPlan(), seed);
        table.metadata.jig_tolerance_m = factor * *table.metadata.jig_tolerance_m;
        table.metadata.jig_tolerance_rad = factor * *table.metadata.jig_tolerance_rad;
        const json report = reportOf(table);
        QVERIFY2(report["verdict"] == "no_gap", report["text"].dump().c_str());
        const bool is_told = report["findings"].dump().find("less exact than stated") != std::string::npos;
        QCOMPARE(is_told, factor < 1.0);
      }
    }
  }
};

FIELDTRUE_TEST(ReportContractTest)
#include "report_contract_test.moc"
