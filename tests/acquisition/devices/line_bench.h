#pragma once

#include <QTemporaryDir>
#include <QTest>
#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "acquisition/devices/line_device.h"
#include "acquisition/emulators/emulated_unit.h"
#include "acquisition/emulators/pty_endpoint.h"
#include "calib/core/statistics.h"
#include "tests/acquisition/devices/device_probe.h"
#include "tests/support/matchers.h"

namespace fieldtrue::testing {

/// An emulated tracker on one of the carriers, with the device that drives it.
struct LineBench {
  std::unique_ptr<QTemporaryDir> folder = std::make_unique<QTemporaryDir>();
  std::unique_ptr<acquisition::EmulatorRunner> emulator;
  std::unique_ptr<acquisition::LineDevice> device;
  std::unique_ptr<DeviceProbe> probe;
};

inline void addCarriers() {
  QTest::addColumn<QByteArray>("carrier");
  for (const char* carrier : {"in process", "pty", "tcp"}) QTest::newRow(carrier) << QByteArray(carrier);
}

/// Waits that suit a program that answers at once.
inline acquisition::LineTimings quickTimings() {
  acquisition::LineTimings timings;
  timings.settle_ms = 20;
  timings.clear_ms = 5;
  timings.command_ms = 1;
  timings.quiet_ms = 20;
  timings.drain_most_ms = 300;
  timings.reply_ms = 800;
  timings.reset_ms = 300;
  timings.lock_ms = 1000;
  timings.silence_ms = 750;
  timings.stop_quiet_ms = 30;
  return timings;
}

/// A setup for a tracker that answers at once.
template <class Setup>
Setup quick(Setup setup, const QString& where = "the line") {
  setup.where = where.toStdString();
  setup.device_text = setup.id + ":" + where.toStdString();
  setup.timings = quickTimings();
  return setup;
}

/// @param carrier "in process", "pty" or "tcp"
/// @param clock the tracker's, or its speed
template <class Unit, class Startup, class Options, class Setup>
LineBench makeLineBench(const QByteArray& carrier, std::unique_ptr<acquisition::PoseSource> source,
                        const Options& options, const Setup& setup, const acquisition::TrackerClock& clock = {}) {
  using namespace acquisition;
  LineBench bench;
  LineDevice::TransportFactory make_line;
  if (carrier == "in process") {
    auto ends = LoopbackTransport::pair();
    bench.emulator = emulatorOnLine<Unit>(std::move(source), std::move(ends.second), options, clock);
    auto host = std::make_shared<std::unique_ptr<Transport>>(std::move(ends.first));
    make_line = [host]() -> Result<std::unique_ptr<Transport>> { return std::move(*host); };
  } else {
    std::unique_ptr<EmulatorEndpoint> endpoint;
    if (carrier == "tcp") {
      endpoint = std::make_unique<TcpEndpoint>(quint16{0});
    } else {
      endpoint = std::make_unique<PtyEndpoint>(bench.folder->filePath("tracker"));
    }
    bench.emulator = std::make_unique<EmulatorRunner>(std::make_unique<Unit>(std::move(source), options),
                                                      std::move(endpoint), options.faults, clock);
  }
  FT_CHECK(bench.emulator->start().has_value());
  if (!make_line) {
    const std::string address = bench.emulator->endpoint().address().toStdString();
    make_line = [address] { return makeTransport(address); };
  }
  bench.device = makeLineDevice<Startup>(setup, std::move(make_line), clock);
  bench.probe = std::make_unique<DeviceProbe>(*bench.device);
  return bench;
}

/// What a driver does when its tracker misbehaves.
struct FaultCase {
  std::string fault;
  bool fails = false;            ///< It gives up; otherwise it goes on.
  QList<QByteArray> says;        ///< Fragments of its sentences.
  bool marks_readings = false;   ///< Some readings carry a status.
  bool leaves_outliers = false;  ///< What the outlier test of the averaging must find.
};

/// The faults that every emulated tracker has.
/// @param name what messages call it; @param id of its row; @param too_weak what is said of error k
inline std::vector<FaultCase> commonFaults(const QByteArray& name, const QByteArray& id, const QByteArray& too_weak) {
  return {
      {"garbage_at_open", false, {name}},
      {"lost_bytes", false, {name}},
      {"split_writes", false, {name}},
      {"error_status", false, {"Station 1", too_weak}, true},
      {"hemisphere_flip", false, {"Station 1", "hemisphere"}, true},
      {"wrong_baud", true, {"not " + name + " records", "try 19200", id + ":the line@19200"}},
      {"unplug_after=100", true, {"closed"}},
      {"silence", true, {"No answer", "switched on", "cable"}},
      {"already_streaming", false, {name}},
      {"slow_reply", false, {name}},
      {"outliers", false, {name}, false, true},
  };
}

/// Rows: every fault on every carrier. @param id of the tracker: every fault that it can have must be among them
inline void addFaults(const std::vector<FaultCase>& cases) {
  QTest::addColumn<int>("number");
  QTest::addColumn<QByteArray>("carrier");
  for (const char* carrier : {"pty", "tcp"}) {
    for (std::size_t i = 0; i < cases.size(); ++i) {
      QTest::addRow("%s, %s", cases[i].fault.c_str(), carrier) << static_cast<int>(i) << QByteArray(carrier);
    }
  }
}

/// The names of faults of a tracker that no case tries. @param id of its row
inline std::string untried(const std::vector<FaultCase>& cases, const std::string& id) {
  std::string names;
  for (const auto& known : acquisition::emulatorFaults()) {
    if (!known.isOf(id)) continue;
    const bool tried = std::any_of(cases.begin(), cases.end(), [&](const FaultCase& c) {
      return c.fault.substr(0, c.fault.find('=')) == known.id;
    });
    if (!tried) names += known.id + " ";
  }
  return names;
}

/// Readings without a status: nothing wrong can be averaged, for each is right, or falls to the outlier test.
inline void checkGood(const std::vector<Sample>& good, const FaultCase& now, const Pose& pose, double tolerance_m,
                      double tolerance_rad) {
  if (good.empty()) return;
  if (!now.leaves_outliers) {
    for (const auto& sample : good) FT_VERIFY_MATCH(near(sample.tracker_from_sensor, pose, tolerance_m, tolerance_rad));
    return;
  }
  const auto statistics = averageSamples(good);
  FT_VERIFY_OK(statistics);
  QVERIFY(!statistics->rejections.empty());
  FT_VERIFY_MATCH(near(statistics->mean, pose, tolerance_m, tolerance_rad));
}

/// Readings of one sensor that stands still: all good, one after the other.
inline void checkStanding(const std::vector<Sample>& samples, const Pose& pose, double tolerance_m,
                          double tolerance_rad) {
  double last_s = 0.0;
  for (const auto& sample : samples) {
    QCOMPARE(sample.status, std::string());
    QCOMPARE(sample.sensor, 0);
    QVERIFY(sample.time_s > last_s);
    last_s = sample.time_s;
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor, pose, tolerance_m, tolerance_rad));
  }
}

/// A driver that is stopped, twice, whatever it is about to say: it closes, and calls it no failure.
inline void checkStopsWhileConnecting(const std::function<LineBench()>& make_bench) {
  for (const int after_ms : {0, 10, 40, 120}) {
    LineBench bench = make_bench();
    bench.device->start();
    QTest::qWait(after_ms);
    bench.device->stop();
    bench.device->stop();
    QTRY_COMPARE(bench.probe->state, acquisition::DeviceState::kClosed);
    QCOMPARE(bench.probe->failures, 0);
  }
}

/// Runs a bench whose one sensor stands still, and holds the driver to the case.
inline void tryFault(LineBench& bench, const FaultCase& now, const Pose& pose, double tolerance_m,
                     double tolerance_rad) {
  using acquisition::DeviceState;
  constexpr std::size_t kEnough = 700;
  DeviceProbe& probe = *bench.probe;
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(now.fails ? probe.state == DeviceState::kFailed : probe.good().size() >= kEnough,
                            qPrintable(probe.last_text), 20000);
  QCOMPARE(probe.failures, now.fails ? 1 : 0);
  const auto said = [&] { return (now.fails ? probe.last_text : probe.texts.join('\n')).toStdString(); };
  // On a busy computer enough readings may be there before the first that is wrong.
  static_cast<void>(QTest::qWaitFor([&] { return holdsAll(said(), now.says).ok; }, 5000));
  FT_VERIFY_MATCH(holdsAll(said(), now.says));
  if (now.fails) {
    QVERIFY(!probe.last_text.contains('\n'));
    QTest::qWait(50);
    QCOMPARE(probe.failures, 1);
  }
  checkGood(probe.good(), now, pose, tolerance_m, tolerance_rad);
  if (now.marks_readings) QVERIFY(probe.good().size() < probe.samples.size());
}

}  // namespace fieldtrue::testing
