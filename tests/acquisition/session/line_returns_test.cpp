#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>
#include <algorithm>
#include <functional>
#include <memory>

#include "acquisition/devices/fastrak_device.h"
#include "acquisition/devices/registry.h"
#include "acquisition/devices/trace_file.h"
#include "acquisition/emulators/fastrak_emulator.h"
#include "acquisition/session/acquisition_controller.h"
#include "tests/acquisition/devices/line_bench.h"
#include "tests/acquisition/devices/rated_line.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// A tracker that is lost in the middle of a take and comes back: it is connected again by itself and set as before,
/// and nothing of the take that failed gets into the next.
using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

constexpr int kBackWithin_ms = 60000;
constexpr int kReadings = 30;
const Pose kStandsAt{{-0.3, 0.2, 0.1}, Eigen::Quaterniond::Identity()};

/// Ten minutes at 60 Hz of a sensor that stands; no reading is that before, which some units would call a repeat.
SampleTable standing() {
  SampleTable table;
  for (int i = 0; i < 36000; ++i) {
    Pose pose = kStandsAt;
    pose.position_m.x() += 1e-4 * (7 * i % 5 - 2);
    table.rows.push_back({0, 0, {i / 60.0, 0, pose, {}}});
  }
  return table;
}

/// A unit that is switched off and on behind a line that stays: it forgets its settings, or says nothing for a while.
class PoweredUnit : public EmulatedTracker {
 public:
  using Make = std::function<std::unique_ptr<EmulatedTracker>()>;
  explicit PoweredUnit(Make make) : make_(std::move(make)), unit_(make_()) {}
  void restart() { unit_ = make_(); }
  bool mute = false;

  void receive(std::string_view bytes, double time_s, std::vector<EmulatedOutput>& out) override {
    if (!mute) unit_->receive(bytes, time_s, out);
  }
  bool tick(double time_s, std::vector<EmulatedOutput>& out, int most_cycles) override {
    std::vector<EmulatedOutput> lost;
    return unit_->tick(time_s, mute ? lost : out, most_cycles);
  }
  bool streaming() const override { return unit_->streaming(); }

 private:
  Make make_;
  std::unique_ptr<EmulatedTracker> unit_;
};

std::unique_ptr<EmulatedTracker> makeUnit() {
  FastrakEmulatorOptions options;
  options.reset_silence_s = 0.1;
  return std::make_unique<FastrakEmulatorCore>(std::make_unique<StandingSource>(std::vector{kStandsAt}), options);
}

FastrakSetup fastrakSetup() {
  FastrakSetup setup = quick(FastrakSetup{});
  setup.hemisphere = "-x";
  return setup;
}

/// A session of two places, and what its controller says.
struct Operator {
  explicit Operator(const QString& session) {
    QObject::connect(&controller, &AcquisitionController::deviceBack, [this] { ++n_back; });
    QObject::connect(&controller, &AcquisitionController::takeFailed, [this](const QString& text) { failed << text; });
    QObject::connect(&controller, &AcquisitionController::nodesStored,
                     [this](int, const std::vector<Node>& rows, const QString&) { nodes.push_back(rows.front()); });
    QObject::connect(&controller, &AcquisitionController::tablesReady,
                     [this](const CalibrationTable&, const SampleTable& all) { samples = all; });
    Plan plan;
    plan.counts = {2, 1, 1};
    controller.openSession(session, QString::fromStdString(toJson(plan).dump()));
    controller.setTakeLength({TakeLength::Until::kSamples, kReadings});
  }

  bool runs() const { return controller.status().device == DeviceState::kRunning && controller.status().live; }
  /// In the middle of a take the tracker is lost.
  void loseIt(const std::function<void()>& lose) {
    controller.take();
    QTRY_VERIFY(controller.status().collected >= 5);
    last_s = controller.status().live->time_s;
    lose();
    QTRY_VERIFY_WITH_TIMEOUT(controller.status().reconnecting, 10000);
    QCOMPARE(failed.size(), 1);
    QVERIFY2(failed[0].contains("the tracker was lost"), qPrintable(failed[0]));
  }
  /// It is back, and the place is taken as if nothing had been.
  void takeAgain() {
    QTRY_COMPARE_WITH_TIMEOUT(n_back, 1, kBackWithin_ms);
    QVERIFY(controller.status().just_returned && !controller.status().reconnecting);
    QTRY_VERIFY_WITH_TIMEOUT(runs(), kBackWithin_ms);
    controller.take();
    QTRY_COMPARE_WITH_TIMEOUT(nodes.size(), std::size_t{1}, kBackWithin_ms);
    QCOMPARE(nodes[0].n_used, kReadings);
    FT_VERIFY_MATCH(near(nodes[0].tracker_from_sensor, kStandsAt, 1e-3, 2e-3));
    controller.requestTables();
    std::size_t before = 0;
    for (const SampleRow& row : samples.rows) {
      before += row.sample.time_s <= last_s ? 1 : 0;
      if (row.node >= 0) QVERIFY2(row.sample.time_s > last_s, "a reading of the failed take is in the next");
    }
    QVERIFY2(before >= 5, "the failed take's readings are kept beside");
  }

  AcquisitionController controller;
  int n_back = 0;
  QStringList failed;
  std::vector<Node> nodes;
  SampleTable samples;
  double last_s = 0.0;
};

}  // namespace

class LineReturnsTest : public QObject {
  Q_OBJECT
 private slots:
  void everyTrackerComesBack_data();
  void everyTrackerComesBack();
  void switchedOffAndOn();
  void silentForAWhile();
  void atAnotherSpeed();
  void nothingIsTriedAfterDisconnecting();
  void aTraceBreaksWhereTheTrackerWasLost();

 private:
  QString newPath() { return folder_.filePath(QString("%1.fieldtrue").arg(++n_paths_)); }
  /// A Fastrak behind a pty, and its driver.
  void behindAPty(Operator& person, PoweredUnit*& unit) {
    auto made = std::make_unique<PoweredUnit>(makeUnit);
    unit = made.get();
    const QString link = folder_.filePath("powered");
    emulator_ = std::make_unique<EmulatorRunner>(std::move(made), std::make_unique<PtyEndpoint>(link));
    FT_VERIFY_OK(emulator_->start());
    person.controller.adoptDevice(
        makeLineDevice<FastrakStartup>(fastrakSetup(), [link] { return makeTransport(link.toStdString()); }));
    QTRY_VERIFY_WITH_TIMEOUT(person.runs(), kBackWithin_ms);
  }
  std::unique_ptr<EmulatorRunner> emulator_;
  QTemporaryDir folder_;
  int n_paths_ = 0;
};

void LineReturnsTest::everyTrackerComesBack_data() {
  QTest::addColumn<QByteArray>("kind");
  QTest::addColumn<bool>("is_tcp");
  for (const DeviceKind& kind : deviceKinds()) {
    if (!kind.emulate) continue;
    QTest::addRow("%s, tcp", kind.id.c_str()) << QByteArray::fromStdString(kind.id) << true;
    if (kind.usual_addresses.empty())
      QTest::addRow("%s, pty", kind.id.c_str()) << QByteArray::fromStdString(kind.id) << false;
  }
}

void LineReturnsTest::everyTrackerComesBack() {
  QFETCH(QByteArray, kind);
  QFETCH(bool, is_tcp);
  const DeviceKind* row = *findEmulated(kind.toStdString());
  Emulation emulation;
  emulation.replay = standing();
  if (is_tcp)
    emulation.tcp_port = 0;
  else
    emulation.pty_link = folder_.filePath(QString::fromLatin1(kind)).toStdString();
  emulator_ = *row->emulate(emulation);
  FT_VERIFY_OK(emulator_->start());
  const QString address = emulator_->endpoint().address();
  if (is_tcp) emulation.tcp_port = address.section(QLatin1Char(':'), -1).toInt();

  Operator person(newPath());
  person.controller.connectDevice(QString::fromLatin1(kind) + QLatin1Char(':') + address, {});
  QTRY_VERIFY2_WITH_TIMEOUT(person.runs(), qPrintable(person.controller.status().device_text), kBackWithin_ms);
  person.loseIt([this] { emulator_.reset(); });
  if (QTest::currentTestFailed()) return;
  emulator_ = *row->emulate(emulation);
  FT_VERIFY_OK(emulator_->start());
  person.takeAgain();
}

void LineReturnsTest::switchedOffAndOn() {
  Operator person(newPath());
  PoweredUnit* unit = nullptr;
  behindAPty(person, unit);
  // As it is switched on, a Fastrak sends nothing, in inches, and takes its sensor to be on the side +x.
  person.loseIt([unit] { unit->restart(); });
  if (QTest::currentTestFailed()) return;
  person.takeAgain();
}

void LineReturnsTest::silentForAWhile() {
  Operator person(newPath());
  PoweredUnit* unit = nullptr;
  behindAPty(person, unit);
  person.loseIt([unit] { unit->mute = true; });
  if (QTest::currentTestFailed()) return;
  QVERIFY2(person.controller.status().device_text.contains("gone silent"),
           qPrintable(person.controller.status().device_text));
  const QString said = person.controller.status().device_text;
  QTest::qWait(3000);
  QCOMPARE(person.controller.status().device_text, said);
  QCOMPARE(person.n_back, 0);
  unit->mute = false;
  person.takeAgain();
}

void LineReturnsTest::atAnotherSpeed() {
  int right_baud = 115200;
  FastrakSetup setup = fastrakSetup();
  setup.timings.reply_ms = 100;
  auto device = makeLineDevice<FastrakStartup>(setup, [&]() -> Result<std::unique_ptr<Transport>> {
    auto ends = LoopbackTransport::pair();
    emulator_ =
        std::make_unique<EmulatorRunner>(makeUnit(), std::make_unique<LoopbackEndpoint>(std::move(ends.second)));
    FT_TRY_VOID(emulator_->start());
    return std::make_unique<RatedLine>(std::move(ends.first), right_baud, 115200);
  });
  Operator person(newPath());
  person.controller.adoptDevice(std::move(device));
  QTRY_VERIFY_WITH_TIMEOUT(person.runs(), kBackWithin_ms);
  right_baud = 19200;
  std::vector<EmulatedOutput> none;
  person.loseIt([&] { emulator_->tracker().receive("c", emulator_->time_s(), none); });
  if (QTest::currentTestFailed()) return;
  person.takeAgain();
  FT_VERIFY_MATCH(holdsAll(person.controller.status().device_text.toStdString(), {"found at 19200 baud"}));
}

void LineReturnsTest::nothingIsTriedAfterDisconnecting() {
  Operator person(newPath());
  PoweredUnit* unit = nullptr;
  behindAPty(person, unit);
  person.loseIt([unit] { unit->mute = true; });
  if (QTest::currentTestFailed()) return;
  QVERIFY(person.controller.status().has_trace);
  person.controller.disconnectDevice();
  QVERIFY(!person.controller.status().reconnecting);
  QVERIFY2(person.controller.status().has_trace, "what went over the line can still be saved");
  unit->mute = false;
  QSignalSpy heard(emulator_.get(), &EmulatorRunner::bytesFromHost);
  QTest::qWait(2500);
  QVERIFY(person.controller.status().device == DeviceState::kClosed);
  QCOMPARE(person.n_back, 0);
  QVERIFY2(heard.isEmpty(), "the line is left alone");
}

void LineReturnsTest::aTraceBreaksWhereTheTrackerWasLost() {
  const std::string file = folder_.filePath("lost.trace.zip").toStdString();
  {
    Operator person(newPath());
    PoweredUnit* unit = nullptr;
    behindAPty(person, unit);
    QTest::qWait(3000);  // So much of it is played before the break: a take can begin meanwhile on a busy machine too.
    person.loseIt([unit] { unit->restart(); });
    if (QTest::currentTestFailed()) return;
    person.takeAgain();
    if (QTest::currentTestFailed()) return;
    const auto trace = person.controller.trace();
    QVERIFY(trace && trace->streams.size() == 2);
    FT_VERIFY_OK(writeTrace(file, *trace));
  }
  Operator person(newPath());
  person.controller.connectDevice(QString::fromStdString("trace:" + file), {});
  QTRY_VERIFY_WITH_TIMEOUT(person.runs(), kBackWithin_ms);
  // A take longer than what came before the loss does not reach beyond it.
  person.controller.setTakeLength({TakeLength::Until::kSamples, 100000});
  person.controller.take();
  QTRY_COMPARE_WITH_TIMEOUT(person.failed.size(), 1, kBackWithin_ms);
  QVERIFY2(person.failed[0].contains("Here the tracker was lost"), qPrintable(person.failed[0]));
  QVERIFY(person.controller.status().reconnecting);
  QTRY_COMPARE_WITH_TIMEOUT(person.n_back, 1, kBackWithin_ms);
  QTRY_VERIFY_WITH_TIMEOUT(person.controller.status().device == DeviceState::kClosed, kBackWithin_ms);
  person.controller.requestTables();
  const auto& rows = person.samples.rows;
  const auto cancelled = [](const SampleRow& row) { return row.sample.status.starts_with("cancelled"); };
  const auto after = std::find_if_not(std::find_if(rows.begin(), rows.end(), cancelled), rows.end(), cancelled);
  QVERIFY(after != rows.begin() && after != rows.end());
  QVERIFY2(after->sample.time_s - std::prev(after)->sample.time_s >= 1.0, "the clock goes on behind what was read");
}

FIELDTRUE_TEST(LineReturnsTest)
#include "line_returns_test.moc"
