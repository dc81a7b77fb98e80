#include "calib/gap/report_json.h"

#include <QTemporaryDir>
#include <QTest>
#include <fstream>
#include <limits>

#include "calib/gap/report_reader.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;
using nlohmann::json;

namespace {

SelectedEffect someMetal() {
  SelectedEffect metal;
  metal.effect = "compact_metal";
  metal.equivalents = {"compact_metal", "closed_loop"};
  metal.probability = 0.93;
  metal.bic_gain = 512.25;
  metal.parameters = {{"strength_m3", "m^3", -0.012, -0.014, -0.01}, {"radius_m", "m", 0.1, std::nullopt, 0.2}};
  metal.location_m = Eigen::Vector3d(0.7, -0.2, 1.1);
  metal.location_covariance_m2 = Eigen::Vector3d(1e-4, 4e-4, 9e-4).asDiagonal();
  metal.material = "conductive";
  metal.shrinkage = {12.5, 2.5, 0.8, 0.7, 0.9};
  metal.is_plausible = false;
  metal.doubt = "stands on a place";
  metal.scene_parameters = {{"center_m", {0.7, -0.2, 1.1}}, {"material", "aluminium"}};
  metal.credit_fraction = 0.95;
  metal.excess2_before_mm2 = 156.25;
  metal.excess2_after_mm2 = 6.25;
  return metal;
}

/// Every member away from its default, so that a key forgotten in either direction shows.
GapReport someReport() {
  GapReport report;
  report.input = {7, 9, 540, 2, false};
  report.tracker_from_reference = {Eigen::Vector3d(0.1, -0.2, 0.3), rotationFromVector(Eigen::Vector3d(0.3, -1, 2))};
  report.sensor_from_mount = {Eigen::Vector3d(0.01, 0, 0), rotationFromVector(Eigen::Vector3d(0, 0.2, 0))};
  report.verdict = GapVerdict::kPartlyExplained;
  report.text = "Metal was found.";
  report.smallest_detectable = {{"coil_gain", "gain", 0.01, ""}};
  report.position_rms_mm = 12.75;
  report.orientation_rms_deg = 0.5;
  report.floor_position_mm = 1.25;
  report.floor_orientation_deg = 0.125;
  report.ratio_to_floor = 10.2;
  report.p_value = 0.002;
  GapNode node;
  node.node = 17;
  node.visit = 1;
  node.place_m = Eigen::Vector3d(0.5, 0.25, -0.125);
  node.before_m = Eigen::Vector3d(0.003, -0.004, 0.012);
  node.after_m = Eigen::Vector3d(0.001, 0, 0);
  node.before_rad = Eigen::Vector3d(0, 0.01, 0);
  node.after_rad = Eigen::Vector3d(0, 0, 0.002);
  node.excess = 9.5;
  node.is_flagged = true;
  report.nodes = {node};
  report.hotspot = Hotspot{Eigen::Vector3d(1, 2, 3), 0.4, 0.05, 0.25};
  report.source_shape = SourceShape{Shape::kIronBar, Eigen::Vector3d(1, 2, 4), Eigen::Vector3d(0.5, 0.25, 0.125),
                                    Eigen::Vector3d(0.0625, 0.03125, 0.015625), Eigen::Matrix3d::Identity()};
  report.channels = {{"radial", "mm", 3.5, 0.5}};
  report.by_range = {{0.5, 1.0, 4.0, 1.0}};
  report.by_layer = {{0.3, 0.3, 5.0, 1.5}};
  report.by_time = {{0.0, 60.0, 6.0, 1.75}};
  report.origin = {0.625, 0.125, 0.0625, 0.1875};
  report.findings = {{"hemisphere_flip", "Node 3 is reported in the other hemisphere.", {3}}};
  GapCandidate none;
  none.effect = "none";
  none.equivalents = {"none"};
  none.probability = 0.07;
  report.candidates = {someMetal(), none};
  report.selected = {someMetal()};
  report.sequence = {{"", 12.5, 10.0, 15.0, 0.8, 0.5, 1.1}, {"compact_metal", 2.5, std::nullopt, 3.0, 0.1, -0.1, 0.2}};
  report.remaining = {3.25, 0.2, 0.1, 0.3, true, 156.25, 6.25, 2.5, 4.0, 5.0, 6.5, 17, {17, 4}};
  report.rival = {12.5, 30.0, 1.5, 0.5, 0.875, {"gain_drift"}, "A field without a name does as well."};
  report.odds_over_next = 14.5;
  report.isolability = {{{"compact_metal", "closed_loop", 0.31, 1.5}}, {"One orientation only."}};
  report.not_looked_for = "9 places are too few";
  report.next_measurement = "Turn the sensor.";
  report.next_separates = {"compact_metal", "closed_loop"};
  report.predictions = {{"compact_metal", 1, 17, 31.0, 12.0, 4.0}};
  report.replicates = Replicates{50, 41, 0.25, "closed_loop", 10, 7, 2, "Of 50, 41 were named right."};
  report.against = Against{true, 0.0025, 4.5, Eigen::Vector3d(0.25, -0.5, 0.75), "compact_metal"};
  return report;
}

}  // namespace

class GapJsonTest : public QObject {
  Q_OBJECT

 private slots:
  void theContractsKeysAreThere_data() {
    QTest::addColumn<QString>("pointer");
    QTest::addColumn<QStringList>("keys");
    QTest::newRow("top") << ""
                         << QString(
                                "schema software input alignment verdict text smallest_detectable gap where "
                                "findings candidates selected remaining isolability next_measurement "
                                "sequence predictions rival odds_over_next replicates against")
                                .split(' ');
    QTest::newRow("input") << "/input" << QString("places rows samples orientations position_only").split(' ');
    QTest::newRow("alignment") << "/alignment/tracker_from_reference" << QStringList{"t_m", "q_wxyz"};
    QTest::newRow("mount") << "/alignment/sensor_mount" << QStringList{"t_m", "q_wxyz"};
    QTest::newRow("smallest") << "/smallest_detectable/0" << QString("effect parameter value unit").split(' ');
    QTest::newRow("gap") << "/gap"
                         << QString(
                                "position_rms_mm orientation_rms_deg floor_position_mm "
                                "floor_orientation_deg ratio_to_floor p_value")
                                .split(' ');
    QTest::newRow("where")
        << "/where" << QString("nodes hotspot source_shape channels by_range by_layer by_time origin").split(' ');
    QTest::newRow("node") << "/where/nodes/0"
                          << QString(
                                 "node visit gap_mm gap_deg excess flagged place_m before_mm "
                                 "after_mm")
                                 .split(' ');
    QTest::newRow("hotspot") << "/where/hotspot" << QStringList{"center_m", "radius_m", "sd_m", "half_m"};
    QTest::newRow("shape") << "/where/source_shape"
                           << QString("shape center_m polarizabilities_m3 sd_m3 axes").split(' ');
    QTest::newRow("channel") << "/where/channels/0" << QString("name rms unit floor").split(' ');
    QTest::newRow("range") << "/where/by_range/0" << QString("low_m high_m rms_mm floor_mm").split(' ');
    QTest::newRow("layer") << "/where/by_layer/0" << QString("layer rms_mm floor_mm").split(' ');
    QTest::newRow("time") << "/where/by_time/0" << QString("t_start_s t_end_s rms_mm floor_mm").split(' ');
    QTest::newRow("origin") << "/where/origin" << QString("room transmitter sensor jig_or_time").split(' ');
    QTest::newRow("finding") << "/findings/0" << QString("effect text nodes").split(' ');
    const QStringList candidate =
        QString(
            "effect class probability bic_gain parameters location_m material shrinkage plausible "
            "scene_parameters doubt")
            .split(' ');
    QTest::newRow("candidate") << "/candidates/0" << candidate;
    QTest::newRow("none") << "/candidates/1" << candidate;
    QTest::newRow("selected") << "/selected/0"
                              << candidate + QStringList{"credit_fraction", "excess2_before_mm2", "excess2_after_mm2"};
    QTest::newRow("parameter") << "/candidates/0/parameters/radius_m" << QString("value unit low90 high90").split(' ');
    QTest::newRow("shrinkage") << "/candidates/0/shrinkage"
                               << QString("before_mm after_mm fraction low90 high90").split(' ');
    QTest::newRow("sequence")
        << "/sequence/1" << QString("effect excess_mm low90_mm high90_mm excess_deg low90_deg high90_deg").split(' ');
    QTest::newRow("remaining") << "/remaining"
                               << QString(
                                      "position_rms_mm fraction_of_start fraction_low90 fraction_high90 of "
                                      "excess2_before_mm2 excess2_after_mm2 p50_mm p90_mm p95_mm worst_mm "
                                      "worst_node where")
                                      .split(' ');
    QTest::newRow("rival") << "/rival"
                           << QString(
                                  "nats_over_unnamed unnamed_nats unseen_gain unseen_gain_low90 named_share "
                                  "refused why")
                                  .split(' ');
    QTest::newRow("isolability") << "/isolability" << QStringList{"pairs", "warnings"};
    QTest::newRow("pair") << "/isolability/pairs/0" << QString("a b r2").split(' ');
    QTest::newRow("against") << "/against" << QString("changed p_value rms_mm location_m effect").split(' ');
    QTest::newRow("replicates") << "/replicates" << QString("n named_right within_m_median text").split(' ');
    QTest::newRow("next") << "/next_measurement" << QStringList{"text", "separates"};
  }

  void theContractsKeysAreThere() {
    QFETCH(QString, pointer);
    QFETCH(QStringList, keys);
    const json document = toJson(someReport());
    const json& object = document.at(json::json_pointer(pointer.toStdString()));
    for (const QString& key : keys) QVERIFY2(object.contains(key.toStdString()), qPrintable(key));
  }

  void valuesStandInTheUnitsOfTheirNames() {
    const json document = toJson(someReport());
    const json& node = document["where"]["nodes"][0];
    FT_VERIFY_MATCH(near(node["gap_mm"].get<double>(), 13.0, 1e-12));  // |(3, -4, 12)|
    FT_VERIFY_MATCH(near(node["gap_deg"].get<double>(), 0.5729577951308232, 1e-12));
    FT_VERIFY_MATCH(near(node["before_mm"][2].get<double>(), 12.0, 1e-12));
    QCOMPARE(document["schema"].get<std::string>(), std::string("fieldtrue.gap/1"));
    QCOMPARE(document["verdict"].get<std::string>(), std::string("partly_explained"));
    QVERIFY(document["candidates"][1]["location_m"].is_null());
    QVERIFY(document["candidates"][1]["material"].is_null());
    QVERIFY(document["candidates"][1]["scene_parameters"].is_null());
    QVERIFY(document["candidates"][0]["parameters"]["radius_m"]["low90"].is_null());
  }

  void whatCannotBeEstimatedIsNull() {
    GapReport report = someReport();
    report.input.position_only = true;
    report.orientation_rms_deg.reset();
    report.floor_orientation_deg.reset();
    report.hotspot.reset();
    report.against->location_m.reset();
    report.against->effect.clear();
    report.origin.sensor = std::numeric_limits<double>::quiet_NaN();
    const json document = toJson(report);
    QVERIFY(document["gap"]["orientation_rms_deg"].is_null());
    QVERIFY(document["gap"]["floor_orientation_deg"].is_null());
    QVERIFY(document["where"]["hotspot"].is_null());
    QVERIFY(document["against"]["location_m"].is_null());
    QVERIFY(document["against"]["effect"].is_null());
    QVERIFY(document["where"]["nodes"][0]["gap_deg"].is_null());
    QVERIFY(document["where"]["origin"]["sensor"].is_null());
    const auto read = readGapReport(document, "r");
    FT_VERIFY_OK(read);
    QVERIFY(!read->orientation_rms_deg && !read->hotspot);
    QVERIFY(std::isnan(read->origin.sensor));
    QVERIFY(read->against && !read->against->location_m && read->against->effect.empty());
  }

  void readingGivesTheSameReport() {
    const GapReport report = someReport();
    const json document = json::parse(toJson(report).dump());
    const auto read = readGapReport(document, "r");
    FT_VERIFY_OK(read);
    const json again = toJson(*read);
    // Lengths and angles go through mm and degrees: equal to within rounding. All else is equal as it stands.
    FT_VERIFY_MATCH(near(read->nodes[0].before_m, report.nodes[0].before_m, 1e-17));
    FT_VERIFY_MATCH(near(read->nodes[0].after_m, report.nodes[0].after_m, 1e-17));
    FT_VERIFY_MATCH(near(read->nodes[0].before_rad, report.nodes[0].before_rad, 1e-17));
    FT_VERIFY_MATCH(near(read->nodes[0].after_rad, report.nodes[0].after_rad, 1e-17));
    json same = document, seen = again;
    same["where"].erase("nodes");
    seen["where"].erase("nodes");
    QCOMPARE(QString::fromStdString(seen.dump(1)), QString::fromStdString(same.dump(1)));
    QCOMPARE(read->nodes.size(), std::size_t(1));
    QVERIFY(read->nodes[0].is_flagged);
    QCOMPARE(read->nodes[0].node, 17);
    QCOMPARE(read->selected[0].parameters[0].name, std::string("strength_m3"));
    QVERIFY(read->selected[0].location_covariance_m2 == report.selected[0].location_covariance_m2);
  }

  void filesAreReadBack() {
    const QTemporaryDir folder;
    const std::filesystem::path path = folder.filePath("a.gap.json").toStdString();
    FT_VERIFY_OK(writeGapReport(path, someReport()));
    const auto read = readGapReport(path);
    FT_VERIFY_OK(read);
    QCOMPARE(read->text, std::string("Metal was found."));
    QVERIFY(!readGapReport(std::filesystem::path("/nonexistent/a.gap.json")));
  }

  void badDocumentsAreNamed_data() {
    QTest::addColumn<QString>("pointer");
    QTest::addColumn<QString>("value");
    QTest::addColumn<QByteArray>("fragment");
    QTest::newRow("schema") << "/schema"
                            << "\"fieldtrue.scene/1\"" << QByteArray("fieldtrue.gap/1");
    QTest::newRow("newer") << "/schema"
                           << "\"fieldtrue.gap/2\"" << QByteArray("newer version");
    QTest::newRow("number") << "/gap/p_value"
                            << "\"small\"" << QByteArray("gap.p_value is the text \"small\"");
    QTest::newRow("list") << "/where/nodes"
                          << "3" << QByteArray("where.nodes");
    QTest::newRow("vector") << "/where/nodes/0/place_m"
                            << "[1, 2]" << QByteArray("where.nodes[0].place_m");
    QTest::newRow("verdict") << "/verdict"
                             << "\"maybe\"" << QByteArray("partly_explained");
    QTest::newRow("object") << "/candidates/0/shrinkage"
                            << "[]" << QByteArray("candidates[0].shrinkage");
    QTest::newRow("whole") << "/input/places"
                           << "1.5" << QByteArray("input.places");
  }

  void badDocumentsAreNamed() {
    QFETCH(QString, pointer);
    QFETCH(QString, value);
    QFETCH(QByteArray, fragment);
    json document = toJson(someReport());
    document[json::json_pointer(pointer.toStdString())] = json::parse(value.toStdString());
    const auto read = readGapReport(document, "bad.gap.json");
    QVERIFY(!read);
    FT_VERIFY_MATCH(holdsAll(read.error().message, {"bad.gap.json", fragment}));
  }

  void aMissingKeyIsNamed() {
    json document = toJson(someReport());
    document["where"].erase("origin");
    const auto read = readGapReport(document, "bad.gap.json");
    QVERIFY(!read);
    FT_VERIFY_MATCH(holdsAll(read.error().message, {"where.origin is missing"}));
  }
};

FIELDTRUE_TEST(GapJsonTest)
#include "report_json_test.moc"
