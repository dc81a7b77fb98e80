#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/correctors/base/method.h"
#include "calib/correctors/polynomial/polynomial_hold_out.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

/// Each axis a power of a mix of the coordinates: a polynomial of that degree and of no lower one.
Eigen::Vector3d power_m(const Eigen::Vector3d& p, int degree) {
  return {0.05 * std::pow(p.x() + 0.4 * p.y(), degree), 0.04 * std::pow(p.y() - p.z(), degree),
          0.03 * std::pow(p.z() + 0.5 * p.x(), degree)};
}

FitData noisyData(const std::vector<Eigen::Vector3d>& places_m, const Displacement& displacement_m, double noise_sd_m,
                  int visits = 1) {
  std::mt19937_64 generator(7);
  std::normal_distribution<double> noise_m(0.0, noise_sd_m);
  FitData data;
  for (int visit = 0; visit < visits; ++visit)
    for (std::size_t place = 0; place < places_m.size(); ++place) {
      data.p_tracked_m.push_back(places_m[place]);
      data.p_true_m.push_back(places_m[place] + displacement_m(places_m[place]));
      // Visits differ by what the tracker read, not by where the jig stood.
      data.p_tracked_m.back() += Eigen::Vector3d(noise_m(generator), noise_m(generator), noise_m(generator));
      data.node.push_back(static_cast<int>(place));
    }
  return data;
}

std::string noteOf(const FitData& data, const std::string& degree = "auto") {
  const auto model = fitPosition("polynomial", data, {{"degree", degree}});
  return model ? (*model)->note() : model.error().message;
}

}  // namespace

class PolynomialDegreeTest : public QObject {
  Q_OBJECT
 private slots:
  void findsTheDegreeOfTheField_data() {
    QTest::addColumn<int>("degree");
    QTest::addColumn<double>("noise_sd_m");
    for (int degree = 1; degree <= 4; ++degree) {
      QTest::addRow("degree %d, noise", degree) << degree << 2e-4;
      QTest::addRow("degree %d, exact", degree) << degree << 0.0;
    }
  }
  void findsTheDegreeOfTheField() {
    QFETCH(int, degree);
    QFETCH(double, noise_sd_m);
    const auto field_m = [degree](const Eigen::Vector3d& p) { return power_m(p, degree); };
    const std::string note = noteOf(noisyData(shakenGrid({7, 7, 7}, 0.2, 0.02), field_m, noise_sd_m));
    const QByteArray wanted = "Degree " + QByteArray::number(degree) + " was chosen by leaving each place out";
    FT_VERIFY_MATCH(holdsAll(note, {wanted, "1 to 6 were tried"}));
  }

  void aGivenDegreeIsNotCommentedOn() {
    const FitData data = noisyData(
        shakenGrid({5, 5, 5}, 0.2, 0.02), [](const auto& p) { return power_m(p, 2); }, 1e-4);
    QCOMPARE(noteOf(data, "2"), std::string());
  }

  void degreesTheGridDoesNotDetermineAreLeftOut() {
    // Three exact levels along x carry x^2 and no more; two carry x.
    const auto field_m = [](const Eigen::Vector3d& p) { return power_m(p, 3); };
    std::vector<Eigen::Vector3d> three_m = shakenGrid({3, 6, 6}, 0.2, 0.0);
    FitData data = fitDataOf(three_m, field_m);
    FT_VERIFY_MATCH(holdsAll(noteOf(data), {"1 to 2 were tried"}));
    data = fitDataOf(shakenGrid({2, 6, 6}, 0.2, 0.0), field_m);
    FT_VERIFY_MATCH(holdsAll(noteOf(data), {"Degree 1", "the only one"}));
  }

  void tooFewPlacesAreRefusedInOneSentence() {
    std::vector<Eigen::Vector3d> places_m = shakenGrid({3, 3, 3}, 0.2, 0.02);
    places_m.resize(3);
    FT_VERIFY_MATCH(holdsAll(noteOf(fitDataOf(places_m, [](const auto& p) { return power_m(p, 1); })),
                             {"Polynomial of degree 1 needs at least 4 places, got 3"}));
    // Four places determine degree 1, and none of them can be spared.
    places_m = {{0, 0, 0}, {0.3, 0, 0}, {0, 0.3, 0}, {0, 0, 0.3}};
    const auto four = fitPosition("polynomial", fitDataOf(places_m, [](const auto& p) { return power_m(p, 1); }),
                                  {{"degree", "auto"}});
    QVERIFY(!four && four.error().code == ErrorCode::kTooFewNodes);
    FT_VERIFY_MATCH(holdsAll(four.error().message, {"needs more than the 4 places", "leave each out"}));
  }

  void theChoiceIsStoredAndStopsOnRequest() {
    const FitData data = noisyData(
        shakenGrid({5, 5, 5}, 0.2, 0.02), [](const auto& p) { return power_m(p, 2); }, 1e-4);
    const PositionMethod& method = *findPositionMethod("polynomial").value();
    const Settings automatic = settingsOf(method, {{"degree", "auto"}});
    const auto model = method.fit(data, automatic, {});
    FT_VERIFY_OK(model);
    const auto reloaded = method.load(nlohmann::json::parse((*model)->parameters().dump()));
    FT_VERIFY_OK(reloaded);
    QVERIFY(!(*model)->note().empty() && (*reloaded)->note() == (*model)->note());
    std::stop_source stop;
    stop.request_stop();
    RunControl control;
    control.stop = stop.get_token();
    const auto stopped = method.fit(data, automatic, control);
    QVERIFY(!stopped && stopped.error().code == ErrorCode::kCancelled);
  }

  void fitsWithRowsLeftOutKeepTheDegreeOfAll() {
    const FitData data = noisyData(
        shakenGrid({5, 5, 5}, 0.2, 0.02), [](const auto& p) { return power_m(p, 2); }, 1e-4);
    const PositionMethod& method = *findPositionMethod("polynomial").value();
    const auto fits = method.hold_out(data, settingsOf(method, {{"degree", "auto"}}), {});
    FT_VERIFY_OK(fits);
    const std::vector<std::size_t> rows{3, 17};
    const auto held_out = (*fits)->without(rows, Pose{});
    FT_VERIFY_OK(held_out);
    FT_VERIFY_MATCH(holdsAll((*held_out)->note(), {"Degree 2 was chosen"}));
  }

  void closedLeaveOneOutEqualsFittingTheOthers() {
    // Two visits a place leave together; the score of a place is the mean of its rows' squared errors.
    const FitData data = noisyData(
        shakenGrid({4, 4, 4}, 0.2, 0.02), [](const auto& p) { return power_m(p, 3); }, 1e-3, 2);
    const Places places = mergePlaces(data);
    std::vector<Eigen::Vector3d> d_m;
    for (std::size_t row = 0; row < data.size(); ++row) d_m.push_back(data.p_true_m[row] - data.p_tracked_m[row]);
    const auto fits = PolynomialHoldOut::make({"Polynomial", data.p_tracked_m, d_m, 2, 3, places.size()}, places);
    FT_VERIFY_OK(fits);
    const auto squares_m2 = fits->leaveOneOutSquares();
    QVERIFY(squares_m2 && squares_m2->size() == 64);
    for (std::size_t place = 0; place < places.size(); ++place) {
      FitData rest;
      for (std::size_t row = 0; row < data.size(); ++row) {
        if (data.node[row] == places.node[place]) continue;
        rest.p_tracked_m.push_back(data.p_tracked_m[row]);
        rest.p_true_m.push_back(data.p_true_m[row]);
        rest.node.push_back(data.node[row]);
      }
      const auto refitted = fitPosition("polynomial", rest, {{"degree", "2"}});
      FT_VERIFY_OK(refitted);
      double expected_m2 = 0.0;
      for (const std::size_t row : places.rows[place])
        expected_m2 += 0.5 * ((*refitted)->displacement_m(data.p_tracked_m[row]) - d_m[row]).squaredNorm();
      FT_VERIFY_MATCH(near((*squares_m2)[place], expected_m2, 1e-12));
    }
  }

  void everyPolynomialMethodTakesAuto() {
    const auto turned = [](const Eigen::Vector3d& p) {
      return rotationFromVector(0.1 * Eigen::Vector3d(p.x() * p.y(), p.z(), p.y() * p.y()));
    };
    const FitData data = fitDataOf(
        shakenGrid({5, 5, 5}, 0.2, 0.02), [](const auto&) { return Eigen::Vector3d(0, 0, 0); }, turned);
    int n_methods = 0;
    for (const OrientationMethod& method : orientationMethods()) {
      if (!method.id.starts_with("polynomial")) continue;
      ++n_methods;
      const auto model = method.fit(data, settingsOf(method, {{"degree", "auto"}}), {});
      FT_VERIFY_OK(model);
      FT_VERIFY_MATCH(holdsAll((*model)->note(), {"was chosen by leaving each place out"}));
    }
    QVERIFY(n_methods > 0);
  }
};

FIELDTRUE_TEST(PolynomialDegreeTest)
#include "polynomial_degree_test.moc"
