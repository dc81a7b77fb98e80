#include "calib/simulation/scene.h"

#include <QTemporaryDir>
#include <QTest>
#include <fstream>

#include "calib/core/file_io.h"
#include "calib/effects/effect_row.h"
#include "calib/effects/registry.h"
#include "calib/simulation/simulator.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::simulation;
using fieldtrue::testing::holdsAll;

namespace {

std::filesystem::path shippedScenes() { return std::filesystem::path(FIELDTRUE_RESOURCES) / "scenes"; }

/// Every key of the expected object stands in the seen one, at any depth; lists are compared item by item.
bool holdsEveryKey(const nlohmann::json& seen, const nlohmann::json& expected, std::string& missing) {
  if (expected.is_object()) {
    for (const auto& [key, value] : expected.items()) {
      if (!seen.contains(key)) {
        missing = key;
        return false;
      }
      if (!holdsEveryKey(seen.at(key), value, missing)) return false;
    }
  }
  if (expected.is_array() && seen.size() == expected.size()) {
    for (std::size_t i = 0; i < expected.size(); ++i) {
      if (!holdsEveryKey(seen[i], expected[i], missing)) return false;
    }
  }
  return true;
}

}  // namespace

class SceneTest : public QObject {
  Q_OBJECT
 private slots:
  void everyKeyIsOptional();
  void readsBackWhatItWrote();
  void readsWhatIsWritten();
  void refusesWithOneSentence_data();
  void refusesWithOneSentence();
  void refusesFilesWithOneSentence_data();
  void refusesFilesWithOneSentence();
  void readsCommentsOfBothKinds();
  void shippedScenesCanBeSimulated_data();
  void shippedScenesCanBeSimulated();
  void exampleHoldsEveryKeyWithItsDefault();
};

void SceneTest::everyKeyIsOptional() {
  const Result<Scene> scene = sceneFromJson(nlohmann::json::object(), "empty");
  FT_VERIFY_OK(scene);
  QVERIFY(toJson(*scene) == toJson(Scene{}));
  QVERIFY(scene->effects.empty());
}

void SceneTest::readsBackWhatItWrote() {
  Scene scene;
  scene.name = "laboratory 3";
  scene.tracker.excitation = "pulsed_dc";
  scene.tracker.sampling_delay_s = 0.1 / 3.0;
  scene.tracker.correlation = 0.3;
  scene.tracker.quantum_m = 1e-4;
  scene.tracker.nearest_range_m = 0.05;
  scene.reference_from_tracker = {{0.1, 0.2, 1.0 / 3.0}, Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5)};
  scene.rig = {"pegboard", 0.002, 0.01, true, 0.003, 0.02};
  const effects::Effect& metal = *effects::findEffect("compact_metal").value();
  scene.tracker.solver = "damped";
  scene.effects.push_back({"compact_metal", effects::resolveEffectParameters(metal, {{"radius_m", 0.3}}).value()});
  for (const effects::Effect& effect : effects::effects()) {
    scene.effects.push_back({effect.id, effects::resolveEffectParameters(effect, nullptr).value()});
  }
  const nlohmann::json written = toJson(scene);
  const Result<Scene> read = sceneFromJson(nlohmann::json::parse(written.dump()), "written");
  FT_VERIFY_OK(read);
  QVERIFY(toJson(*read) == written);
  FT_VERIFY_MATCH(testing::sameBits(read->reference_from_tracker, scene.reference_from_tracker));
}

void SceneTest::readsWhatIsWritten() {
  const auto json = nlohmann::json::parse(R"({
    "schema": "fieldtrue.scene/1", "name": "x",
    "tracker": {"name": "t", "carrier_hz": 8013, "dipole_constant_m3": 2, "rate_hz": 60, "coupling_noise": 1e-3},
    "transmitter": {"position_m": [1, 2, 3], "orientation_wxyz": [0, 0, 0, 1]},
    "rig": {"name": "bar", "tolerance_m": 0.004, "alignment": "known", "alignment_tolerance_m": 0.005},
    "effects": [{"id": "metal_plane", "parameters": {"distance_m": 2}}]})");
  const Result<Scene> scene = sceneFromJson(json, "x");
  FT_VERIFY_OK(scene);
  QCOMPARE(scene->tracker.name, "t");
  QCOMPARE(scene->tracker.carrier_hz, 8013.0);
  QCOMPARE(scene->tracker.dipole_constant_m3, 2.0);
  QCOMPARE(scene->tracker.rate_hz, 60.0);
  QCOMPARE(scene->tracker.coupling_noise, 1e-3);
  QCOMPARE(scene->reference_from_tracker.position_m, Eigen::Vector3d(1, 2, 3));
  QCOMPARE(scene->reference_from_tracker.orientation.z(), 1.0);
  QCOMPARE(scene->rig.name, "bar");
  QCOMPARE(scene->rig.tolerance_m, 0.004);
  QVERIFY(scene->rig.alignment_known);
  QCOMPARE(scene->rig.alignment_tolerance_m, 0.005);
  QCOMPARE(scene->effects.at(0).parameters.at("distance_m").get<double>(), 2.0);
  QCOMPARE(scene->effects.at(0).parameters.at("material").get<std::string>(), "conductive");
}

void SceneTest::refusesWithOneSentence_data() {
  QTest::addColumn<QByteArray>("json");
  QTest::addColumn<int>("code");
  QTest::addColumn<QList<QByteArray>>("fragments");
  const int bad = static_cast<int>(ErrorCode::kBadInput);
  const int newer = static_cast<int>(ErrorCode::kNewerVersion);
  const auto row = [](const char* name, const char* json, int code, const QList<QByteArray>& fragments) {
    QTest::newRow(name) << QByteArray(json) << code << fragments;
  };
  row("unknown key", R"({"trakcer": {}})", bad, {"lab: trakcer is not known", "did you mean tracker?"});
  row("unknown key below", R"({"tracker": {"rate": 60}})", bad, {"tracker.rate is not known", "did you mean rate_hz?"});
  row("key of another unit", R"({"rig": {"tolerance_mm": 1}})", bad, {"rig.tolerance_mm", "did you mean tolerance_m?"});
  row("text for number", R"({"tracker": {"rate_hz": "fast"}})", bad,
      {"tracker.rate_hz is the text \"fast\"", "number from 0.1 to 10000", "[Hz]"});
  row("bool for number", R"({"rig": {"tolerance_m": true}})", bad, {"rig.tolerance_m is true", "number"});
  row("out of range", R"({"tracker": {"correlation": 1}})", bad, {"tracker.correlation is 1", "0.999"});
  row("null", R"({"name": null})", bad, {"name is null", "a text"});
  row("bad choice", R"({"tracker": {"excitation": "dc"}})", bad, {"\"dc\"", "\"ac\" or \"pulsed_dc\""});
  row("bad solver", R"({"tracker": {"solver": "newton"}})", bad, {"tracker.solver", "\"closed_form\"", "\"damped\""});
  row("text for list", R"({"effects": [{"id": "jig_layer_offset", "parameters": {"heights_m": 0.3}}]})", bad,
      {"heights_m is 0.3", "a list of 1 to 64 numbers"});
  row("lists of two lengths", R"({"effects": [{"id": "jig_layer_offset", "parameters": {"offsets_m": [0.01]}}]})", bad,
      {"effects[0]", "heights_m has 4 numbers and offsets_m 1"});
  row("two numbers", R"({"transmitter": {"position_m": [1, 2]}})", bad, {"transmitter.position_m is [1,2]", "three"});
  row("zero quaternion", R"({"transmitter": {"orientation_wxyz": [0, 0, 0, 0]}})", bad, {"orientation_wxyz", "unit"});
  row("object for list", R"({"effects": {}})", bad, {"effects is an object", "a list"});
  row("list for object", R"({"rig": []})", bad, {"rig is []", "an object"});
  row("not an object", R"([1])", bad, {"lab", "must be an object"});
  row("effect without id", R"({"effects": [{}]})", bad, {"effects[0]", "Known: compact_metal"});
  row("unknown effect", R"({"effects": [{"id": "metal_plan"}]})", bad, {"effects[0]", "did you mean metal_plane?"});
  row("effect's parameter", R"({"effects": [{"id": "metal_plane", "parameters": {"distance_m": -1}}]})", bad,
      {"effects[0]", "metal_plane", "distance_m is -1", "0.05"});
  row("impossible effect",
      R"({"effects": [{"id": "metal_plane"}, {"id": "compact_metal", "parameters": {"radius_m": 9}}]})", bad,
      {"effects[1]", "transmitter inside"});
  row("ranges crossed", R"({"tracker": {"nearest_range_m": 5, "farthest_range_m": 3}})", bad, {"nearest_range_m", "3"});
  row("tolerance of unknown", R"({"rig": {"alignment_tolerance_m": 0.1}})", bad, {"alignment", "known"});
  row("newer", R"({"schema": "fieldtrue.scene/2"})", newer, {"fieldtrue.scene/2", "newer"});
  row("another schema", R"({"schema": "fieldtrue.gap/1"})", bad, {"fieldtrue.gap/1", "fieldtrue.scene/1"});
  row("schema of another kind", R"({"schema": 1})", bad, {"schema is 1", "fieldtrue.scene/1"});
}

void SceneTest::refusesWithOneSentence() {
  QFETCH(QByteArray, json);
  QFETCH(int, code);
  QFETCH(QList<QByteArray>, fragments);
  const Result<Scene> scene = sceneFromJson(nlohmann::json::parse(json.toStdString()), "lab");
  QVERIFY(!scene.has_value());
  QCOMPARE(static_cast<int>(scene.error().code), code);
  fragments << "lab";
  FT_VERIFY_MATCH(holdsAll(scene.error().message, fragments));
}

void SceneTest::refusesFilesWithOneSentence_data() {
  QTest::addColumn<QByteArray>("content");
  QTest::addColumn<QList<QByteArray>>("fragments");
  using List = QList<QByteArray>;
  QTest::newRow("missing comma") << QByteArray("{\n\"name\": \"a\"\n\"rig\": {}\n}")
                                 << List{"line 3", "not valid JSON"};
  QTest::newRow("cut off") << QByteArray("{\n\"tracker\": {\"rate_hz\": 6") << List{"line 2", "not valid JSON"};
  QTest::newRow("empty") << QByteArray() << List{"line 1", "not valid JSON"};
  QTest::newRow("huge number") << QByteArray("{\"tracker\": {\"rate_hz\": 1e999}}") << List{"too large"};
  QTest::newRow("binary") << QByteArray("\xff\xfe\x00\x01", 4) << List{"not valid JSON"};
}

void SceneTest::refusesFilesWithOneSentence() {
  QFETCH(QByteArray, content);
  QFETCH(QList<QByteArray>, fragments);
  const QTemporaryDir folder;
  const std::filesystem::path path = folder.filePath("broken.scene.json").toStdString();
  std::ofstream(path, std::ios::binary) << content.toStdString();
  const Result<Scene> scene = readScene(path);
  QVERIFY(!scene.has_value());
  fragments << "broken.scene.json";
  FT_VERIFY_MATCH(holdsAll(scene.error().message, fragments));
  QCOMPARE(readScene(folder.filePath("none.scene.json").toStdString()).error().code, ErrorCode::kIo);
}

void SceneTest::readsCommentsOfBothKinds() {
  const QTemporaryDir folder;
  const std::filesystem::path path = folder.filePath("a.scene.json").toStdString();
  std::ofstream(path) << "// a room\n{ \"comment\": \"x\", \"rig\": { \"comment\": [1] /* here */ } }";
  FT_VERIFY_OK(readScene(path));
}

void SceneTest::shippedScenesCanBeSimulated_data() {
  QTest::addColumn<QString>("file");
  for (const auto& entry : std::filesystem::directory_iterator(shippedScenes())) {
    const QString file = QString::fromStdString(entry.path().filename().string());
    QTest::newRow(qPrintable(file)) << file;
  }
}

void SceneTest::shippedScenesCanBeSimulated() {
  QFETCH(QString, file);
  QVERIFY2(file.endsWith(".scene.json"), qPrintable(file));
  const Result<Scene> scene = readScene(shippedScenes() / file.toStdString());
  FT_VERIFY_OK(scene);
  Result<TrackerSimulator> tracker = TrackerSimulator::make(*scene, 1);
  FT_VERIFY_OK(tracker);
  // The corners of the default grid: 5 x 5 x 4 places 0.3048 m apart, first column 1.5 pitches in front.
  for (const double x_m : {0.4572, 1.6764}) {
    for (const double y_m : {-0.6096, 0.6096}) {
      for (const double z_m : {-0.4572, 0.4572}) {
        QCOMPARE(tracker->measure({{x_m, y_m, z_m}, Eigen::Quaterniond::Identity()}, 0.0).status, "");
      }
    }
  }
}

void SceneTest::exampleHoldsEveryKeyWithItsDefault() {
  const std::filesystem::path path = shippedScenes() / "example.scene.json";
  const auto raw = nlohmann::json::parse(readFile(path).value());
  Scene expected;
  for (const effects::Effect& effect : effects::effects()) {
    expected.effects.push_back({effect.id, effects::resolveEffectParameters(effect, nullptr).value()});
  }
  expected.name = raw.at("name").get<std::string>();
  QCOMPARE(raw.at("effects").size(), effects::effects().size());
  std::string missing;
  QVERIFY2(holdsEveryKey(raw, toJson(expected), missing), missing.c_str());
  QVERIFY(toJson(readScene(path).value()) == toJson(expected));
}

FIELDTRUE_TEST(SceneTest)
#include "scene_test.moc"
