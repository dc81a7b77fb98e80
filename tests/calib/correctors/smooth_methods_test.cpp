#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/core/settings.h"
#include "calib/correctors/base/method.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

Eigen::Vector3d ripple_m(const Eigen::Vector3d& p) {
  return 0.01 * Eigen::Vector3d(std::sin(3.0 * p.x()), std::cos(2.0 * p.y() + p.z()), std::sin(2.0 * p.z()));
}

const std::vector<std::string> kSmooth = {"rbf",
                                          "rbf:kernel=inverse_multiquadric",
                                          "rbf:kernel=cubic",
                                          "rbf:kernel=thin_plate",
                                          "gaussian_process",
                                          "gaussian_process:nu=1.5",
                                          "bspline"};

struct Method {
  const PositionMethod* row;
  Settings settings;

  explicit Method(const QString& text) {
    const MethodText method = parseMethodText(text.toStdString()).value();
    row = findPositionMethod(method.id).value();
    settings = settingsOf(*row, method.given);
  }
  Result<std::unique_ptr<PositionModel>> fit(const FitData& data, const RunControl& control = {}) const {
    return row->fit(data, settings, control);
  }
};

FitData noisyWave(std::array<int, 3> counts = {5, 5, 4}) {
  RandomGeometry random(31);
  FitData data = fitDataOf(shakenGrid(counts, 0.2, 0.02), ripple_m);
  for (Eigen::Vector3d& truth_m : data.p_true_m)
    truth_m += 0.0005 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  return data;
}

/// Every place of the data visited twice, 0.2 mm apart.
FitData withVisits() {
  const FitData once = noisyWave();
  FitData twice;
  for (std::size_t i = 0; i < once.size(); ++i)
    for (const double off_m : {-1e-4, 1e-4}) {
      twice.p_tracked_m.push_back(once.p_tracked_m[i] + Eigen::Vector3d::Constant(off_m));
      twice.p_true_m.push_back(once.p_true_m[i]);
      twice.node.push_back(once.node[i]);
    }
  return twice;
}

}  // namespace

/// What radial functions, Gaussian process and B-splines have in common.
class SmoothMethodsTest : public QObject {
  Q_OBJECT
 private:
  void addMethods() {
    QTest::addColumn<QString>("text");
    for (const std::string& text : kSmooth) QTest::newRow(text.c_str()) << QString::fromStdString(text);
  }

 private slots:
  void aNodeOfHugeStatedNoiseHardlyPulls_data() { addMethods(); }
  void aNodeOfHugeStatedNoiseHardlyPulls() {
    QFETCH(QString, text);
    constexpr std::size_t kBad = 47;
    RandomGeometry random(5);
    FitData data = fitDataOf(shakenGrid({5, 5, 4}, 0.2, 0.02), linear_m);
    for (Eigen::Vector3d& truth_m : data.p_true_m)
      truth_m += 1e-4 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    const Eigen::Vector3d at_m = data.p_tracked_m[kBad];
    data.p_true_m[kBad] += Eigen::Vector3d(0.05, -0.05, 0.05);
    data.noise_m2.assign(data.size(), 1e-8 * Eigen::Matrix3d::Identity());
    data.noise_m2[kBad] = 2.5e-3 * Eigen::Matrix3d::Identity();
    const auto told = Method(text).fit(data);
    FT_VERIFY_OK(told);
    const double pulled_m = ((*told)->displacement_m(at_m) - linear_m(at_m)).norm();
    QVERIFY2(pulled_m < 0.0005, qPrintable(QString::number(pulled_m)));
  }

  void betterNoiseMakesABetterFit_data() { addMethods(); }
  void betterNoiseMakesABetterFit() {
    QFETCH(QString, text);
    // Half of the places are twenty times noisier; told so, a fit errs less at fresh positions.
    RandomGeometry random(77);
    FitData data = fitDataOf(shakenGrid({7, 7, 6}, 0.17, 0.02), ripple_m);
    for (std::size_t i = 0; i < data.size(); ++i) {
      const double sd_m = i % 2 == 0 ? 2e-4 : 4e-3;
      data.p_true_m[i] += sd_m * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      data.noise_m2.push_back(sd_m * sd_m * Eigen::Matrix3d::Identity());
    }
    FitData untold = data;
    untold.noise_m2.clear();
    const auto with = Method(text).fit(data), without = Method(text).fit(untold);
    FT_VERIFY_OK(with);
    FT_VERIFY_OK(without);
    double with_squares = 0.0, without_squares = 0.0;
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector3d p_m(random.between(0.4, 1.4), random.between(-0.3, 0.7), random.between(-0.2, 0.6));
      with_squares += ((*with)->displacement_m(p_m) - ripple_m(p_m)).squaredNorm();
      without_squares += ((*without)->displacement_m(p_m) - ripple_m(p_m)).squaredNorm();
    }
    const double ratio = std::sqrt(with_squares / without_squares);
    QVERIFY2(ratio < 0.6, qPrintable(QString::number(ratio)));
  }

  void withoutNobodyIsTheFit_data() { addMethods(); }
  void withoutNobodyIsTheFit() {
    QFETCH(QString, text);
    const Method method(text);
    const FitData data = noisyWave();
    const auto fits = method.row->hold_out(data, method.settings, {});
    FT_VERIFY_OK(fits);
    const auto whole = (*fits)->without({}, Pose{});
    const auto expected = method.fit(data);
    FT_VERIFY_OK(whole);
    FT_VERIFY_OK(expected);
    for (const Eigen::Vector3d& p_m : randomPoints(50))
      FT_VERIFY_MATCH(near((*whole)->displacement_m(p_m), (*expected)->displacement_m(p_m), 1e-9));
  }

  // Not the Gaussian process, whose scales cannot be fixed: they follow the truth that is moved.
  void heldOutPlacesLoseTheirPull_data() {
    QTest::addColumn<QString>("text");
    for (const std::string& text : kSmooth)
      if (!text.starts_with("gaussian_process")) QTest::newRow(text.c_str()) << QString::fromStdString(text);
  }
  void heldOutPlacesLoseTheirPull() {
    QFETCH(QString, text);
    // The model without a place must not change when that place's truth does, the settings being the same.
    MethodText fixed = parseMethodText(text.toStdString()).value();
    fixed.given["smoothing"] = "0.01";
    if (fixed.id == "rbf") fixed.given["shape_mm"] = "300";
    const PositionMethod& row = *findPositionMethod(fixed.id).value();
    const Settings settings = settingsOf(row, fixed.given);
    FitData data = noisyWave(), moved = data;
    moved.p_true_m[33] += Eigen::Vector3d(0.1, 0.2, -0.1);
    const std::vector<std::size_t> out = {33};
    const auto before = row.hold_out(data, settings, {}).value()->without(out, Pose{});
    const auto after = row.hold_out(moved, settings, {}).value()->without(out, Pose{});
    FT_VERIFY_OK(before);
    FT_VERIFY_OK(after);
    for (const Eigen::Vector3d& p_m : randomPoints(50))
      FT_VERIFY_MATCH(near((*before)->displacement_m(p_m), (*after)->displacement_m(p_m), 1e-9));
  }

  void visitsOfAPlaceAreOnePlace_data() { addMethods(); }
  void visitsOfAPlaceAreOnePlace() {
    QFETCH(QString, text);
    const Method method(text);
    const FitData twice = withVisits();
    const auto model = method.fit(twice), expected = method.fit(noisyWave());
    FT_VERIFY_OK(model);
    FT_VERIFY_OK(expected);
    for (const Eigen::Vector3d& p_m : randomPoints(30))
      FT_VERIFY_MATCH(near((*model)->displacement_m(p_m), (*expected)->displacement_m(p_m), 1e-6));
    const auto fits = method.row->hold_out(twice, method.settings, {});
    FT_VERIFY_OK(fits);
    const std::vector<std::size_t> whole = {8, 9}, half = {8};
    FT_VERIFY_OK((*fits)->without(whole, Pose{}));
    const auto part = (*fits)->without(half, Pose{});
    QVERIFY(!part);
    QCOMPARE(part.error().code, ErrorCode::kUnsupported);
  }

  void recoversALinearFieldInAPlane_data() { addMethods(); }
  void recoversALinearFieldInAPlane() {
    QFETCH(QString, text);
    const Eigen::Matrix3d turn = rotationFromVector({0.4, -0.3, 0.2}).toRotationMatrix();
    std::vector<Eigen::Vector3d> p_m = shakenGrid({6, 6, 1}, 0.2, 0.02);
    for (Eigen::Vector3d& place_m : p_m) place_m = turn * Eigen::Vector3d(place_m.x(), place_m.y(), 0.3);
    FitData data = fitDataOf(p_m, linear_m);
    data.dimension = 2;
    const auto model = Method(text).fit(data);
    FT_VERIFY_OK(model);
    RandomGeometry random(9);
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector3d at_m = turn * Eigen::Vector3d(random.between(0, 2), random.between(-1, 1), 0.3);
      FT_VERIFY_MATCH(near((*model)->displacement_m(at_m), linear_m(at_m), 1e-9));
      // Off the plane nothing new is claimed.
      const Eigen::Vector3d off_m = at_m + 0.5 * turn.col(2);
      FT_VERIFY_MATCH(near((*model)->displacement_m(off_m), linear_m(at_m), 1e-9));
    }
    FT_VERIFY_MATCH(holdsAll((*model)->note(), {"plane"}));
  }

  void stopsOnRequest_data() { addMethods(); }
  void stopsOnRequest() {
    QFETCH(QString, text);
    std::stop_source source;
    source.request_stop();
    RunControl control;
    control.stop = source.get_token();
    const auto model = Method(text).fit(noisyWave(), control);
    QVERIFY(!model);
    QCOMPARE(model.error().code, ErrorCode::kCancelled);
  }

  void needsMorePlacesThanALinearFieldHasTerms_data() { addMethods(); }
  void needsMorePlacesThanALinearFieldHasTerms() {
    QFETCH(QString, text);
    const auto model = Method(text).fit(fitDataOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}}, linear_m));
    QVERIFY(!model);
    QCOMPARE(model.error().code, ErrorCode::kTooFewNodes);
    FT_VERIFY_MATCH(holdsAll(model.error().message, {"6", "5"}));
    // Three places lie in a plane, of which five would do; a fourth off it asks for six.
    FitData three = fitDataOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, linear_m);
    three.dimension = 2;
    const auto of_three = Method(text).fit(three);
    QVERIFY(!of_three);
    FT_VERIFY_MATCH(holdsAll(of_three.error().message, {"at least 6 places, or 5 that lie in one plane, got 3"}));
  }

  void noSmoothingPassesThroughEveryPlace_data() {
    QTest::addColumn<QString>("kernel");
    for (const char* kernel : {"multiquadric", "inverse_multiquadric", "cubic", "thin_plate"})
      QTest::newRow(kernel) << kernel;
  }
  void noSmoothingPassesThroughEveryPlace() {
    QFETCH(QString, kernel);
    const FitData data = noisyWave();
    const auto model =
        fitPosition("rbf", data, {{"kernel", kernel.toStdString()}, {"smoothing", "0"}, {"shape_mm", "150"}});
    FT_VERIFY_OK(model);
    for (std::size_t i = 0; i < data.size(); ++i)
      FT_VERIFY_MATCH(near(Eigen::Vector3d(data.p_tracked_m[i] + (*model)->displacement_m(data.p_tracked_m[i])),
                           data.p_true_m[i], 1e-9));
  }
};

FIELDTRUE_TEST(SmoothMethodsTest)
#include "smooth_methods_test.moc"
