#include "calib/core/settings.h"

#include <QTest>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "calib/core/declare.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

Setting setting(const char* key, SettingType type, SettingValue default_value, double min = 0.0, double max = 0.0) {
  Setting s;
  s.key = key;
  s.type = type;
  s.default_value = std::move(default_value);
  s.min = min;
  s.max = max;
  return s;
}

std::vector<Setting> declared() {
  std::vector<Setting> settings{setting("degree", SettingType::kInteger, std::int64_t{3}, 1, 6),
                                setting("ridge", SettingType::kNumber, std::int64_t{1}, 0, 10),
                                setting("free", SettingType::kNumber, -2.5),
                                setting("local", SettingType::kBool, false),
                                setting("radius", SettingType::kAutoNumber, std::string("auto"), 0.1, 5),
                                setting("frame", SettingType::kChoice, std::string("tracker")),
                                setting("column", SettingType::kChoice, std::string())};
  settings[5].choices = {"tracker", "sensor"};
  return settings;
}

}  // namespace

class SettingsTest : public QObject {
  Q_OBJECT

 private slots:
  void splitsMethodText() {
    const auto method = parseMethodText(" polynomial : degree = 3 ,frame=sensor");
    FT_VERIFY_OK(method);
    QCOMPARE(method->id, std::string("polynomial"));
    const std::map<std::string, std::string> expected{{"degree", "3"}, {"frame", "sensor"}};
    QVERIFY(method->given == expected);
    const auto bare = parseMethodText("none");
    FT_VERIFY_OK(bare);
    QVERIFY(bare->id == "none" && bare->given.empty());
    QCOMPARE(parseMethodText("m:key=a=b:c")->given.at("key"), std::string("a=b:c"));
  }

  void refusesMethodText_data() {
    QTest::addColumn<QString>("text");
    QTest::addColumn<QByteArray>("says");
    QTest::newRow("empty") << "" << QByteArray("id:key=value");
    QTest::newRow("no id") << ":degree=3" << QByteArray("':degree=3'");
    QTest::newRow("no equals") << "hmq:radius" << QByteArray("'radius'");
    QTest::newRow("empty part") << "hmq:" << QByteArray("key=value, got ''");
    QTest::newRow("trailing comma") << "hmq:r=1," << QByteArray("key=value, got ''");
    QTest::newRow("no key") << "hmq:=1" << QByteArray("'=1'");
    QTest::newRow("twice") << "hmq:r=1,r=2" << QByteArray("r of hmq is given twice");
  }
  void refusesMethodText() {
    QFETCH(QString, text);
    QFETCH(QByteArray, says);
    const auto method = parseMethodText(text.toStdString());
    QVERIFY(!method);
    QVERIFY(method.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(method.error().message, {says}));
  }

  void fillsDefaults() {
    const auto settings = resolveSettings("m", declared(), {});
    FT_VERIFY_OK(settings);
    QCOMPARE(settings->size(), std::size_t{7});
    QCOMPARE(integerSetting(*settings, "degree"), std::int64_t{3});
    QCOMPARE(numberSetting(*settings, "ridge"), 1.0);
    QCOMPARE(numberSetting(*settings, "free"), -2.5);
    QCOMPARE(boolSetting(*settings, "local"), false);
    QCOMPARE(choiceSetting(*settings, "radius"), std::string("auto"));
    QCOMPARE(choiceSetting(*settings, "frame"), std::string("tracker"));
    QVERIFY(choiceSetting(*settings, "column").empty());
  }

  void takesValues() {
    const auto settings = resolveSettings("m", declared(),
                                          {{"degree", "6"},
                                           {"ridge", "1e-3"},
                                           {"free", "-1e9"},
                                           {"local", "yes"},
                                           {"radius", "0.25"},
                                           {"frame", "sensor"},
                                           {"column", "tip x [mm]"}});
    FT_VERIFY_OK(settings);
    QCOMPARE(integerSetting(*settings, "degree"), std::int64_t{6});
    QCOMPARE(numberSetting(*settings, "ridge"), 1e-3);
    QCOMPARE(numberSetting(*settings, "free"), -1e9);
    QCOMPARE(boolSetting(*settings, "local"), true);
    QCOMPARE(numberSetting(*settings, "radius"), 0.25);
    QCOMPARE(choiceSetting(*settings, "frame"), std::string("sensor"));
    QCOMPARE(choiceSetting(*settings, "column"), std::string("tip x [mm]"));
  }

  void anAutoNumberMayTakeWholeNumbersOnly() {
    Setting degree = setting("degree", SettingType::kAutoNumber, 3.0, 1, 6);
    degree.whole = true;
    const std::vector<Setting> whole{degree};
    QCOMPARE(numberSetting(resolveSettings("poly", whole, {{"degree", "4"}}).value(), "degree"), 4.0);
    QCOMPARE(choiceSetting(resolveSettings("poly", whole, {{"degree", "auto"}}).value(), "degree"),
             std::string("auto"));
    const auto half = resolveSettings("poly", whole, {{"degree", "2.5"}});
    QVERIFY(!half);
    FT_VERIFY_MATCH(holdsAll(half.error().message, {"degree must be auto or a whole number from 1 to 6, got '2.5'"}));
  }

  void vectorsAndWhatMayBeLeftOut() {
    const Setting axis =
        declare::vector3("axis_m", {-1.0, 1.0, "m"}, {0.0, 0.0, 1.0}, "Along it.").plausibly(-0.5, 0.5);
    const Setting metal = declare::number("conductivity_s_per_m", {1.0, 1e8, "S/m"}, nullptr, "Null: ideal.");
    const Setting tensor = declare::matrix3("tensor_m3", {}, "Row by row.");
    QVERIFY(accepts(axis, {0.5, 0.0, -1.0}) && !accepts(axis, {0.5, 0.0, -1.1}) && !accepts(axis, {0.5, 0.0}));
    QVERIFY(!accepts(axis, nullptr) && accepts(metal, nullptr) && accepts(metal, 5.8e7) && !accepts(metal, 0.5));
    QVERIFY(accepts(tensor, {1, 2, 3, 2, 4, 5, 3, 5, 6}) && !accepts(tensor, {1, 2, 3, 9, 4, 5, 3, 5, 6}));
    QVERIFY(valueOf(axis, " 0.5  0 -1") == SettingValue(std::vector<double>{0.5, 0.0, -1.0}));
    QVERIFY(!valueOf(axis, "0.5 0") && !valueOf(axis, "0.5 0 up") && !valueOf(axis, "0.5 0 2"));
    QCOMPARE(textOf(SettingValue(std::vector<double>{0.5, 0.0, -1.0})), std::string("0.5 0 -1"));
    QCOMPARE(textOf(SettingValue(nullptr)), std::string());
    QCOMPARE(neededFor(axis), std::string("three numbers from -1 to 1 [m]"));
    QVERIFY(axis.hasPlausibleRange() && !metal.hasPlausibleRange());
  }

  void refusesValues_data() {
    QTest::addColumn<QString>("key");
    QTest::addColumn<QString>("value");
    QTest::addColumn<QByteArray>("says");
    QTest::newRow("unknown key") << "degre"
                                 << "3" << QByteArray("poly has no setting 'degre'; its settings are degree, ridge");
    QTest::newRow("not whole") << "degree"
                               << "2.5" << QByteArray("poly: degree must be a whole number from 1 to 6, got '2.5'");
    QTest::newRow("too high") << "degree"
                              << "7" << QByteArray("from 1 to 6, got '7'");
    QTest::newRow("too low") << "ridge"
                             << "-0.1" << QByteArray("from 0 to 10, got '-0.1'");
    QTest::newRow("text") << "ridge"
                          << "many" << QByteArray("a number");
    QTest::newRow("trailing text") << "ridge"
                                   << "1mm" << QByteArray("got '1mm'");
    QTest::newRow("nan") << "free"
                         << "nan" << QByteArray("a number, got 'nan'");
    QTest::newRow("infinite") << "free"
                              << "inf" << QByteArray("got 'inf'");
    QTest::newRow("blank") << "degree"
                           << "" << QByteArray("got ''");
    QTest::newRow("not a bool") << "local"
                                << "maybe" << QByteArray("true or false");
    QTest::newRow("not auto") << "radius"
                              << "automatic" << QByteArray("auto or a number from 0.1 to 5");
    QTest::newRow("not a choice") << "frame"
                                  << "room" << QByteArray("one of tracker, sensor, got 'room'");
  }
  void refusesValues() {
    QFETCH(QString, key);
    QFETCH(QString, value);
    QFETCH(QByteArray, says);
    const auto settings = resolveSettings("poly", declared(), {{key.toStdString(), value.toStdString()}});
    QVERIFY(!settings);
    QVERIFY(settings.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(settings.error().message, {says}));
  }

  void ownerWithoutSettingsSaysSo() {
    const auto settings = resolveSettings("none", {}, {{"degree", "3"}});
    QVERIFY(!settings);
    FT_VERIFY_MATCH(holdsAll(settings.error().message, {"none has no setting 'degree'; it has none"}));
  }

  void wrongAccessIsAMistake() {
    const auto settings = resolveSettings("m", declared(), {});
    FT_VERIFY_OK(settings);
    QVERIFY_THROWS_EXCEPTION(std::logic_error, numberSetting(*settings, "degree"));
    QVERIFY_THROWS_EXCEPTION(std::logic_error, numberSetting(*settings, "absent"));
  }

  void survivesJson() {
    const auto settings = resolveSettings("m", declared(), {{"ridge", "0.1"}, {"radius", "0.3"}, {"local", "true"}});
    FT_VERIFY_OK(settings);
    const auto back = settingsFromJson("m", declared(), nlohmann::json::parse(toJson(*settings).dump()));
    FT_VERIFY_OK(back);
    QVERIFY(*back == *settings);
  }

  void refusesJson_data() {
    QTest::addColumn<QByteArray>("patch");
    QTest::addColumn<QByteArray>("says");
    QTest::newRow("wrong type") << QByteArray(R"({"degree": "3"})") << QByteArray("m: degree must be a whole number");
    QTest::newRow("fraction") << QByteArray(R"({"degree": 3.5})") << QByteArray("got '3.5'");
    QTest::newRow("bool as number") << QByteArray(R"({"ridge": true})") << QByteArray("ridge must be a number");
    QTest::newRow("missing") << QByteArray(R"({"ridge": null})") << QByteArray("setting ridge is missing");
    QTest::newRow("out of range") << QByteArray(R"({"ridge": 11})") << QByteArray("from 0 to 10, got '11'");
    QTest::newRow("unknown") << QByteArray(R"({"extra": 1})") << QByteArray("no setting 'extra'");
  }
  void refusesJson() {
    QFETCH(QByteArray, patch);
    QFETCH(QByteArray, says);
    nlohmann::json patched = toJson(*resolveSettings("m", declared(), {}));
    patched.merge_patch(nlohmann::json::parse(patch.toStdString()));
    const auto settings = settingsFromJson("m", declared(), patched);
    QVERIFY(!settings);
    FT_VERIFY_MATCH(holdsAll(settings.error().message, {says}));
  }

  void describesItself() {
    const nlohmann::json rows = toJson(std::span<const Setting>(declared()));
    QCOMPARE(rows.size(), std::size_t{7});
    QVERIFY(rows[0]["key"] == "degree" && rows[0]["type"] == "integer" && rows[0]["min"] == 1 && rows[0]["max"] == 6);
    QVERIFY(rows[2]["min"].is_null() && rows[2]["max"].is_null() && rows[2]["default"] == -2.5);
    QVERIFY(rows[5]["choices"] == nlohmann::json({"tracker", "sensor"}));
  }
};

FIELDTRUE_TEST(SettingsTest)
#include "settings_test.moc"
