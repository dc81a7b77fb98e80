#include "calib/core/json_text.h"

#include <QTest>
#include <nlohmann/json.hpp>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

std::string nested(int depth) {
  const auto n = static_cast<std::size_t>(depth);
  return std::string(n, '[') + std::string(n, ']');
}

}  // namespace

/// JSON from outside is read up to a depth, and no deeper.
class JsonTextTest : public QObject {
  Q_OBJECT
 private slots:
  void readsUpToTheLimit() {
    const auto deepest = parseJson(nested(kDeepestJson), "a.json");
    FT_VERIFY_OK(deepest);
    QCOMPARE(deepest->dump(), nested(kDeepestJson));
    std::string objects;
    for (int i = 0; i < kDeepestJson; ++i) objects += R"({"a":)";
    FT_VERIFY_OK(parseJson(objects + "1" + std::string(kDeepestJson, '}'), "a.json"));
    // Brackets in a text, and beside each other, are not depth.
    FT_VERIFY_OK(parseJson('"' + std::string(1000, '[') + '"', "a.json"));
    std::string beside = "[[]";
    for (int i = 0; i < 1000; ++i) beside += ",[]";
    FT_VERIFY_OK(parseJson(beside + "]", "a.json"));
  }

  void refusesOneMore_data() {
    QTest::addColumn<QByteArray>("text");
    const QByteArray one_more = QByteArray::fromStdString(nested(kDeepestJson + 1));
    QTest::newRow("lists") << one_more;
    QTest::newRow("within an object") << "{\"a\":" + QByteArray::fromStdString(nested(kDeepestJson)) + "}";
    QTest::newRow("objects") << QByteArray("{\"a\":").repeated(kDeepestJson + 1) + "1" +
                                    QByteArray("}").repeated(kDeepestJson + 1);
    QTest::newRow("whole and huge") << QByteArray::fromStdString(nested(200000));
    QTest::newRow("cut off and huge") << QByteArray(200000, '[');
  }
  void refusesOneMore() {
    QFETCH(QByteArray, text);
    for (const JsonComments comments : {JsonComments::kRefused, JsonComments::kSkipped}) {
      const auto read = parseJson(text.toStdString(), "a.json", comments);
      QVERIFY(!read);
      QCOMPARE(read.error().code, ErrorCode::kBadInput);
      FT_VERIFY_MATCH(holdsAll(read.error().message, {"a.json", "nested", QByteArray::number(kDeepestJson)}));
    }
  }

  void namesTheLine() {
    const auto broken = parseJson("{\n\"a\": 1,\n\"b\" 2}", "a.json");
    QVERIFY(!broken);
    FT_VERIFY_MATCH(holdsAll(broken.error().message, {"a.json, line 3", "not valid JSON"}));
    const auto table = parseJson("\n  node,x_true_m,y_true_m\n0,0,0\n", "a.csv");
    QVERIFY(!table);
    FT_VERIFY_MATCH(holdsAll(table.error().message, {"a.csv, line 2", "another kind", "\"node,x_true_m,y_true_m\""}));
    const auto remarked = parseJson("// Lab 2\n{\"a\": 1\n\"b\": 2}", "a.json", JsonComments::kSkipped);
    QVERIFY(!remarked);
    FT_VERIFY_MATCH(holdsAll(remarked.error().message, {"a.json, line 3", "missing comma"}));
    const auto unopened = parseJson("\"a\": 1}", "a.json");
    QVERIFY(!unopened);
    FT_VERIFY_MATCH(holdsAll(unopened.error().message, {"a.json, line 1", "bracket"}));
    const auto huge = parseJson("[1e999]", "a.json");
    QVERIFY(!huge);
    FT_VERIFY_MATCH(holdsAll(huge.error().message, {"a.json", "too large"}));
  }

  void skipsCommentsWhereAsked() {
    const std::string text = "// a room [[[\n[1, /* two { */ 2]";
    QVERIFY(!parseJson(text, "a.json"));
    const auto read = parseJson(text, "a.json", JsonComments::kSkipped);
    FT_VERIFY_OK(read);
    QCOMPARE(read->dump(), std::string("[1,2]"));
  }
};

FIELDTRUE_TEST(JsonTextTest)
#include "json_text_test.moc"
