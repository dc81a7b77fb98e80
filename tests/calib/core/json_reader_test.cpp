#include "calib/core/json_reader.h"

#include <QTest>
#include <nlohmann/json.hpp>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;
using nlohmann::json;

namespace {

/// The sentence with which a reader ends; empty when it does not.
template <class Read>
std::string sentenceOf(const json& document, Read read) {
  const auto result = readJson<int>(document, "lab", [&](const JsonReader& reader) {
    read(reader);
    return 0;
  });
  return result ? std::string() : result.error().message;
}

const json kDocument = json::parse(R"({"rate_hz": 60, "name": "hall", "on": true, "none": null, "list": [1, 2, 3],
  "mixed": [1, "2", 3], "nodes": [{"x_m": 1}, {"x_m": "far"}], "half": 2.5, "many": [1,2,3,4,5,6,7,8,9,10],
  "turn": [0.5, 0.5, -0.5, 0.5], "flat": [1, 0, 0, 0.5], "rows": [[1, 2], [3]]})");

class JsonReaderTest : public QObject {
  Q_OBJECT
 private slots:
  void readsWhatIsThere() {
    const auto read = readJson<double>(kDocument, "lab", [](const JsonReader& lab) {
      if (lab["name"].text() != "hall" || !lab["on"].flag() || lab["rate_hz"].integer() != 60) lab.fail("is wrong");
      if (lab["list"].vector3() != Eigen::Vector3d(1, 2, 3)) lab.fail("is wrong");
      if (lab["none"].optionalNumber() || !std::isnan(lab["none"].numberOrNan())) lab.fail("is wrong");
      if (lab.find("no such key")) lab.fail("is wrong");
      return lab["rate_hz"].number({0.0, 100.0}, "Hz");
    });
    FT_VERIFY_OK(read);
    QCOMPARE(*read, 60.0);
  }

  void theFirstThingWrongIsNamedWithItsPath_data() {
    QTest::addColumn<QByteArray>("key");
    QTest::addColumn<QByteArray>("kind");
    QTest::addColumn<QByteArray>("sentence");
    const auto row = [](const char* name, const char* key, const char* kind, const char* sentence) {
      QTest::newRow(name) << QByteArray(key) << QByteArray(kind) << QByteArray(sentence);
    };
    row("missing", "rate", "number", "lab: rate is missing.");
    row("text for a number", "name", "number", "lab: name is the text \"hall\"; it must be a number.");
    row("out of range", "rate_hz", "to50", "lab: rate_hz is 60; it must be a number from 1 to 50 [Hz].");
    row("no whole number", "half", "integer", "lab: half is 2.5; it must be a whole number.");
    row("whole but too large", "rate_hz", "digit", "lab: rate_hz is 60; it must be a whole number from 0 to 9.");
    row("null", "none", "text", "lab: none is null; it must be a text.");
    row("number for a flag", "rate_hz", "flag", "lab: rate_hz is 60; it must be true or false.");
    row("not among the choices", "name", "choice", "lab: name is the text \"hall\"; it must be \"a\" or \"b\".");
    row("a text among numbers", "mixed", "vector", "lab: mixed is [1,\"2\",3]; it must be a list of 3 numbers.");
    row("a long list", "many", "vector", "lab: many is a list of 10; it must be a list of 3 numbers.");
    row("not unit", "flat", "quaternion",
        "lab: flat is [1,0,0,0.5]; it must be four numbers [w, x, y, z] of a unit quaternion.");
    row("a short row", "rows", "matrix", "lab: rows has the row [3]; a row must be 2 numbers.");
    row("deep", "nodes", "x_m", "lab: nodes[1].x_m is the text \"far\"; it must be a number.");
    row("no object", "list", "x_m of it", "lab: list is [1,2,3]; it must be an object {...}.");
  }
  void theFirstThingWrongIsNamedWithItsPath() {
    QFETCH(QByteArray, key);
    QFETCH(QByteArray, kind);
    QFETCH(QByteArray, sentence);
    const std::string seen = sentenceOf(kDocument, [&](const JsonReader& lab) {
      const JsonReader value = lab[key.toStdString()];
      if (kind == "number") value.number();
      if (kind == "to50") value.number({1.0, 50.0}, "Hz");
      if (kind == "integer") value.integer();
      if (kind == "digit") value.integer(0, 9);
      if (kind == "text") value.text();
      if (kind == "flag") value.flag();
      if (kind == "choice") value.oneOf({"a", "b"});
      if (kind == "vector") value.vector3();
      if (kind == "quaternion") value.quaternion();
      if (kind == "matrix") value.matrix(2);
      if (kind == "x_m") value.list([](const JsonReader& node) { return node["x_m"].number(); });
      if (kind == "x_m of it") value["x_m"].number();
    });
    QCOMPARE(seen, sentence.toStdString());
  }

  void keysNobodyAskedForAreRefused() {
    const json document{{"comment", "free text"}, {"tracker", {{"rate_hz", 60}, {"ratehz", 50}}}};
    const std::string seen = sentenceOf(document, [](const JsonReader& lab) {
      const JsonReader tracker = lab["tracker"];
      double rate_hz = 0.0;
      tracker.number("rate_hz", rate_hz, {0.0, 100.0}, "Hz");
      lab.refuseOtherKeys();
      tracker.refuseOtherKeys();
    });
    QCOMPARE(seen, std::string("lab: tracker.ratehz is not known; did you mean rate_hz? Known: rate_hz."));
  }

  void aMissingKeyLeavesTheDefault() {
    double rate_hz = 12.0;
    QCOMPARE(sentenceOf(kDocument, [&](const JsonReader& lab) { lab.number("rate", rate_hz, {0, 1}, "Hz"); }), "");
    QCOMPARE(rate_hz, 12.0);
  }

  void schemasOfThisOfNoAndOfANewerVersion() {
    const auto read = [](const json& document) {
      return readJson<int>(document, "lab", [](const JsonReader& lab) {
        return lab.schema("fieldtrue.scene/", 3, "a scene").value_or(-1);
      });
    };
    QCOMPARE(*read(json{{"schema", "fieldtrue.scene/2"}}), 2);
    QCOMPARE(*read(json::object()), -1);
    const auto newer = read(json{{"schema", "fieldtrue.scene/4"}});
    QVERIFY(!newer && newer.error().code == ErrorCode::kNewerVersion);
    for (const char* other : {"fieldtrue.plan/1", "fieldtrue.scene/", "fieldtrue.scene/2b", "fieldtrue.scene/-1"}) {
      const auto wrong = read(json{{"schema", other}});
      QVERIFY(!wrong && wrong.error().code == ErrorCode::kBadInput);
      FT_VERIFY_MATCH(holdsAll(wrong.error().message,
                               {"lab is not a scene: schema is", other, "a scene has \"fieldtrue.scene/3\""}));
    }
    QVERIFY(!read(json{{"schema", 3}}));
  }

  void aUnitQuaternionKeepsItsBits() {
    const Eigen::Quaterniond q(0.5, 0.5, -0.5, 0.5);
    const auto kept =
        readJson<Eigen::Quaterniond>(kDocument, "lab", [](const JsonReader& lab) { return lab["turn"].quaternion(); });
    FT_VERIFY_OK(kept);
    QVERIFY(kept->coeffs() == q.coeffs());
    const auto rounded = readJson<Eigen::Quaterniond>(json{{"q", {0.707, 0.0, 0.0, 0.707}}}, "lab",
                                                      [](const JsonReader& lab) { return lab["q"].quaternion(); });
    FT_VERIFY_OK(rounded);
    QVERIFY(std::abs(rounded->norm() - 1.0) < 1e-15);
  }

  void anErrorOfWhatWasMadeIsToldAtItsPlace() {
    const std::string seen = sentenceOf(kDocument, [](const JsonReader& lab) {
      lab["name"].valueOf(Result<int>(fail(ErrorCode::kUnsupported, "No such hall.")));
    });
    QCOMPARE(seen, std::string("lab: name: No such hall."));
  }

  void textThatIsNoUtf8CanBeShown() {
    const std::string seen = sentenceOf(json{{"name", "caf\xe9"}}, [](const JsonReader& lab) { lab["name"].number(); });
    FT_VERIFY_MATCH(holdsAll(seen, {"lab: name is the text \"caf", "it must be a number"}));
  }
};

}  // namespace

FIELDTRUE_TEST(JsonReaderTest)
#include "json_reader_test.moc"
