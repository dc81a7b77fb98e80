#include "calib/core/place_name.h"

#include <QTest>

#include "calib/evaluation/comparison.h"
#include "calib/recording/cleaning.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;

class PlaceNameTest : public QObject {
  Q_OBJECT
 private slots:
  void namesAndLists() {
    std::vector<Node> nodes(4);
    for (int i = 0; i < 4; ++i) {
      nodes[static_cast<std::size_t>(i)].node = 10 + i;
      if (i < 3) nodes[static_cast<std::size_t>(i)].index = {i, 2, 0};
    }
    const PlaceNames names(nodes);
    QCOMPARE(names.of(10), std::string("A3, pipe 1"));
    QCOMPARE(names.of(13), std::string("P13"));
    QCOMPARE(names.of(99), std::string("P99"));
    QCOMPARE(names.list({10}), std::string("A3, pipe 1"));
    QCOMPARE(names.list({11, 10, 11}), std::string("A3, pipe 1 and B3, pipe 1"));
    QCOMPARE(names.list({10, 11, 12}), std::string("A3, pipe 1; B3, pipe 1 and C3, pipe 1"));
    QCOMPARE(names.list({10, 11, 12, 13}, 2), std::string("A3, pipe 1; B3, pipe 1 and 2 more"));
    QCOMPARE(names.list({10, 11, 12}, 2), std::string("A3, pipe 1; B3, pipe 1 and C3, pipe 1"));
    const std::vector<int> worst_first{12, 10, 13, 11};
    QCOMPARE(names.listInOrder(worst_first, 2), std::string("C3, pipe 1; A3, pipe 1 and 2 more"));
    QCOMPARE(PlaceNames().list({1, 2, 3, 4, 5, 6, 7}), std::string("P1; P2; P3; P4; P5; P6 and P7"));
  }

  // Sentences of the comparison and the diagnosis call a place what the plan, the list and the room call it.
  void sentencesUseTheName() {
    testing::SyntheticOptions options;
    options.counts = {4, 4, 3};
    testing::SyntheticNoise noise;
    noise.position_sd_m = 0.001;
    CalibrationTable table = testing::syntheticTable(options, noise);
    Node& wrong = table.nodes[22];
    QVERIFY(wrong.index.has_value());
    const std::string name = placeName(wrong.node, wrong.index);
    QVERIFY(name.find(", pipe ") != std::string::npos);
    wrong.tracker_from_sensor.position_m.z() += 0.2;
    const auto comparison = evaluation::compareMethods(table, evaluation::ComparisonOptions());
    QVERIFY(comparison.has_value());
    QVERIFY2(comparison->verdict.text.find(name) != std::string::npos, comparison->verdict.text.c_str());
    table.nodes[22].tracker_from_sensor.position_m *= -1.0;
    const recording::Cleaned cleaned = recording::cleanRows(table);
    QVERIFY(cleaned.findings.size() == 1);
    QVERIFY2(cleaned.findings[0].text.find("(" + name + ")") != std::string::npos, cleaned.findings[0].text.c_str());
  }
};

FIELDTRUE_TEST(PlaceNameTest)
#include "place_name_test.moc"
