#include "acquisition/devices/trace_device.h"

#include <QElapsedTimer>
#include <QTemporaryDir>
#include <QTest>
#include <tuple>

#include "acquisition/devices/fastrak_device.h"
#include "acquisition/devices/registry.h"
#include "acquisition/devices/trace_file.h"
#include "acquisition/emulators/fastrak_emulator.h"
#include "calib/archives/zip_archive.h"
#include "calib/core/file_io.h"
#include "calib/tables/table_writer.h"
#include "tests/acquisition/devices/line_bench.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

Match sameSamples(const std::vector<Sample>& seen, const std::vector<Sample>& expected, double later_s = 0.0) {
  if (seen.size() != expected.size()) {
    return {false, QByteArray::number(qsizetype(seen.size())) + " samples, not " +
                       QByteArray::number(qsizetype(expected.size()))};
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Match time = sameBits(seen[i].time_s, expected[i].time_s + later_s);
    const Match pose = sameBits(seen[i].tracker_from_sensor, expected[i].tracker_from_sensor);
    const bool same = time && pose && seen[i].sensor == expected[i].sensor && seen[i].status == expected[i].status;
    if (!same) return {false, "sample " + QByteArray::number(qsizetype(i)) + ": " + time.text + ", " + pose.text};
  }
  return {true, "the same samples"};
}

/// Two seconds of a Fastrak by a hand: 20 records of station 1, in chunks that cut them, and what was said before.
Trace smallTrace() {
  LineTrace line;
  line.add(0.1, true, "S");
  line.add(0.2, false, "21S3F3    F31  G1.02 somebody's\r\n");
  TraceStream stream;
  stream.settings = {{"stations", "1"}};
  stream.rate_hz = 10.0;
  stream.summary = "Fastrak G1.02, station 1 at 10 Hz";
  stream.metadata.tracker = "Polhemus Fastrak G1.02";
  stream.metadata.setup["tracker_kind"] = "fastrak";
  line.beginStream(stream);
  line.add(0.3, true, "C");
  const std::vector<int> items(kFastrakDriverItems.begin(), kFastrakDriverItems.end());
  const auto layout = *fastrakLayout(items, FastrakFormat::kBinary);
  for (int i = 0; i < 20; ++i) {
    const Pose pose{{0.3, 0.01 * i, 0.0}, Eigen::Quaterniond::Identity()};
    const std::string bytes = encodeRecord(recordOfPose(1, i == 7 ? 'k' : ' ', pose), layout, FastrakUnit::kCentimetre);
    line.add(0.5 + 0.1 * i, false, bytes.substr(0, 11));
    line.add(0.5003 + 0.1 * i, false, bytes.substr(11));
  }
  Trace trace = line.content();
  trace.tracker = "fastrak";
  trace.device = "fastrak:/dev/ttyUSB0";
  return trace;
}

}  // namespace

class TraceDeviceTest : public QObject {
  Q_OBJECT
 private slots:
  void everyTrackerIsPlayedAgainBitForBit_data();
  void everyTrackerIsPlayedAgainBitForBit();
  void whatWentWrongIsPlayedAgain_data();
  void whatWentWrongIsPlayedAgain();
  void connectedTwice();
  void fileReadsBack();
  void keepsItsTimes();
  void loops();
  void beginsAnew();
  void sampleTable();
  void endsWithTheRecording();
  void theRingIsBounded();
  void whatBeganBeforeTheRing();
  void everyCutIsToldInASentence();
  void whatCannotBePlayed_data();
  void whatCannotBePlayed();
  void wrongTexts();

 private:
  std::string at(const char* name) const { return folder_.filePath(name).toStdString(); }
  /// Plays a file to its end, and goes on where the tracker was lost.
  std::vector<Sample> played(const std::string& text, QString* last_text = nullptr, int* losses = nullptr) const {
    auto device = makeDevice(text, {});
    FT_CHECK(device.has_value());
    DeviceProbe probe(**device);
    (*device)->start();
    QElapsedTimer timer;
    timer.start();
    const auto is_over = [&probe] {
      return probe.state == DeviceState::kClosed || probe.state == DeviceState::kFailed;
    };
    while (timer.elapsed() < 20000) {
      const bool is_break = probe.state == DeviceState::kFailed && !probe.samples.empty();
      if (is_break) (*device)->start();
      if (!is_break && is_over()) break;
      QTest::qWait(5);
    }
    if (losses) *losses = probe.failures;
    if (last_text) *last_text = probe.last_text;
    return probe.samples;
  }
  std::vector<Sample> recorded(TrackerDevice& device, const DeviceProbe& probe, const std::string& file) const {
    const auto trace = device.trace();
    FT_CHECK(trace.has_value() && writeTrace(file, *trace).has_value());
    return probe.samples;
  }
  QTemporaryDir folder_;
};

void TraceDeviceTest::everyTrackerIsPlayedAgainBitForBit_data() {
  QTest::addColumn<QByteArray>("kind");
  for (const DeviceKind& kind : deviceKinds()) {
    if (kind.emulate) QTest::newRow(kind.id.c_str()) << QByteArray::fromStdString(kind.id);
  }
}

void TraceDeviceTest::everyTrackerIsPlayedAgainBitForBit() {
  QFETCH(QByteArray, kind);
  Emulation emulation;
  emulation.sensors = 2;
  const bool has_pty = kind != "openigtlink";
  if (has_pty) emulation.pty_link = at("line");
  if (!has_pty) emulation.tcp_port = 0;
  auto emulator = (*findEmulated(kind.toStdString()))->emulate(emulation);
  FT_VERIFY_OK(emulator);
  FT_VERIFY_OK((*emulator)->start());
  auto device = makeDevice(kind.toStdString() + ":" + (*emulator)->endpoint().address().toStdString(), {});
  FT_VERIFY_OK(device);
  DeviceProbe probe(**device);
  (*device)->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= 150, qPrintable(probe.last_text), 30000);
  const auto live = recorded(**device, probe, at("live.trace.zip"));
  QString last_text;
  FT_VERIFY_MATCH(sameSamples(played("trace:" + at("live.trace.zip") + ",rate=100", &last_text), live));
  QVERIFY2(last_text.contains("at its end"), qPrintable(last_text));
  // And what the tracker said of itself.
  auto again = makeDevice("trace:" + at("live.trace.zip"), {});
  DeviceProbe listener(**again);
  (*again)->start();
  QCOMPARE(listener.state, DeviceState::kRunning);
  const TableMetadata said = (*again)->describe(), first = (*device)->describe();
  QCOMPARE(said.tracker, first.tracker);
  QVERIFY(said.setup == first.setup);
  QCOMPARE(said.rate_hz, first.rate_hz);
  QCOMPARE(said.other.at("played_from"), std::string("live.trace.zip"));
}

void TraceDeviceTest::whatWentWrongIsPlayedAgain_data() {
  QTest::addColumn<QByteArray>("faults");
  for (const char* faults : {"garbage_at_open", "lost_bytes,split_writes", "error_status", "hemisphere_flip",
                             "already_streaming", "outliers", "unplug_after=200"}) {
    QTest::newRow(faults) << QByteArray(faults);
  }
}

void TraceDeviceTest::whatWentWrongIsPlayedAgain() {
  QFETCH(QByteArray, faults);
  FastrakEmulatorOptions options;
  options.faults = *parseFaults(faults.toStdString());
  auto source = std::make_unique<StandingSource>(std::vector<Pose>{{{0.3, 0.1, 0.0}, Eigen::Quaterniond::Identity()}});
  LineBench bench = makeLineBench<FastrakEmulatorCore, FastrakStartup>("pty", std::move(source), options,
                                                                       quick(FastrakSetup{}), 10.0);
  DeviceProbe& probe = *bench.probe;
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= 600 || probe.state == DeviceState::kFailed,
                            qPrintable(probe.last_text), 20000);
  const auto live = recorded(*bench.device, probe, at("fault.trace.zip"));
  QVERIFY(!live.empty());
  FT_VERIFY_MATCH(sameSamples(played("trace:" + at("fault.trace.zip") + ",rate=1000"), live));
}

void TraceDeviceTest::connectedTwice() {
  auto source = std::make_unique<StandingSource>(std::vector<Pose>{{{0.3, 0.1, 0.0}, Eigen::Quaterniond::Identity()}});
  Emulation emulation;
  emulation.pty_link = at("twice");
  auto emulator = makeFastrakEmulator(emulation);
  FT_VERIFY_OK((*emulator)->start());
  auto device = makeDevice("fastrak:" + at("twice"), {});
  DeviceProbe probe(**device);
  for (const std::size_t wanted : {100u, 250u}) {
    (*device)->start();
    QTRY_VERIFY_WITH_TIMEOUT(probe.samples.size() >= wanted, 15000);
    if (wanted > 100u) break;
    (*device)->stop();
    QTRY_COMPARE_WITH_TIMEOUT(probe.state, DeviceState::kClosed, 5000);
  }
  QCOMPARE((*device)->trace()->streams.size(), std::size_t{2});
  const auto live = recorded(**device, probe, at("twice.trace.zip"));
  // What the line drained in between is no reading now as it was none then.
  int losses = 0;
  FT_VERIFY_MATCH(sameSamples(played("trace:" + at("twice.trace.zip") + ",rate=100", nullptr, &losses), live));
  QCOMPARE(losses, 1);
  for (std::size_t i = 1; i < live.size(); ++i) QVERIFY(live[i].time_s > live[i - 1].time_s);
}

void TraceDeviceTest::fileReadsBack() {
  Trace trace = smallTrace();
  trace.software = "Fieldtrue test";
  trace.recorded = "2026-01-02T03:04:05Z";
  trace.streams[0].metadata.other["fastrak_identity"] = "caf\xE9";  // As a tracker may say it: no UTF-8.
  FT_VERIFY_OK(writeTrace(at("small.trace.zip"), trace));
  const auto read = readTrace(at("small.trace.zip"));
  FT_VERIFY_OK(read);
  QCOMPARE(read->tracker, trace.tracker);
  QCOMPARE(read->device, trace.device);
  QCOMPARE(read->software, trace.software);
  QCOMPARE(read->recorded, trace.recorded);
  QVERIFY(read->bytes == trace.bytes);
  QCOMPARE(read->chunks.size(), trace.chunks.size());
  for (std::size_t i = 0; i < trace.chunks.size(); ++i) {
    FT_VERIFY_MATCH(sameBits(read->chunks[i].t_s, trace.chunks[i].t_s));
    QCOMPARE(read->chunks[i].sent, trace.chunks[i].sent);
    QCOMPARE(read->chunks[i].offset, trace.chunks[i].offset);
    QCOMPARE(read->chunks[i].length, trace.chunks[i].length);
  }
  QCOMPARE(read->streams.size(), std::size_t{1});
  QCOMPARE(read->streams[0].first_chunk, std::size_t{2});
  QVERIFY(read->streams[0].settings == trace.streams[0].settings);
  // Every reader of archives finds the three members.
  const auto members = readZip(at("small.trace.zip"), 1u << 20);
  QCOMPARE(members->size(), std::size_t{3});
  QVERIFY(members->at("bytes.bin") == trace.bytes);
  QVERIFY(members->at("chunks.csv").starts_with("t_s,direction,offset,length\n0.1,out,0,1\n0.2,in,1,"));
}

void TraceDeviceTest::keepsItsTimes() {
  FT_VERIFY_OK(writeTrace(at("small.trace.zip"), smallTrace()));
  QElapsedTimer timer;
  timer.start();
  const auto samples = played("trace:" + at("small.trace.zip") + ",rate=4");
  const double took_s = 1e-3 * static_cast<double>(timer.elapsed());
  QCOMPARE(samples.size(), std::size_t{20});
  QVERIFY2(took_s > 0.45 && took_s < 2.0, qPrintable(QString::number(took_s)));
  // The recording's seconds, whatever the rate: the first is when its last byte came.
  FT_VERIFY_MATCH(sameBits(samples[0].time_s, 0.5003));
  FT_VERIFY_MATCH(near(samples[19].time_s, 0.5003 + 1.9, 1e-3));
  for (std::size_t i = 0; i < 20; ++i) {
    QCOMPARE(samples[i].status, std::string(i == 7 ? "k" : ""));
    const Eigen::Vector3d place_m(0.3, 0.01 * static_cast<double>(i), 0.0);
    FT_VERIFY_MATCH(near(samples[i].tracker_from_sensor.position_m, place_m, 1e-7));
  }
}

void TraceDeviceTest::loops() {
  FT_VERIFY_OK(writeTrace(at("small.trace.zip"), smallTrace()));
  auto device = makeDevice("trace:" + at("small.trace.zip") + ",rate=50,loop=1", {});
  FT_VERIFY_OK(device);
  DeviceProbe probe(**device);
  (*device)->start();
  QTRY_VERIFY_WITH_TIMEOUT(probe.samples.size() >= 70, 10000);
  QCOMPARE(probe.state, DeviceState::kRunning);
  // From the first byte to the last and the period of 10 Hz: 0.5 to 2.4003 s and 0.1 s.
  const double round_s = (0.5003 + 0.1 * 19) - 0.5 + 0.1;
  const std::vector<Sample> first(probe.samples.begin(), probe.samples.begin() + 20);
  for (const int round : {1, 2}) {
    const std::vector<Sample> next(probe.samples.begin() + 20 * round, probe.samples.begin() + 20 * (round + 1));
    for (std::size_t i = 0; i < next.size(); ++i) {
      FT_VERIFY_MATCH(near(next[i].time_s, first[i].time_s + round * round_s, 1e-9));
      FT_VERIFY_MATCH(sameBits(next[i].tracker_from_sensor, first[i].tracker_from_sensor));
    }
  }
  (*device)->stop();
  QCOMPARE(probe.state, DeviceState::kClosed);
  const std::size_t n = probe.samples.size();
  QTest::qWait(100);
  QCOMPARE(probe.samples.size(), n);
}

void TraceDeviceTest::beginsAnew() {
  FT_VERIFY_OK(writeTrace(at("small.trace.zip"), smallTrace()));
  auto device = makeDevice("trace:" + at("small.trace.zip") + ",rate=100", {});
  DeviceProbe probe(**device);
  for (const std::size_t wanted : {20u, 40u}) {
    (*device)->start();
    QTRY_COMPARE_WITH_TIMEOUT(probe.state, DeviceState::kClosed, 5000);
    QCOMPARE(probe.samples.size(), wanted);
  }
  const std::vector<Sample> first(probe.samples.begin(), probe.samples.begin() + 20);
  FT_VERIFY_MATCH(sameSamples({probe.samples.begin() + 20, probe.samples.end()}, first));
}

void TraceDeviceTest::sampleTable() {
  SampleTable table;
  table.metadata.tracker = "Polhemus Fastrak";
  table.metadata.rate_hz = 60.0;
  for (int i = 0; i < 40; ++i) {
    const Pose pose{{0.3, 0.01 * i, 1.0 / 3.0}, Eigen::Quaterniond::Identity()};
    table.rows.push_back({i < 30 ? 0 : -1, 0, {5.0 + i / 60.0, i % 2, pose, i == 9 ? "k" : ""}});
  }
  FT_VERIFY_OK(writeSampleTable(at("room.samples.csv"), table));
  const auto samples = played("trace:" + at("room.samples.csv") + ",rate=20");
  std::vector<Sample> expected;
  for (const auto& row : table.rows) expected.push_back(row.sample);
  FT_VERIFY_MATCH(sameSamples(samples, expected));
  // Around and around.
  auto device = makeDevice("trace:" + at("room.samples.csv") + ",rate=50,loop=1", {});
  DeviceProbe probe(**device);
  (*device)->start();
  QTRY_VERIFY_WITH_TIMEOUT(probe.samples.size() >= 80, 10000);
  FT_VERIFY_MATCH(near(probe.samples[40].time_s - probe.samples[0].time_s, 40.0 / 60.0, 1e-9));
  QCOMPARE(*(*device)->describe().tracker, std::string("Polhemus Fastrak"));
  table.rows.clear();
  FT_VERIFY_OK(writeSampleTable(at("empty.samples.csv"), table));
  QString text;
  QVERIFY(played("trace:" + at("empty.samples.csv"), &text).empty());
  FT_VERIFY_MATCH(holdsAll(text.toStdString(), {"empty.samples.csv", "no rows"}));
}

void TraceDeviceTest::endsWithTheRecording() {
  FT_VERIFY_OK(writeTrace(at("small.trace.zip"), smallTrace()));
  QString text;
  played("trace:" + at("small.trace.zip") + ",rate=100", &text);
  FT_VERIFY_MATCH(holdsAll(text.toStdString(), {"small.trace.zip", "at its end"}));
}

void TraceDeviceTest::theRingIsBounded() {
  LineTrace line(10000);
  for (int i = 0; i < 1000; ++i) line.add(0.01 * i, i % 2 == 0, std::string(36, static_cast<char>('a' + i % 26)));
  const Trace trace = line.content();
  QCOMPARE(trace.chunks.size(), std::size_t{100});  // 36 bytes and 64 beside them.
  QCOMPARE(trace.bytes.size(), std::size_t{3600});
  QCOMPARE(trace.bytes_dropped, std::uint64_t{900 * 36});
  FT_VERIFY_MATCH(sameBits(trace.chunks.front().t_s, 0.01 * 900));
  for (std::size_t i = 0; i < trace.chunks.size(); ++i) {
    QCOMPARE(trace.chunks[i].offset, 36 * i);
    QCOMPARE(trace.bytes[trace.chunks[i].offset], static_cast<char>('a' + (900 + i) % 26));
    QCOMPARE(trace.chunks[i].sent, i % 2 == 0);
  }
  // One chunk is kept whatever its length.
  line.add(20.0, false, std::string(50000, 'x'));
  QCOMPARE(line.content().chunks.size(), std::size_t{1});
}

void TraceDeviceTest::whatBeganBeforeTheRing() {
  LineTrace line(1000);
  TraceStream stream;
  for (int i = 0; i < 40; ++i) {
    if (i % 4 == 0) {
      stream.settings["number"] = std::to_string(i);
      line.beginStream(stream);
    }
    line.add(i, false, std::string(36, 'x'));
  }
  // The last ten chunks are kept, 30 to 39: of the streams that of 28, cut, and those of 32 and 36.
  const Trace trace = line.content();
  QCOMPARE(trace.chunks.size(), std::size_t{10});
  using Row = std::tuple<std::string, std::size_t, std::size_t>;
  const auto rows = [](const Trace& all) {
    std::vector<Row> streams;
    for (const auto& one : all.streams) streams.emplace_back(one.settings.at("number"), one.first_chunk, one.end_chunk);
    return streams;
  };
  QVERIFY(rows(trace) == (std::vector<Row>{{"28", 0, 2}, {"32", 2, 6}, {"36", 6, 10}}));
  line.endStream();
  for (int i = 40; i < 45; ++i) line.add(i, false, std::string(36, 'x'));
  // Now 35 to 44 are kept.
  QVERIFY(rows(line.content()) == (std::vector<Row>{{"32", 0, 1}, {"36", 1, 5}}));
  for (int i = 45; i < 60; ++i) line.add(i, false, std::string(36, 'x'));
  QVERIFY(line.content().streams.empty());
}

void TraceDeviceTest::everyCutIsToldInASentence() {
  FT_VERIFY_OK(writeTrace(at("whole.trace.zip"), smallTrace()));
  const std::string whole = *readFile(at("whole.trace.zip"));
  for (std::size_t length = 0; length < whole.size(); length += 7) {
    FT_VERIFY_OK(writeFileAtomically(at("cut.trace.zip"), [&](std::ostream& out) { out << whole.substr(0, length); }));
    const auto opened = openPlayback(at("cut.trace.zip"));
    QVERIFY(!opened);
    QCOMPARE(opened.error().code, ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(opened.error().message, {"cut.trace.zip", "a whole trace", "needed"}));
    QVERIFY(opened.error().message.find('\n') == std::string::npos);
  }
}

void TraceDeviceTest::whatCannotBePlayed_data() {
  QTest::addColumn<QByteArray>("member");
  QTest::addColumn<QByteArray>("content");
  QTest::addColumn<QList<QByteArray>>("fragments");
  const auto row = [](const char* name, const char* member, const QByteArray& content,
                      const QList<QByteArray>& fragments) {
    QTest::newRow(name) << QByteArray(member) << content << fragments;
  };
  const auto settings = [](const QByteArray& tracker, const QByteArray& streams) {
    return QByteArray(R"({"schema": "fieldtrue.trace/1", "tracker": ")") + tracker + R"(", "streams": [)" + streams +
           "]}";
  };
  row("no settings", "settings.json", {}, {"settings.json is missing"});
  row("no chunks", "chunks.csv", {}, {"chunks.csv is missing"});
  row("no bytes", "bytes.bin", {}, {"bytes.bin is missing"});
  row("settings that are no JSON", "settings.json", "tracker", {"settings.json"});
  row("settings of something else", "settings.json", R"({"schema": "fieldtrue.plan/1"})", {"schema", "trace"});
  row("settings without a schema", "settings.json", R"({"tracker": "fastrak"})", {"schema"});
  row("a newer trace", "settings.json", R"({"schema": "fieldtrue.trace/2"})", {"newer"});
  row("an unknown tracker", "settings.json", settings("sonar", ""), {"sonar", "not known"});
  row("a tracker without a line", "settings.json", settings("simulated", ""), {"simulated", "not known"});
  row("no stream", "settings.json", settings("fastrak", ""), {"no stream"});
  row("a stream without its stations", "settings.json",
      settings("fastrak", R"({"first_chunk": 2, "rate_hz": 10, "settings": {}})"), {"stations", "missing"});
  row("stations that are none", "settings.json",
      settings("fastrak", R"({"first_chunk": 2, "rate_hz": 10, "settings": {"stations": "7"}})"),
      {"stations", "'7'", "1 to 4"});
  row("no rate", "settings.json",
      settings("fastrak", R"({"first_chunk": 2, "rate_hz": 0, "settings": {"stations": "1"}})"), {"rate_hz"});
  row("a stream beyond the chunks", "settings.json",
      settings("fastrak", R"({"first_chunk": 99, "rate_hz": 10, "settings": {"stations": "1"}})"), {"first_chunk"});
  row("a stream that ends before it begins", "settings.json",
      settings("fastrak", R"({"first_chunk": 5, "end_chunk": 4, "rate_hz": 10, "settings": {"stations": "1"}})"),
      {"end_chunk"});
  row("another table", "chunks.csv", "time,bytes\n", {"line 1 of chunks.csv", "t_s,direction,offset,length"});
  row("an empty table", "chunks.csv", " \n", {"line 1 of chunks.csv"});
  const QByteArray head = "t_s,direction,offset,length\n0.1,out,0,1\n";
  row("neither in nor out", "chunks.csv", head + "0.2,up,1,2\n", {"line 3 of chunks.csv", "in or out"});
  row("no time", "chunks.csv", head + "nan,in,1,2\n", {"line 3 of chunks.csv"});
  row("a field too many", "chunks.csv", head + "0.2,in,1,2,3\n", {"line 3 of chunks.csv"});
  row("a negative length", "chunks.csv", head + "0.2,in,1,-2\n", {"line 3 of chunks.csv"});
  row("beyond the bytes", "chunks.csv", head + "0.2,in,1,99999\n", {"line 3 of chunks.csv", "beyond"});
  row("far beyond the bytes", "chunks.csv", head + "0.2,in,18446744073709551615,2\n", {"line 3", "beyond"});
  row("back in time", "chunks.csv", head + "0.05,in,1,2\n", {"line 3 of chunks.csv", "back in time"});
  row("cut in a line", "chunks.csv", head + "0.2,in,1", {"line 3 of chunks.csv", "cut off"});
}

void TraceDeviceTest::whatCannotBePlayed() {
  QFETCH(QByteArray, member);
  QFETCH(QByteArray, content);
  QFETCH(QList<QByteArray>, fragments);
  FT_VERIFY_OK(writeTrace(at("whole.trace.zip"), smallTrace()));
  std::vector<ZipMember> members;
  const auto good = readZip(at("whole.trace.zip"), 1u << 20);
  for (const auto& [name, whole] : *good) {
    if (name != member.toStdString()) members.push_back({name, whole});
  }
  if (!content.isEmpty()) members.push_back({member.toStdString(), content.toStdString()});
  FT_VERIFY_OK(writeZip(at("wrong.trace.zip"), members));
  QString text;
  QVERIFY(played("trace:" + at("wrong.trace.zip"), &text).empty());
  FT_VERIFY_MATCH(holdsAll(text.toStdString(), QList<QByteArray>(fragments) << "wrong.trace.zip"));
  QVERIFY(!text.contains('\n'));
}

void TraceDeviceTest::wrongTexts() {
  FT_VERIFY_MATCH(holdsAll(makeDevice("trace:", {}).error().message, {"trace:fault.trace.zip"}));
  FT_VERIFY_MATCH(holdsAll(makeDevice("trace:a.zip,rate=0", {}).error().message, {"rate", "0.01"}));
  FT_VERIFY_MATCH(holdsAll(makeDevice("trace:a.zip,speed=1", {}).error().message, {"speed", "rate", "loop"}));
  QString text;
  played("trace:" + at("nowhere.trace.zip"), &text);
  FT_VERIFY_MATCH(holdsAll(text.toStdString(), {"nowhere.trace.zip", "No such file"}));
  // A picture, say.
  FT_VERIFY_OK(writeFileAtomically(at("picture.zip"), [](std::ostream& out) { out << "\x89PNG"; }));
  played("trace:" + at("picture.zip"), &text);
  FT_VERIFY_MATCH(holdsAll(text.toStdString(), {"picture.zip", "zip archive"}));
}

FIELDTRUE_TEST(TraceDeviceTest)
#include "trace_device_test.moc"
