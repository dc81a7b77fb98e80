#include "calib/recording/own_samples.h"

#include <QTest>

#include "tests/calib/gap/gap_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::recording;
using namespace fieldtrue::testing;

namespace {

struct Recorded {
  CalibrationTable table;
  SampleTable samples;
};

Recorded recorded() {
  Recorded made;
  made.table = recordedIn(gapScene(), gapPlan({.counts = {3, 3, 3}}), 1, &made.samples);
  return made;
}

/// Changes the readings of the places from `first` on.
template <class Change>
void changeFrom(int first, SampleTable& samples, Change change) {
  for (SampleRow& row : samples.rows)
    if (row.node >= first) change(row);
}

void moveAside(SampleRow& row) { row.sample.tracker_from_sensor.position_m.x() += 0.25; }
void renumber(SampleRow& row) { row.node += 500; }

}  // namespace

/// Whether readings are those of the table they are given with.
class OwnSamplesTest : public QObject {
  Q_OBJECT
 private slots:
  void readingsOfTheTableAreTaken() {
    const Recorded made = recorded();
    const auto found = foreignSamples(made.samples, made.table);
    FT_VERIFY_OK(found);
    QVERIFY(!found->has_value());
    QVERIFY(!foreignSamples({}, made.table).value().has_value());
  }

  void readingsOfASensorThatWasLeftOutAreTaken() {
    Recorded made = recorded();
    const std::vector<SampleRow> own = made.samples.rows;
    for (SampleRow row : own) {
      row.sample.sensor = 1;
      moveAside(row);
      made.samples.rows.push_back(row);
    }
    QVERIFY(!foreignSamples(made.samples, made.table).value().has_value());
  }

  void readingsOfAnotherRecordingAreRefused_data() {
    QTest::addColumn<int>("kind");
    QTest::addColumn<QByteArray>("told");
    QTest::newRow("elsewhere") << 0 << QByteArray("at 27 of 27 places the mean of the samples lies off");
    QTest::newRow("other places") << 1 << QByteArray("27 of 27 places have samples but no row");
    QTest::newRow("another sensor") << 2 << QByteArray("27 of 27 places have samples but no row");
  }
  void readingsOfAnotherRecordingAreRefused() {
    QFETCH(int, kind);
    QFETCH(QByteArray, told);
    Recorded made = recorded();
    changeFrom(0, made.samples, [kind](SampleRow& row) {
      if (kind == 0) moveAside(row);
      if (kind == 1) renumber(row);
      if (kind == 2) row.sample.sensor = 3;
    });
    const auto found = foreignSamples(made.samples, made.table);
    QVERIFY(!found && found.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(found.error().message, {"The samples are not those of this table", told}));
  }

  void samplesOfTheWholeMayComeWithAPart() {
    Recorded made = recorded();
    made.table.nodes.resize(5);
    const auto found = foreignSamples(made.samples, made.table);
    FT_VERIFY_OK(found);
    QVERIFY(found->has_value());
    FT_VERIFY_MATCH(holdsAll((*found)->text, {"22 of 27 places have samples but no row"}));
  }

  void someThatDoNotFitAreNamed() {
    Recorded made = recorded();
    changeFrom(26, made.samples, renumber);
    changeFrom(24, made.samples, [](SampleRow& row) {
      if (row.node < 500) moveAside(row);
    });
    const auto found = foreignSamples(made.samples, made.table);
    FT_VERIFY_OK(found);
    QVERIFY(found->has_value());
    QVERIFY((*found)->nodes == (std::vector<int>{24, 25, 526}));
    FT_VERIFY_MATCH(holdsAll(
        (*found)->text, {"P526", "1 of 27 places has samples but no row", "at 2 of 27 places the mean", "up to 25"}));
  }
};

FIELDTRUE_TEST(OwnSamplesTest)
#include "own_samples_test.moc"
