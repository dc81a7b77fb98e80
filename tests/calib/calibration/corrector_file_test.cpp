#include <QTemporaryDir>
#include <QTest>
#include <nlohmann/json.hpp>

#include "calib/calibration/alignment.h"
#include "calib/calibration/checksum.h"
#include "calib/calibration/corrector.h"
#include "calib/core/file_io.h"
#include "tests/calib/calibration/bent_table.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::calibration;
using namespace fieldtrue::testing;
using nlohmann::json;

namespace {

CalibrationTable describedTable() {
  CalibrationTable table = bentTable();
  table.metadata.tracker = "Fastrak \"long range\", room 3";
  table.metadata.jig_tolerance_m = 0.0013;
  table.metadata.other["operator"] = "J. Müller";
  table.nodes[2].covariance_m2 = Eigen::Matrix3d(Eigen::Vector3d(1e-6, 2e-6, 3e-6 / 7.0).asDiagonal());
  table.nodes[2].sd_rot_rad = 0.1 / 3.0;
  table.nodes[2].t_start_s = 12.25;
  return table;
}

Corrector fitted(const std::string& position, const std::string& orientation) {
  const CalibrationTable table = describedTable();
  return Corrector::fit(table.nodes, table.metadata, parseCorrectorChoice(position, orientation).value(),
                        AlignMode::kRigid)
      .value();
}

/// The file with one thing changed and a checksum that fits again: what a hand would write.
std::string rewritten(const std::string& text, const std::function<void(json&)>& change) {
  json content = json::parse(text);
  change(content);
  content.erase("checksum");
  content["checksum"] = "fnv1a64:" + fnv1a64(content.dump());
  return content.dump();
}

}  // namespace

class CorrectorFileTest : public QObject {
  Q_OBJECT
 private slots:
  void checksumIsThePublishedOne_data() {
    // Landon Curt Noll's test vectors of 64-bit FNV-1a.
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<QByteArray>("digits");
    QTest::newRow("empty") << QByteArray("") << QByteArray("cbf29ce484222325");
    QTest::newRow("a") << QByteArray("a") << QByteArray("af63dc4c8601ec8c");
    QTest::newRow("foobar") << QByteArray("foobar") << QByteArray("85944171f73967e8");
  }
  void checksumIsThePublishedOne() {
    QFETCH(QByteArray, text);
    QFETCH(QByteArray, digits);
    QCOMPARE(QByteArray::fromStdString(fnv1a64(text.toStdString())), digits);
  }

  void reloadsToTheSameBits_data() {
    QTest::addColumn<QByteArray>("position");
    QTest::addColumn<QByteArray>("orientation");
    QTest::newRow("nothing") << QByteArray("none") << QByteArray("none");
    QTest::newRow("rigid") << QByteArray("rigid") << QByteArray("rigid");
    QTest::newRow("affine") << QByteArray("affine") << QByteArray("rigid:error_frame=sensor");
    QTest::newRow("polynomial") << QByteArray("polynomial") << QByteArray("polynomial_quaternion:degree=2");
    QTest::newRow("multiquadric") << QByteArray("hmq:r2_cm2=33.3") << QByteArray("hmq_matrix");
    QTest::newRow("multiquadric, automatic") << QByteArray("hmq:r2_cm2=auto") << QByteArray("hmq_matrix:r2_cm2=auto");
  }
  void reloadsToTheSameBits() {
    QFETCH(QByteArray, position);
    QFETCH(QByteArray, orientation);
    const Corrector original = fitted(position.toStdString(), orientation.toStdString());
    QTemporaryDir folder;
    const std::filesystem::path path = std::filesystem::path(folder.path().toStdString()) / "room.ftcal.json";
    FT_VERIFY_OK(original.save(path));
    const auto reloaded = Corrector::load(path);
    FT_VERIFY_OK(reloaded);
    for (const Eigen::Vector3d& p_m : randomPoints(4000)) {
      const Pose tracked{p_m, rotationFromVector(3.0 * p_m)};
      FT_VERIFY_MATCH(sameBits(reloaded->correct(tracked), original.correct(tracked)));
      QCOMPARE(reloaded->covers(p_m), original.covers(p_m));
      QVERIFY(reloaded->uncertainty_m(p_m) == original.uncertainty_m(p_m));
    }
    QCOMPARE(QByteArray::fromStdString(reloaded->toText()), QByteArray::fromStdString(original.toText()));
    QVERIFY(reloaded->choice().position_settings == original.choice().position_settings);
    QCOMPARE(reloaded->align(), AlignMode::kRigid);
  }

  void keepsTheRowsAndMetadata() {
    const CalibrationTable table = describedTable();
    const auto reloaded = Corrector::fromText(fitted("affine", "rigid").toText(), "room.ftcal.json");
    FT_VERIFY_OK(reloaded);
    const TableMetadata& metadata = reloaded->table().metadata;
    QVERIFY(metadata.tracker == table.metadata.tracker && metadata.jig_tolerance_m == table.metadata.jig_tolerance_m &&
            metadata.other == table.metadata.other && !metadata.rate_hz);
    QCOMPARE(reloaded->table().nodes.size(), table.nodes.size());
    for (std::size_t i = 0; i < table.nodes.size(); ++i) {
      const Node& seen = reloaded->table().nodes[i];
      const Node& expected = table.nodes[i];
      FT_VERIFY_MATCH(sameBits(seen.tracker_from_sensor, expected.tracker_from_sensor));
      FT_VERIFY_MATCH(sameBits(seen.reference_from_sensor, expected.reference_from_sensor));
      QVERIFY(seen.node == expected.node && seen.visit == expected.visit && seen.index == expected.index &&
              seen.covariance_m2 == expected.covariance_m2 && seen.sd_rot_rad == expected.sd_rot_rad &&
              seen.t_start_s == expected.t_start_s && seen.t_end_s == expected.t_end_s &&
              seen.n_used == expected.n_used && seen.n_effective == expected.n_effective && seen.role == expected.role);
    }
  }

  void statesWhatItIs() {
    const json content = json::parse(fitted("polynomial", "none").toText());
    QVERIFY(content.at("schema") == "fieldtrue.ftcal/1");
    QVERIFY(content.at("software").get<std::string>().starts_with("Fieldtrue "));
    QVERIFY(content.at("position").at("method") == "polynomial");
    QVERIFY(content.at("position").at("settings").at("degree") == 3);
    QVERIFY(content.at("align") == "rigid");
  }

  void aSettingThatCameLaterStandsAtItsDefault() {
    const Corrector original = fitted("hmq", "none");
    const std::string before_the_setting =
        rewritten(original.toText(), [](json& j) { j["position"]["settings"].erase("r2_cm2"); });
    const auto loaded = Corrector::fromText(before_the_setting, "old.ftcal.json");
    FT_VERIFY_OK(loaded);
    QCOMPARE(QByteArray::fromStdString(loaded->toText()), QByteArray::fromStdString(original.toText()));
  }

  void aSettingThatIsNoMoreIsReadOver() {
    const Corrector original = fitted("hmq", "none");
    const std::string with_the_setting = rewritten(original.toText(), [](json& j) {
      j["position"]["settings"]["precision"] = "single";
      j["position"]["parameters"]["precision"] = "single";
    });
    const auto loaded = Corrector::fromText(with_the_setting, "old.ftcal.json");
    FT_VERIFY_OK(loaded);
    QCOMPARE(QByteArray::fromStdString(loaded->toText()), QByteArray::fromStdString(original.toText()));
  }

  void filesOfTheFirstVersionAreRead() {
    const Corrector original = fitted("affine", "none");
    const std::string first = rewritten(original.toText(), [](json& j) {
      for (const char* key : {"inputs", "orientations_seen", "setup"}) j.erase(key);
      j["comment"] = "as it was";
    });
    FT_VERIFY_OK(Corrector::fromText(first, "first.ftcal.json"));
  }

  void changesOfLayoutDoNoHarm() {
    const std::string text = fitted("affine", "none").toText();
    FT_VERIFY_OK(Corrector::fromText(json::parse(text).dump(2), "indented.ftcal.json"));
  }

  void everyCutIsFound() {
    const std::string text = fitted("affine", "none").toText();
    for (std::size_t size = 0; size + 2 < text.size(); size += text.size() / 97) {
      const auto cut = Corrector::fromText(text.substr(0, size), "room.ftcal.json");
      QVERIFY(!cut);
      QCOMPARE(cut.error().code, ErrorCode::kBadInput);
      FT_VERIFY_MATCH(holdsAll(cut.error().message, {"room.ftcal.json", "cut short"}));
    }
  }

  void everyChangedDigitIsFound() {
    const std::string text = fitted("affine", "none").toText();
    int n_changed = 0;
    for (std::size_t i = 0; i < text.size(); i += 31) {
      if (text[i] < '1' || text[i] > '8') continue;
      std::string damaged = text;
      ++damaged[i];
      const auto loaded = Corrector::fromText(damaged, "room.ftcal.json");
      // A seventeenth digit may be changed without changing the number.
      QVERIFY2(!loaded || loaded->toText() == text, ("digit at " + std::to_string(i)).c_str());
      if (loaded) continue;
      ++n_changed;
    }
    QVERIFY(n_changed > 100);
  }

  void damageIsSaidInOneSentence_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<ErrorCode>("code");
    QTest::addColumn<QByteArray>("fragment");
    const std::string text = fitted("affine", "none").toText();
    const auto row = [](const char* name, const std::string& content, ErrorCode code, const char* fragment) {
      QTest::newRow(name) << QByteArray::fromStdString(content) << code << QByteArray(fragment);
    };
    row("other file", "{\"schema\": \"fieldtrue.gap/1\"}", ErrorCode::kBadInput, "not a Fieldtrue calibration");
    row("no schema", "{}", ErrorCode::kBadInput, "not a Fieldtrue calibration");
    row("not an object", "[1, 2]", ErrorCode::kBadInput, "not a Fieldtrue calibration");
    row("newer", rewritten(text, [](json& j) { j["schema"] = "fieldtrue.ftcal/4"; }), ErrorCode::kNewerVersion,
        "newer version");
    row("odd version", rewritten(text, [](json& j) { j["schema"] = "fieldtrue.ftcal/one"; }), ErrorCode::kBadInput,
        "fieldtrue.ftcal/one");
    row("schema not text", rewritten(text, [](json& j) { j["schema"] = 1; }), ErrorCode::kBadInput, "calibration");
    row("unknown method", rewritten(text, [](json& j) { j["position"]["method"] = "spline"; }), ErrorCode::kBadInput,
        "spline");
    row("no parameters", rewritten(text, [](json& j) { j["position"].erase("parameters"); }), ErrorCode::kBadInput,
        "parameters");
    row("bad setting",
        rewritten(text,
                  [](json& j) {
                    j["position"] = {{"method", "polynomial"}, {"settings", {{"degree", 9}}}, {"parameters", {}}};
                  }),
        ErrorCode::kBadInput, "degree");
    row("no region", rewritten(text, [](json& j) { j.erase("region"); }), ErrorCode::kBadInput, "region");
    row("bad rotation",
        rewritten(text,
                  [](json& j) {
                    j["alignment"]["sensor_from_mount_wxyz"] = {0, 0, 0, 0};
                  }),
        ErrorCode::kBadInput, "unit quaternion");
    row("other units", rewritten(text, [](json& j) { j["units"] = "mm, deg"; }), ErrorCode::kBadInput,
        "units is the text \"mm, deg\"; it must be \"m, rad; quaternions w x y z\"");
    row("no units", rewritten(text, [](json& j) { j.erase("units"); }), ErrorCode::kBadInput, "units is missing");
    row("other direction", rewritten(text, [](json& j) { j["direction"] = "true -> tracked"; }), ErrorCode::kBadInput,
        "direction is the text \"true -> tracked\"; it must be \"tracker_from_sensor as tracked ->");
    row("inputs of another file", rewritten(text, [](json& j) { j["inputs"] = "pose"; }), ErrorCode::kBadInput,
        "inputs is the text \"pose\"; it must be \"position\", which its position part takes");
    row("no inputs", rewritten(text, [](json& j) { j["inputs"] = "voltages"; }), ErrorCode::kBadInput, "voltages");
    row("unknown key", rewritten(text, [](json& j) { j["by_sensr"] = json::object(); }), ErrorCode::kBadInput,
        "by_sensr is not known; did you mean by_sensor?");
    row("unknown key of a part", rewritten(text, [](json& j) { j["alignment"]["mounts"] = json::object(); }),
        ErrorCode::kBadInput, "alignment.mounts is not known; did you mean mounts_wxyz?");
    row("bad role", rewritten(text, [](json& j) { j["table"]["nodes"][0]["role"] = "fits"; }), ErrorCode::kBadInput,
        "role");
  }
  void damageIsSaidInOneSentence() {
    QFETCH(QByteArray, text);
    QFETCH(ErrorCode, code);
    QFETCH(QByteArray, fragment);
    const auto loaded = Corrector::fromText(text.toStdString(), "room.ftcal.json");
    QVERIFY(!loaded);
    QCOMPARE(loaded.error().code, code);
    FT_VERIFY_MATCH(holdsAll(loaded.error().message, {"room.ftcal.json", fragment}));
    QVERIFY(loaded.error().message.find('\n') == std::string::npos);
  }

  void aScaleThatIsNotAboveZeroIsRefused_data() {
    QTest::addColumn<QByteArray>("position");
    QTest::addColumn<QByteArray>("orientation");
    QTest::addColumn<QByteArray>("pointer");  // of the number, within the file
    const auto row = [](const char* position, const char* orientation, const char* pointer) {
      QTest::newRow(pointer) << QByteArray(position) << QByteArray(orientation) << QByteArray(pointer);
    };
    row("affine", "none", "/position/parameters/scale_m/0");
    row("none", "polynomial_quaternion:degree=2", "/orientation/parameters/vector_part/scale_m/0");
    row("rbf:smoothing=0", "none", "/position/parameters/frame/per_m/1");
    row("gaussian_process", "none", "/position/parameters/length_m/2");
  }
  void aScaleThatIsNotAboveZeroIsRefused() {
    QFETCH(QByteArray, position);
    QFETCH(QByteArray, orientation);
    QFETCH(QByteArray, pointer);
    const std::string text = fitted(position.toStdString(), orientation.toStdString()).toText();
    const json::json_pointer scale(pointer.toStdString());
    for (const double value : {0.0, -0.3}) {
      const auto loaded =
          Corrector::fromText(rewritten(text, [&](json& j) { j.at(scale) = value; }), "room.ftcal.json");
      QVERIFY(!loaded && loaded.error().code == ErrorCode::kBadInput);
      FT_VERIFY_MATCH(holdsAll(loaded.error().message, {"room.ftcal.json", "above 0"}));
    }
  }

  void missingFilesAndFoldersAreSaid() {
    const auto loaded = Corrector::load("/nowhere/room.ftcal.json");
    QVERIFY(!loaded && loaded.error().code == ErrorCode::kIo);
    const auto saved = fitted("none", "none").save("/nowhere/room.ftcal.json");
    QVERIFY(!saved && saved.error().code == ErrorCode::kIo);
  }

  void metadataThatIsNotUtf8DoesNotStopIt() {
    CalibrationTable table = describedTable();
    table.metadata.rig = "M\xfcller's jig";
    const Corrector corrector =
        Corrector::fit(table.nodes, table.metadata, parseCorrectorChoice("rigid", "none").value(), AlignMode::kRigid)
            .value();
    FT_VERIFY_OK(Corrector::fromText(corrector.toText(), "room.ftcal.json"));
  }
};

FIELDTRUE_TEST(CorrectorFileTest)
#include "corrector_file_test.moc"
