#include <QTest>
#include <algorithm>
#include <set>

#include "calib/evaluation/folds.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

std::vector<Node> twoVisitNodes() {
  SyntheticOptions options;
  options.counts = {4, 3, 3};
  options.orientations = 2;
  return syntheticTable(options).nodes;
}

std::set<int> placesAt(const std::vector<Node>& nodes, const std::vector<std::size_t>& rows) {
  std::set<int> places;
  for (const std::size_t row : rows) places.insert(nodes[row].node);
  return places;
}

}  // namespace

class ValidationTest : public QObject {
  Q_OBJECT
 private slots:
  void textsAreReadAndWritten_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<bool>("good");
    for (const char* good : {"role", "loo", "kfold:2", "kfold:10", "block:8"})
      QTest::newRow(good) << QByteArray(good) << true;
    for (const char* bad :
         {"", "kfold", "kfold:", "kfold:1", "kfold:ten", "kfold:10x", "block:7", "block", "LOO", "loo:3"})
      QTest::addRow("bad '%s'", bad) << QByteArray(bad) << false;
  }
  void textsAreReadAndWritten() {
    QFETCH(QByteArray, text);
    QFETCH(bool, good);
    const auto validation = parseValidation(text.toStdString());
    QCOMPARE(validation.has_value(), good);
    if (good) QCOMPARE(QByteArray::fromStdString(toText(*validation)), text);
    if (!good) QCOMPARE(validation.error().code, ErrorCode::kBadInput);
  }

  void roleIsTheDefaultWhereThereAreValidationRows() {
    CalibrationTable table = syntheticTable();
    QCOMPARE(toText(defaultValidation(table, false)), std::string("loo"));
    QCOMPARE(toText(defaultValidation(table, true)), std::string("kfold:10"));
    table.nodes[3].role = NodeRole::kSkipped;
    QCOMPARE(toText(defaultValidation(table, false)), std::string("loo"));
    table.nodes[4].role = NodeRole::kValidation;
    QCOMPARE(toText(defaultValidation(table, false)), std::string("role"));
    QCOMPARE(toText(defaultValidation(table, true)), std::string("role"));
  }

  void everyPlaceIsHeldOutOnceAndWhole_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<int>("folds");
    QTest::newRow("loo") << QByteArray("loo") << 36;
    QTest::newRow("kfold:5") << QByteArray("kfold:5") << 5;
    QTest::newRow("kfold:100") << QByteArray("kfold:100") << 36;
    QTest::newRow("block:8") << QByteArray("block:8") << 8;
  }
  void everyPlaceIsHeldOutOnceAndWhole() {
    QFETCH(QByteArray, text);
    QFETCH(int, folds);
    const std::vector<Node> nodes = twoVisitNodes();
    const auto made = makeFolds(nodes, parseValidation(text.toStdString()).value(), 1);
    FT_VERIFY_OK(made);
    QCOMPARE(static_cast<int>(made->size()), folds);
    std::vector<int> n_scored(nodes.size(), 0);
    for (const Fold& fold : *made) {
      QCOMPARE(fold.fitted.size() + fold.scored.size(), nodes.size());
      for (const std::size_t row : fold.scored) ++n_scored[row];
      const std::set<int> fitted = placesAt(nodes, fold.fitted);
      for (const int place : placesAt(nodes, fold.scored)) QVERIFY(!fitted.contains(place));
    }
    QVERIFY(std::all_of(n_scored.begin(), n_scored.end(), [](int n) { return n == 1; }));
  }

  void foldsFollowTheSeedAndAreEven() {
    const std::vector<Node> nodes = twoVisitNodes();
    const auto first = makeFolds(nodes, {ValidationKind::kFolds, 5}, 1).value();
    const auto again = makeFolds(nodes, {ValidationKind::kFolds, 5}, 1).value();
    const auto other = makeFolds(nodes, {ValidationKind::kFolds, 5}, 2).value();
    bool differs = false;
    for (std::size_t k = 0; k < first.size(); ++k) {
      QCOMPARE(first[k].scored, again[k].scored);
      differs = differs || first[k].scored != other[k].scored;
      const std::size_t n_places = placesAt(nodes, first[k].scored).size();
      QVERIFY(n_places == 7 || n_places == 8);  // 36 places in 5 folds.
    }
    QVERIFY(differs);
  }

  void blocksAreOctants() {
    const std::vector<Node> nodes = twoVisitNodes();
    const std::vector<Fold> folds = makeFolds(nodes, {ValidationKind::kBlocks, 8}, 1).value();
    for (const Fold& fold : folds) {
      // 4 x 3 x 3 at pitch 0.2 m: no block reaches over more than 2 places along an axis.
      for (const std::size_t a : fold.scored)
        for (const std::size_t b : fold.scored)
          QVERIFY((nodes[a].reference_from_sensor.position_m - nodes[b].reference_from_sensor.position_m)
                      .cwiseAbs()
                      .maxCoeff() < 0.25);
    }
  }

  void roleScoresValidationRowsByFitRowsOfOtherPlaces() {
    std::vector<Node> nodes = twoVisitNodes();
    nodes[0].role = NodeRole::kValidation;  // Place 0, visit 0; visit 1 stays fit, and must not be fitted.
    nodes[10].role = NodeRole::kValidation;
    nodes[11].role = NodeRole::kValidation;
    const auto folds = makeFolds(nodes, {ValidationKind::kRole, 0}, 1);
    FT_VERIFY_OK(folds);
    QCOMPARE(folds->size(), std::size_t{1});
    QCOMPARE(folds->front().scored, (std::vector<std::size_t>{0, 10, 11}));
    QCOMPARE(folds->front().fitted.size(), nodes.size() - 4);
    QVERIFY(!placesAt(nodes, folds->front().fitted).contains(nodes[0].node));
  }

  void whatCannotBeHeldOutIsSaid() {
    std::vector<Node> nodes = twoVisitNodes();
    const auto no_validation = makeFolds(nodes, {ValidationKind::kRole, 0}, 1);
    QVERIFY(!no_validation && no_validation.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(no_validation.error().message, {"role 'validation'", "loo"}));
    for (Node& node : nodes) node.role = NodeRole::kValidation;
    QVERIFY(!makeFolds(nodes, {ValidationKind::kRole, 0}, 1));
    nodes.resize(2);  // Two visits of one place.
    const auto single = makeFolds(nodes, {ValidationKind::kLeaveOneOut, 0}, 1);
    QVERIFY(!single && single.error().code == ErrorCode::kTooFewNodes);
    FT_VERIFY_MATCH(holdsAll(single.error().message, {"2 places", "got 1"}));
  }
};

FIELDTRUE_TEST(ValidationTest)
#include "validation_test.moc"
