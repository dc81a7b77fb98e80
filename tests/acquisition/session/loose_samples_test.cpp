#include <QFileInfo>
#include <QTest>
#include <map>

#include "acquisition/session/loose_readings.h"
#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "tests/acquisition/session/controller_bench.h"
#include "tests/acquisition/session/session_folder.h"
#include "tests/acquisition/session/session_samples.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using testing::Bench;
using testing::fullMetadata;
using testing::kRate_hz;
using testing::sameSamples;
using testing::smallPlan;
using testing::storeTake;

/// Readings that belong to no stored take: between the places, of failed, cancelled and restarted takes.
class LooseSamplesTest : public QObject {
  Q_OBJECT

  testing::SessionFolder folder_;

  static std::map<std::string, int> countByStatus(const SampleTable& samples) {
    std::map<std::string, int> counts;
    for (const SampleRow& row : samples.rows) {
      if (row.node < 0) ++counts[row.sample.status];
    }
    return counts;
  }

  /// Readings as a tracker gives them: no two values share their digits.
  static Sample readingAt(double time_s) {
    Sample sample;
    sample.time_s = time_s;
    sample.tracker_from_sensor.position_m = {std::sin(time_s), std::cos(1.1 * time_s), std::sin(1.3 * time_s)};
    sample.tracker_from_sensor.orientation = rotationFromVector({std::sin(time_s), 0.2, std::cos(time_s)});
    return sample;
  }

 private slots:
  void betweenThePlacesTenASecond() {
    Bench bench(folder_.newPath());
    bench.tracker->stand(6.0);
    bench.readTables();
    const auto counts = countByStatus(bench.samples);
    QCOMPARE(counts.size(), std::size_t{1});
    QVERIFY2(counts.begin()->first.empty(), "the status is the tracker's own");
    QCOMPARE(counts.begin()->second, 60);
    bench.tracker->stand(1.0, "k");
    bench.readTables();
    QCOMPARE(countByStatus(bench.samples).at("k"), 10);
  }

  void whateverTheRateAtMostTen_data() {
    QTest::addColumn<double>("rate_hz");
    QTest::addColumn<int>("kept");  // In 20 s.
    QTest::newRow("240") << 240.0 << 200;
    QTest::newRow("25") << 25.0 << 200;
    QTest::newRow("10") << 10.0 << 200;
    QTest::newRow("4") << 4.0 << 80;
  }
  void whateverTheRateAtMostTen() {
    QFETCH(double, rate_hz);
    QFETCH(int, kept);
    LooseReadings loose;
    int n = 0;
    for (int i = 0; i < 20.0 * rate_hz; ++i) n += static_cast<int>(loose.between(readingAt(i / rate_hz)).size());
    QCOMPARE(n, kept);
  }

  void cancelledTakesAreKeptWhole() {
    const QString path = folder_.newPath();
    {
      Bench bench(path);
      bench.takeHere();
      bench.controller.take();
      bench.tracker->stand(0.25);
      bench.controller.cancelTake();
      bench.controller.take();
      bench.tracker->stand(0.1, "k");
      bench.controller.skip();
      bench.readTables();
      const int node = bench.controller.status().session->places[1].node;
      const auto counts = countByStatus(bench.samples);
      QCOMPARE(counts.at("cancelled:" + std::to_string(node)), 30 + 12);
    }
    const auto store = SessionStore::open(path);
    FT_VERIFY_OK(store);
    const SampleTable all = store->sampleTable().value();
    QCOMPARE(countByStatus(all).at("cancelled:" + std::to_string(store->places()[1].node)), 30 + 12);
    QCOMPARE(store->nodeTable().value().nodes.size(), std::size_t{1});
    // The table as a file: written, read, and every loose row at node -1.
    const std::filesystem::path file(folder_.filePath("all.samples.csv").toStdString());
    FT_VERIFY_OK(writeSampleTable(file, all));
    const auto read = readSampleTable(file);
    FT_VERIFY_OK(read);
    QCOMPARE(read->table.rows.size(), all.rows.size());
    QVERIFY(countByStatus(read->table) == countByStatus(all));
  }

  void failedAndRestartedTakesAreKept() {
    Bench bench(folder_.newPath());
    bench.tracker->true_pose = bench.placePose(0);
    bench.tracker->stand(0.6);
    bench.controller.take();
    bench.tracker->stand(0.25);
    bench.tracker->lose();
    bench.tracker->comeBack();
    bench.readTables();
    const std::string status = "cancelled:" + std::to_string(bench.controller.status().session->places[0].node);
    QCOMPARE(countByStatus(bench.samples).at(status), 30);
    // A take that starts over because it was moved: what came before is kept, the rest is the take.
    bench.tracker->stand(0.6);
    bench.controller.take();
    bench.tracker->stand(0.25);
    bench.tracker->true_pose.position_m.x() += 0.05;
    bench.tracker->stand(1.2);
    QCOMPARE(bench.stored, std::vector<int>{0});
    bench.readTables();
    QVERIFY(countByStatus(bench.samples).at(status) >= 30 + 30);
    QCOMPARE(bench.readingsAtPlaces(), std::size_t(bench.nodes[0].n_used + bench.nodes[0].n_rejected));
  }

  /// In batches: between two writes of the file many readings come together, and closing leaves none behind.
  void theyAreWrittenTogether() {
    const QString path = folder_.newPath();
    {
      auto store = SessionStore::create(path, smallPlan(), fullMetadata());
      FT_VERIFY_OK(store);
      int n_writes = 0;
      QByteArray before;
      for (int i = 0; i < 300; ++i) {  // 30 s
        FT_VERIFY_OK(store->keepLoose({{readingAt(0.1 * i), {}}}));
        QFile wal(path + "-wal");
        const qint64 size = wal.size();
        if (QByteArray::number(size) != before) ++n_writes;
        before = QByteArray::number(size);
      }
      QVERIFY2(n_writes >= 4 && n_writes <= 8, qPrintable(QString("%1 writes").arg(n_writes)));
      QCOMPARE(store->sampleTable().value().rows.size(), std::size_t{300});
      QCOMPARE(*store->newestSample_s().value(), 29.9);
    }
    const auto store = SessionStore::open(path);
    FT_VERIFY_OK(store);
    const SampleTable all = store->sampleTable().value();
    QCOMPARE(all.rows.size(), std::size_t{300});
    QVERIFY(sameSamples({all.rows[123].sample}, {readingAt(0.1 * 123)}));
  }

  void aTakeBringsThemAlong() {
    const QString path = folder_.newPath();
    const QString copy = folder_.newPath();
    auto store = SessionStore::create(path, smallPlan(), fullMetadata());
    FT_VERIFY_OK(store);
    FT_VERIFY_OK(store->keepLoose({{readingAt(0.5), 7}}));
    FT_VERIFY_OK(storeTake(*store, 0, 1));
    QVERIFY(QFile::copy(path, copy) && QFile::copy(path + "-wal", copy + "-wal"));
    const auto copied = SessionStore::open(copy);
    FT_VERIFY_OK(copied);
    const SampleTable all = copied->sampleTable().value();
    QCOMPARE(all.rows.back().node, -1);
    QCOMPARE(all.rows.back().sample.status, std::string("cancelled:7"));
  }

  /// Eight hours at 120 Hz, every second take failing: under 200 MB. Here a fortieth of it, 12 minutes; the share of a
  /// day that is the same for all sizes is what one row takes.
  void aDayIsSmall() {
    const double part = 1.0 / 40.0, day_s = 8.0 * 3600.0;
    const QString path = folder_.newPath();
    {
      auto store = SessionStore::create(path, smallPlan(), fullMetadata());
      FT_VERIFY_OK(store);
      LooseReadings loose;
      // Of each 60 s: 30 s between places, 30 s of a take that fails at its time limit.
      std::vector<Sample> take;
      for (int i = 0; i < part * day_s * kRate_hz; ++i) {
        const Sample sample = readingAt(i / kRate_hz);
        const bool collecting = std::fmod(sample.time_s, 60.0) >= 30.0;
        if (collecting) {
          take.push_back(sample);
        } else {
          if (!take.empty()) FT_VERIFY_OK(store->keepLoose(loose.cancelled(5, take)));
          take.clear();
          FT_VERIFY_OK(store->keepLoose(loose.between(sample)));
        }
      }
      FT_VERIFY_OK(store->keepLoose(loose.cancelled(5, take)));
      const auto counts = countByStatus(store->sampleTable().value());
      QCOMPARE(counts.at(""), static_cast<int>(part * day_s * 0.5 * 10.0));
      QCOMPARE(counts.at("cancelled:5"), static_cast<int>(part * day_s * 0.5 * kRate_hz));
    }
    const double bytes_a_row = static_cast<double>(QFileInfo(path).size()) / (part * day_s * 0.5 * (10.0 + kRate_hz));
    // The whole day: all of it between places, or a million readings of failed takes before they are thinned too.
    const double day_MB = bytes_a_row * (day_s * 10.0 + 1e6) / 1e6;
    QVERIFY2(day_MB < 200.0, qPrintable(QString("%1 MB a day, %2 bytes a reading").arg(day_MB).arg(bytes_a_row)));
    qInfo("%.1f bytes a reading; at most %.0f MB in 8 h, %.0f MB when no take fails", bytes_a_row, day_MB,
          bytes_a_row * day_s * 10.0 / 1e6);
  }

  void aMillionOfFailedTakesThenTen() {
    LooseReadings loose;
    std::vector<Sample> minute;
    for (int i = 0; i < 60 * 120; ++i) minute.push_back(readingAt(i / 120.0));
    std::size_t n = 0;
    for (int k = 0; k < 200; ++k) {
      for (Sample& sample : minute) sample.time_s += 60.0;
      n += loose.cancelled(1, minute).size();
    }
    // 138 whole minutes and 6400 readings make the million; from then on 10 a second.
    QVERIFY2(n >= 1'000'000 && n <= 1'000'000 + 62 * 600, qPrintable(QString::number(n)));
  }
};

FIELDTRUE_TEST(LooseSamplesTest)
#include "loose_samples_test.moc"
