#include <QTest>
#include <algorithm>
#include <cmath>

#include "calib/correctors/base/method.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

/// Settings for this test. Settings chosen from the data stay as all rows chose them, and a refit would choose anew:
/// every automatic number is given here, or by explicitValue where a method is not listed.
const std::map<std::string, std::map<std::string, std::string>> kGiven = {
    {"polynomial", {{"degree", "3"}}},
    {"tetrahedral", {{"split", "delaunay"}}},
};

/// What a method may differ by that takes more from all rows than a setting can give: a tenth of the noise, while a
/// place that was not left out at all shows by several tenths. Its own test holds it to the refit with that frozen.
const std::map<std::string, double> kFrozenTolerance_m = {
    {"gaussian_process", 1e-4},  // Length scales and noise, by likelihood.
    {"bspline", 1e-4},           // Where the lattice lies.
};

double tolerance_m(const std::string& id) {
  const auto found = kFrozenTolerance_m.find(id);
  return found == kFrozenTolerance_m.end() ? 1e-9 : found->second;
}

/// A number in the middle of a setting's range.
std::string explicitValue(const Setting& setting) {
  const double middle = setting.min > 0.0 ? std::sqrt(setting.min * setting.max) : 0.5 * (setting.min + setting.max);
  return std::to_string(setting.whole ? std::round(middle) : middle);
}

template <class Model>
Settings explicitSettings(const CorrectionMethod<Model>& method) {
  std::map<std::string, std::string> given;
  if (const auto found = kGiven.find(method.id); found != kGiven.end()) given = found->second;
  for (const Setting& setting : method.settings) {
    const std::string* text = std::get_if<std::string>(&setting.default_value);
    if (setting.type == SettingType::kAutoNumber && text != nullptr && !given.contains(setting.key))
      given[setting.key] = explicitValue(setting);
  }
  return settingsOf(method, given);
}

Eigen::Vector3d bent_m(const Eigen::Vector3d& p) {
  return {0.02 * std::sin(2.0 * p.x() + p.y()), 0.03 * p.x() * p.z(), 0.01 * std::cos(3.0 * p.y()) - 0.02 * p.x()};
}

Eigen::Quaterniond turned(const Eigen::Vector3d& p) {
  return rotationFromVector(0.1 * Eigen::Vector3d(std::sin(p.x()), p.y(), std::cos(p.z())));
}

/// Places of a shaken grid, every third visited twice, every fifth three times, each reading with noise.
FitData visitedData() {
  FitData data = fitDataOf(shakenGrid({5, 5, 4}, 0.2, 0.02), bent_m, turned, rotationFromVector({0.3, 0.1, -0.4}));
  const std::size_t n_places = data.size();
  for (std::size_t place = 0; place < n_places; ++place)
    for (std::size_t visit = 1; visit < (place % 5 == 0 ? 3u : place % 3 == 0 ? 2u : 1u); ++visit) {
      data.p_tracked_m.push_back(data.p_tracked_m[place]);
      data.p_true_m.push_back(data.p_true_m[place]);
      data.q_tracked.push_back(data.q_tracked[place]);
      data.q_true.push_back(data.q_true[place]);
      data.node.push_back(data.node[place]);
      if (!data.index.empty()) data.index.push_back(data.index[place]);
    }
  std::mt19937_64 generator(11);
  std::normal_distribution<double> noise(0.0, 0.001);
  for (std::size_t row = 0; row < data.size(); ++row) {
    data.p_tracked_m[row] += Eigen::Vector3d(noise(generator), noise(generator), noise(generator));
    data.q_tracked[row] =
        rotationFromVector({noise(generator), noise(generator), noise(generator)}) * data.q_tracked[row];
    data.noise_m2.push_back(1e-6 * Eigen::Vector3d(1.0, 1.5, 2.0).asDiagonal().toDenseMatrix());
  }
  data.jig_sd_m = 0.001;
  return data;
}

/// All rows of some places, ascending.
std::vector<std::size_t> rowsOfPlaces(const FitData& data, const std::vector<int>& places) {
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < data.size(); ++row)
    if (std::count(places.begin(), places.end(), data.node[row]) > 0) rows.push_back(row);
  return rows;
}

/// The data without rows, its truth moved: what a fit to the fold alone would see.
FitData withoutRows(const FitData& data, const std::vector<std::size_t>& rows, const Pose& fold_from_data) {
  FitData rest;
  rest.jig_sd_m = data.jig_sd_m;
  rest.dimension = data.dimension;
  for (std::size_t row = 0; row < data.size(); ++row) {
    if (std::binary_search(rows.begin(), rows.end(), row)) continue;
    rest.p_tracked_m.push_back(data.p_tracked_m[row]);
    rest.p_true_m.push_back(fold_from_data * data.p_true_m[row]);
    rest.q_tracked.push_back(data.q_tracked[row]);
    rest.q_true.push_back(fold_from_data.orientation * data.q_true[row]);
    rest.node.push_back(data.node[row]);
    if (!data.index.empty()) rest.index.push_back(data.index[row]);
    rest.noise_m2.push_back(data.noise_m2[row]);
  }
  return rest;
}

/// One place with one row, one with three, several places of all kinds, a fifth of all; the alignment of a fold moves
/// its truth by millimetres and milliradians, and once by much more.
struct Fold {
  std::vector<int> places;
  Pose fold_from_data;
};

std::vector<Fold> folds() {
  const Pose small{{0.003, -0.002, 0.001}, rotationFromVector({0.004, 0.002, -0.003})};
  const Pose large{{0.3, -0.2, 0.1}, rotationFromVector({0.4, -0.8, 0.3})};
  std::vector<int> fifth;
  for (int place = 2; place < 100; place += 5) fifth.push_back(place);
  std::vector<Fold> all = {{{7}, Pose{}},  {{44}, small},   {{50}, small}, {{3, 4, 30, 31, 77}, small},
                           {fifth, small}, {{0, 99}, large}};
  std::mt19937_64 generator(23);
  for (int i = 0; i < 4; ++i) {
    std::vector<int> some;
    for (int place = 0; place < 100; ++place)
      if (generator() % 12 == 0) some.push_back(place);
    all.push_back({some, small});
  }
  return all;
}

std::vector<Eigen::Vector3d> insidePoints() {
  std::vector<Eigen::Vector3d> points_m = shakenGrid({5, 5, 4}, 0.18, 0.02, 99);
  for (Eigen::Vector3d& p_m : points_m) p_m += Eigen::Vector3d::Constant(0.03);
  return points_m;
}

}  // namespace

/// The contract of every method that can leave rows out in closed form: the same as fitting the rest anew.
class HoldOutTest : public QObject {
  Q_OBJECT
 private slots:
  void positionsEqualTheRefit_data() {
    QTest::addColumn<QString>("id");
    for (const PositionMethod& method : positionMethods())
      if (method.hold_out != nullptr) QTest::newRow(method.id.c_str()) << QString::fromStdString(method.id);
  }
  void positionsEqualTheRefit() {
    QFETCH(QString, id);
    const PositionMethod& method = *findPositionMethod(id.toStdString()).value();
    const Settings settings = explicitSettings(method);
    const FitData data = visitedData();
    const auto fits = method.hold_out(data, settings, {});
    FT_VERIFY_OK(fits);
    for (const Fold& fold : folds()) {
      const std::vector<std::size_t> rows = rowsOfPlaces(data, fold.places);
      const auto held_out = (*fits)->without(rows, fold.fold_from_data);
      const auto refitted = method.fit(withoutRows(data, rows, fold.fold_from_data), settings, {});
      FT_VERIFY_OK(held_out);
      FT_VERIFY_OK(refitted);
      std::vector<Eigen::Vector3d> points_m = insidePoints();
      for (const std::size_t row : rows) points_m.push_back(data.p_tracked_m[row]);
      for (const Eigen::Vector3d& p_m : points_m) {
        QCOMPARE((*held_out)->covers(p_m), (*refitted)->covers(p_m));
        if (!(*refitted)->covers(p_m)) continue;
        FT_VERIFY_MATCH(
            near((*held_out)->displacement_m(p_m), (*refitted)->displacement_m(p_m), tolerance_m(method.id)));
        const auto seen_m = (*held_out)->uncertainty_m(p_m);
        const auto expected_m = (*refitted)->uncertainty_m(p_m);
        QCOMPARE(seen_m.has_value(), expected_m.has_value());
        if (seen_m) FT_VERIFY_MATCH(near(*seen_m, *expected_m, tolerance_m(method.id)));
      }
    }
  }

  void orientationsEqualTheRefit() {
    const FitData data = visitedData();
    const Eigen::Quaterniond q_tracked = rotationFromVector({0.7, -0.3, 0.2});
    for (const OrientationMethod& method : orientationMethods()) {
      if (method.hold_out == nullptr) continue;
      const Settings settings = explicitSettings(method);
      const auto fits = method.hold_out(data, settings, {});
      FT_VERIFY_OK(fits);
      for (const Fold& fold : folds()) {
        const std::vector<std::size_t> rows = rowsOfPlaces(data, fold.places);
        const auto held_out = (*fits)->without(rows, fold.fold_from_data);
        const auto refitted = method.fit(withoutRows(data, rows, fold.fold_from_data), settings, {});
        FT_VERIFY_OK(held_out);
        FT_VERIFY_OK(refitted);
        for (const Eigen::Vector3d& p_m : insidePoints())
          FT_VERIFY_MATCH(near((*held_out)->correct(p_m, q_tracked), (*refitted)->correct(p_m, q_tracked), 1e-9));
      }
    }
  }

  void leavingOutAlmostEverythingIsRefusedAsTheRefitIs_data() { positionsEqualTheRefit_data(); }
  void leavingOutAlmostEverythingIsRefusedAsTheRefitIs() {
    QFETCH(QString, id);
    const PositionMethod& method = *findPositionMethod(id.toStdString()).value();
    const Settings settings = explicitSettings(method);
    const FitData data = visitedData();
    const auto fits = method.hold_out(data, settings, {});
    FT_VERIFY_OK(fits);
    std::vector<int> all_but_one;
    for (int place = 1; place < 100; ++place) all_but_one.push_back(place);
    const std::vector<std::size_t> rows = rowsOfPlaces(data, all_but_one);
    const auto held_out = (*fits)->without(rows, Pose{});
    if (id == "none") {
      FT_VERIFY_OK(held_out);
      return;
    }
    QVERIFY(!held_out);
    QVERIFY(held_out.error().code == ErrorCode::kTooFewNodes || held_out.error().code == ErrorCode::kDegenerate);
  }

  void aPlaceThatAloneDeterminesATermCannotBeLeftOut() {
    // Eight corners of a cube and one place above: without it z^2 is nothing but z.
    std::vector<Eigen::Vector3d> places_m = shakenGrid({3, 3, 2}, 0.2, 0.0);
    places_m.emplace_back(0.61, -0.08, 0.4);
    const FitData data = fitDataOf(places_m, bent_m);
    const PositionMethod& method = *findPositionMethod("polynomial").value();
    const Settings settings = settingsOf(method, {{"degree", "2"}});
    const auto fits = method.hold_out(data, settings, {});
    FT_VERIFY_OK(fits);
    const std::vector<std::size_t> the_one{places_m.size() - 1};
    const auto without_it = (*fits)->without(the_one, Pose{});
    QVERIFY(!without_it);
    QCOMPARE(without_it.error().code, ErrorCode::kDegenerate);
    const std::vector<std::size_t> another{4};
    FT_VERIFY_OK((*fits)->without(another, Pose{}));
  }
};

FIELDTRUE_TEST(HoldOutTest)
#include "hold_out_test.moc"
