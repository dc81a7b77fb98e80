#include <QApplication>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QSettings>
#include <QSpinBox>
#include <QTemporaryDir>
#include <QTest>

#include "acquisition/plan/place_state.h"
#include "calib/evaluation/error_stats.h"
#include "tests/support/test_main.h"
#include "widgets/compare/field_scales.h"
#include "widgets/compare/node_facts.h"
#include "widgets/compare/score_model.h"
#include "widgets/figures/field_scale.h"
#include "widgets/forms/settings_form.h"
#include "widgets/pages/place_list_model.h"
#include "widgets/style/unit_texts.h"
#include "widgets/workbench/compared_methods.h"

namespace fieldtrue::widgets {
namespace {

evaluation::ErrorStats statsOf(double rms) { return {rms, rms, rms, rms, rms, rms, rms}; }

// Two places; polynomial halves the error, hmq doubles it, affine cannot be used.
evaluation::Comparison smallComparison() {
  evaluation::Comparison comparison;
  comparison.places = {3, 7};
  comparison.before_position_mm = statsOf(10.0);
  comparison.before_place_mm = {10.0, 10.0};
  comparison.before_residual_m = {Eigen::Vector3d(0.01, 0, 0), Eigen::Vector3d(0, 0.01, 0)};
  auto score = [](const char* method, double rms) {
    evaluation::MethodScore result;
    result.method = method;
    result.stats = statsOf(rms);
    result.place_errors = {rms, rms};
    result.residual_m = {Eigen::Vector3d(rms / 1000.0, 0, 0), Eigen::Vector3d(0, rms / 1000.0, 0)};
    return result;
  };
  evaluation::MethodScore unusable;
  unusable.method = "affine";
  unusable.skipped = "Affine needs 4 places, got 2";
  comparison.position = {score("none", 10.0), score("polynomial", 5.0), score("hmq", 20.0), unusable};
  comparison.best_position = "polynomial";
  comparison.best_position_row = 1;
  return comparison;
}

}  // namespace

class PageModelsTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() {
    QVERIFY(folder_.isValid());
    qputenv("XDG_CONFIG_HOME", folder_.path().toUtf8());
  }

  void scoresMarkBestWorseAndUnusable() {
    ScoreModel model(ScoreModel::Part::kPosition);
    model.setComparison(smallComparison());
    QCOMPARE(model.rowCount(), 4);  // Before, polynomial, hmq, affine; "none" is "before".
    const int polynomial = model.rowOf(QStringLiteral("polynomial"));
    const int hmq = model.rowOf(QStringLiteral("hmq"));
    const int affine = model.rowOf(QStringLiteral("affine"));
    QVERIFY(model.data(model.index(polynomial, 1), Qt::FontRole).value<QFont>().bold());
    QVERIFY(!model.data(model.index(hmq, 1), Qt::FontRole).value<QFont>().bold());
    QVERIFY(model.data(model.index(hmq, 0), Qt::DisplayRole).toString().contains(QStringLiteral("worse")));
    QCOMPARE(model.data(model.index(polynomial, 1), Qt::DisplayRole).toString(), QStringLiteral("5.00"));
    QVERIFY(model.data(model.index(affine, 0), Qt::ToolTipRole)
                .toString()
                .contains(QStringLiteral("Affine needs 4 places, got 2")));
    QVERIFY(model.data(model.index(affine, 1), ScoreModel::kSortRole).toDouble() > 1e6);
    QCOMPARE(model.toText().count(QLatin1Char('\n')), 4);
  }

  void settingsFormRoundTrips() {
    const std::vector<Setting> declared = {
        {"degree", "Degree", SettingType::kInteger, "", 1, 6, std::int64_t{3}, {}, ""},
        {"radius", "Radius", SettingType::kNumber, "cm2", 10, 1000, 100.0, {}, ""},
        {"smoothing", "Smoothing", SettingType::kAutoNumber, "", 0, 1, std::string("auto"), {}, ""},
        {"robust", "Robust", SettingType::kBool, "", 0, 0, true, {}, ""},
        {"frame", "Frame", SettingType::kChoice, "", 0, 0, std::string("tracker"), {"tracker", "sensor"}, ""}};
    SettingsForm form;
    form.setSettings(declared);
    Settings expected;
    for (const Setting& setting : declared) expected[setting.key] = setting.default_value;
    QVERIFY(form.values() == expected);

    int changes = 0;
    connect(&form, &SettingsForm::changed, this, [&changes] { ++changes; });
    form.findChild<QSpinBox*>(QStringLiteral("setting_degree"))->setValue(5);
    form.findChild<QComboBox*>(QStringLiteral("setting_frame"))->setCurrentText(QStringLiteral("sensor"));
    form.findChild<QDoubleSpinBox*>(QStringLiteral("setting_smoothing"))->setValue(0.25);
    QCOMPARE(changes, 3);
    expected["degree"] = std::int64_t{5};
    expected["frame"] = std::string("sensor");
    expected["smoothing"] = 0.25;
    QVERIFY(form.values() == expected);
    form.findChild<QSpinBox*>(QStringLiteral("setting_degree"))->setValue(99);
    QVERIFY(form.values().at("degree") == SettingValue(std::int64_t{6}));
  }

  void fieldsShareOneRoundScale() {
    ErrorField before;
    for (int i = 0; i < 20; ++i) {
      FieldArrow arrow;
      arrow.from_m = 0.1 * Eigen::Vector3i(i % 5, i / 5, 0).cast<double>();
      arrow.error_m = Eigen::Vector3d(0.0, 0.0, 0.0041);
      before.arrows.push_back(arrow);
    }
    const FieldScale scale = fieldScale(before);
    QCOMPARE(scale.max_mm, 5.0);  // The next of 1, 2, 5 above 4.1 mm.
    QVERIFY(scale.magnification >= 1.0);
    QVERIFY(scale.magnification * 4.1 <= 100.0);  // Arrows stay shorter than the 100 mm pitch.
    QCOMPARE(fieldScale(ErrorField()).magnification, 1.0);
  }

  void fieldArrowsStandAtTheTruePlaces() {
    const evaluation::Comparison comparison = smallComparison();
    CalibrationTable table;
    for (int number : {3, 7}) {
      Node node;
      node.node = number;
      node.reference_from_sensor.position_m = Eigen::Vector3d(number, 0, 0);
      table.nodes.push_back(node);
    }
    const ErrorField after = heldOutField(comparison, table, 1, std::nullopt);
    QCOMPARE(after.arrows.size(), std::size_t{2});
    QCOMPARE(after.arrows[1].node, 7);
    QCOMPARE(after.arrows[1].from_m, Eigen::Vector3d(7, 0, 0));
    QCOMPARE(after.arrows[1].error_m, Eigen::Vector3d(0, 0.005, 0));
    const ErrorField before = heldOutField(comparison, table, std::nullopt, std::nullopt);
    QCOMPARE(before.arrows[0].error_m, Eigen::Vector3d(0.01, 0, 0));

    // hmq (20 mm) minus polynomial (5 mm), both along x at place 3: 15 mm, and hmq is 15 mm worse.
    const ErrorField difference = differenceField(comparison, table, 2, 1);
    QVERIFY((difference.arrows[0].error_m - Eigen::Vector3d(0.015, 0, 0)).norm() < 1e-12);
    QVERIFY(std::abs(*difference.arrows[0].better_mm - 15.0) < 1e-9);
    const ErrorField reversed = differenceField(comparison, table, 1, 2);
    QVERIFY(std::abs(*reversed.arrows[1].better_mm + 15.0) < 1e-9);
  }

  /// Of several sensors at a place the list shows the fewest samples, the largest SD, the most left out.
  void aPlaceShowsTheWorstOfItsSensors() {
    PlannedPlace place;
    place.node = 4;
    PlaceListModel model;
    model.setPlaces({place});
    Node first, second;
    first.node = second.node = 4;
    second.sensor = 1;
    first.n_used = 60;
    first.covariance_m2 = 3e-8 * Eigen::Matrix3d::Identity();  // 0.3 mm, 3-D.
    second.n_used = 57;
    second.n_rejected = 3;
    second.covariance_m2 = 12e-8 * Eigen::Matrix3d::Identity();  // 0.6 mm.
    const auto shown = [&model](int column) { return model.data(model.index(0, column), Qt::DisplayRole).toString(); };
    for (const auto& rows : {std::vector{first, second}, {second, first}}) {
      model.setTable({{}, rows});
      QCOMPARE(shown(2), QString("57"));
      QCOMPARE(shown(3), QString("0.600"));
      QCOMPARE(shown(4), QString("3"));
    }
    model.setTable({{}, {first}});
    QCOMPARE(shown(2), QString("60"));
    QCOMPARE(shown(3), QString("0.300"));
    model.setTable({});
    QCOMPARE(shown(2), QString());
  }

  void differencesToTheBestAreMarked() {
    evaluation::Comparison comparison = smallComparison();
    evaluation::MethodScore close = comparison.position[1];
    close.method = "rbf";
    close.stats = statsOf(5.2);
    close.rms_to_best = 0.2;
    close.rms_to_best_low90 = -0.1;
    close.rms_to_best_high90 = 0.5;
    comparison.position.push_back(close);
    comparison.position[2].rms_to_best = 15.0;
    comparison.position[2].rms_to_best_low90 = 12.0;
    comparison.position[2].rms_to_best_high90 = 18.0;
    ScoreModel model(ScoreModel::Part::kPosition);
    model.setComparison(comparison);
    const auto toBest = [&model](const char* method) {
      const QModelIndex index = model.index(model.rowOf(QString::fromLatin1(method)), ScoreModel::kToBest);
      return model.data(index, Qt::DisplayRole).toString();
    };
    QCOMPARE(toBest("polynomial"), QStringLiteral("best"));
    QCOMPARE(toBest("rbf"), QStringLiteral("\u2248 0.20 (\u22120.10 to 0.50)"));
    QCOMPARE(toBest("hmq"), QStringLiteral("15.0 (12.0 to 18.0)"));
    QVERIFY(model.about(model.rowOf(QStringLiteral("rbf"))).contains(QStringLiteral("As good as the best")));
    QVERIFY(model.about(model.rowOf(QStringLiteral("affine"))).contains(QStringLiteral("Affine needs 4 places")));
  }

  void ticksSayWhatIsComparedNext() {
    ScoreModel model(ScoreModel::Part::kPosition);
    const std::vector<MethodEntry> registered = registeredMethods(MethodPart::kPosition);
    model.setEntries(registered);
    QCOMPARE(model.rowCount(), static_cast<int>(registered.size()));
    const int row = model.rowOf(QStringLiteral("polynomial"));
    QVERIFY(model.data(model.index(row, 0), Qt::CheckStateRole).toInt() == Qt::Checked);
    QVERIFY(model.setData(model.index(row, 0), Qt::Unchecked, Qt::CheckStateRole));
    for (const MethodText& method : tickedMethods(model.entries())) QVERIFY(method.id != "polynomial");
    Settings settings = model.settings(row);
    settings["degree"] = std::string("4");
    QVERIFY(methodTextOf("polynomial", settings).given.at("degree") == "4");
  }

  void residualsOfAPlaceAreSorted() {
    evaluation::Comparison comparison = smallComparison();
    comparison.position[2].place_covered = {true, false};
    const std::vector<PlaceResidual> residuals = positionResiduals(comparison, 7);
    QCOMPARE(residuals.size(), std::size_t{3});
    QCOMPARE(residuals[0].error, 5.0);
    QCOMPARE(residuals[1].error, 10.0);
    QVERIFY(residuals[1].before);
    QCOMPARE(residuals[2].error, 20.0);
    QVERIFY(!residuals[2].covered);
    QVERIFY(positionResiduals(comparison, 99).empty());
    QVERIFY(orientationResiduals(comparison, 7).empty());
  }

  void driftIsTheSlopeOverTheTake() {
    // 60 samples over 2.95 s that move 1 mm/s along y, alternating by +-0.1 mm along x.
    SampleTable samples;
    for (int k = 0; k < 60; ++k) {
      SampleRow row;
      row.node = 4;
      row.sample.time_s = 10.0 + 0.05 * k;
      row.sample.tracker_from_sensor.position_m = Eigen::Vector3d(k % 2 == 0 ? 1e-4 : -1e-4, 1e-3 * 0.05 * k, 0.5);
      samples.rows.push_back(row);
    }
    const auto drift = takeDrift(samples, 4, 0, 0, 60.0);
    QVERIFY(drift.has_value());
    QVERIFY(std::abs(drift->duration_s - 2.95) < 1e-9);
    QVERIFY2(std::abs(drift->change_mm - 2.95) < 0.02, qPrintable(QString::number(drift->change_mm)));
    // SD of a slope from white scatter s over n even steps dt: s sqrt(12 / n^3) / dt; over the take about s sqrt(12/n).
    QVERIFY(std::abs(drift->chance_sd_mm - 0.1 * std::sqrt(12.0 / 60.0)) < 0.003);
    QVERIFY(!takeDrift(samples, 5, 0, 0, 60.0).has_value());
  }

  void opacityFallsWithTheUncertainty() {
    ErrorField field;
    for (const double sd_mm : {1.0, 2.0, 4.0}) {
      FieldArrow arrow;
      arrow.uncertainty_mm = sd_mm;
      field.arrows.push_back(arrow);
    }
    const ErrorField* fields[] = {&field};
    const auto range = opacityRange(fields);
    QVERIFY(range.has_value());
    QCOMPARE(range->opaque_mm, 1.0);
    QVERIFY(std::abs(range->faint_mm - 3.8) < 1e-9);  // The 95th percentile between 2 and 4.
    QCOMPARE(opacityOf(1.0, *range), 1.0);
    QVERIFY(opacityOf(2.0, *range) < 0.9 && opacityOf(2.0, *range) > opacityOf(3.0, *range));
    QVERIFY(opacityOf(99.0, *range) > 0.05);
    ErrorField unknown;
    unknown.arrows.resize(3);
    fields[0] = &unknown;
    QVERIFY(!opacityRange(fields).has_value());
  }

  void placesTellTheirStateAndNumbers() {
    std::vector<PlannedPlace> planned(2);
    planned[1].node = 1;
    PlaceListModel model;
    model.setPlaces(planned);
    model.setStates({acquisition::PlaceState::kDone, acquisition::PlaceState::kSkipped}, std::nullopt);
    CalibrationTable table;
    Node node;
    node.n_used = 58;
    node.n_rejected = 2;
    node.covariance_m2 = Eigen::Matrix3d(Eigen::Vector3d(1e-6, 2e-6, 1e-6).asDiagonal());  // 3-D SD = 2 mm
    table.nodes.push_back(node);
    model.setTable(table);
    auto text = [&model](int row, int column) {
      return model.data(model.index(row, column), Qt::DisplayRole).toString();
    };
    QCOMPARE(text(0, 1), QStringLiteral("done"));
    QCOMPARE(text(0, 2), QStringLiteral("58"));
    QCOMPARE(text(0, 3), QStringLiteral("2.00"));
    QCOMPARE(text(0, 4), QStringLiteral("2"));
    QCOMPARE(text(1, 1), QStringLiteral("skipped"));
    model.setStates({acquisition::PlaceState::kDone, acquisition::PlaceState::kSkipped}, 1);
    QCOMPARE(text(1, 1), QStringLiteral("next"));
  }

  void threeFigures_data() {
    QTest::addColumn<double>("value");
    QTest::addColumn<QString>("text");
    QTest::newRow("large") << 412.34 << "412";
    QTest::newRow("tens") << 41.234 << "41.2";
    QTest::newRow("ones") << 4.1234 << "4.12";
    QTest::newRow("small") << 0.041234 << "0.0412";
    QTest::newRow("zero") << 0.0 << "0";
    QTest::newRow("negative") << -4.1234 << "-4.12";
    QTest::newRow("unknown") << std::nan("") << "n/a";
  }
  void threeFigures() {
    QFETCH(double, value);
    QTEST(fieldtrue::widgets::threeFigures(value), "text");
  }

 private:
  QTemporaryDir folder_;
};

}  // namespace fieldtrue::widgets

namespace {

int runOffscreen(int argc, char** argv) {
  qputenv("QT_QPA_PLATFORM", "offscreen");
  QApplication application(argc, argv);
  QApplication::setApplicationName(QStringLiteral("fieldtrue-test"));
  fieldtrue::widgets::PageModelsTest test;
  return fieldtrue::testing::runTest(test, argc, argv);
}

}  // namespace

FIELDTRUE_TEST_PROGRAM(runOffscreen)
#include "page_models_test.moc"
