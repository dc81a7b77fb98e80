#include "acquisition/devices/ndi_device.h"

#include <QTemporaryDir>
#include <QTest>
#include <fstream>

#include "acquisition/devices/registry.h"
#include "acquisition/emulators/ndi_emulator.h"
#include "tests/acquisition/devices/line_bench.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

NdiEmulatorCore& ndiOf(LineBench& bench) { return dynamic_cast<NdiEmulatorCore&>(bench.emulator->tracker()); }

const Pose kToolPose{{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536).normalized()};

NdiSetup quickNdi() {
  NdiSetup setup = quick(NdiSetup{});
  setup.break_ms = 5;
  setup.after_break_ms = 100;
  setup.speed_ms = 10;
  // A reply that lost a byte is asked for again after a quarter of a second.
  setup.timings.silence_ms = 2000;
  return setup;
}

LineBench makeNdiBench(const QByteArray& carrier, std::vector<Pose> poses, const NdiEmulatorOptions& options = {},
                       double speed = 1.0, const NdiSetup& setup = quickNdi()) {
  auto source = std::make_unique<StandingSource>(std::move(poses), options.rate_hz);
  return makeLineBench<NdiEmulatorCore, NdiStartup>(carrier, std::move(source), options, setup, speed);
}

std::vector<Pose> rowOfTools(int tools) {
  std::vector<Pose> poses;
  for (int i = 0; i < tools; ++i) poses.push_back({{0.1, 0.1 * i, -0.2}, Eigen::Quaterniond::Identity()});
  return poses;
}

std::vector<FaultCase> ndiFaults() {
  std::vector<FaultCase> cases = commonFaults("NDI Aurora", "ndi", "error value");
  for (FaultCase& one : cases) {
    if (one.fault == "error_status") one.says = {"Tool 1", "error value", "max_error_mm"};
    if (one.fault == "hemisphere_flip") one.says = {"Tool 1", "mirrored"};
    if (one.fault == "wrong_baud") one.says = {"not NDI tracker records", "switch it off and on"};
  }
  cases.push_back({"wrong_crc", false, {"NDI Aurora"}});
  cases.push_back({"missing", false, {"Tool 1", "not seen"}, true});
  cases.push_back({"out_of_volume", false, {"Tool 1", "out of the measuring volume"}, true});
  cases.push_back({"tool_unplugged", false, {"Tool 2", "unplugged"}, true});
  return cases;
}

/// A line with a rate: its bytes make sense at the emulator's rate only, and a break resets the emulator.
class SerialNdi : public BufferedTransport {
 public:
  SerialNdi(std::unique_ptr<LoopbackTransport> inner, EmulatorRunner& emulator, int most_baud)
      : inner_(std::move(inner)), emulator_(emulator), most_baud_(most_baud) {
    connect(inner_.get(), &QIODevice::readyRead, this, [this] {
      const QByteArray bytes = inner_->readAll();
      // What COMM is answered with comes at the old speed.
      received(understood(host_baud_before_) ? bytes : QByteArray(bytes.size(), '\xF8'));
      host_baud_before_ = baud_;
    });
  }
  Result<void> openLine() override {
    openDevice();
    return inner_->openLine();
  }
  bool setBaud(int baud) override {
    baud_ = host_baud_before_ = baud;
    bauds.push_back(baud);
    return true;
  }
  void setBreak(bool on) override {
    if (on) return;
    ++breaks;
    std::vector<EmulatedOutput> none;
    core().receive("\r" + ndiCommand("RESET", "0"), emulator_.time_s(), none);
    received("RESETBE6F\r");
  }
  std::vector<int> bauds;
  int breaks = 0;

 protected:
  qint64 writeData(const char* from, qint64 size) override {
    const QByteArray bytes(from, size);
    unit_baud_ = core().baud();
    inner_->write(understood(baud_) ? bytes : QByteArray(size, '\xFE'));
    return size;
  }

 private:
  NdiEmulatorCore& core() { return dynamic_cast<NdiEmulatorCore&>(emulator_.tracker()); }
  bool understood(int baud) { return baud == unit_baud_ && baud <= most_baud_; }

  std::unique_ptr<LoopbackTransport> inner_;
  EmulatorRunner& emulator_;
  int most_baud_;
  int baud_ = 0;
  int host_baud_before_ = 0;
  int unit_baud_ = kNdiPowerUpBaud;
};

}  // namespace

class NdiDeviceTest : public QObject {
  Q_OBJECT
 private slots:
  void tracksOverEveryCarrier_data();
  void tracksOverEveryCarrier();
  void severalTools();
  void oneToolOfMany();
  void framesAreTheClock();
  void fallsBackToText();
  void replyCanBeChosen_data();
  void replyCanBeChosen();
  void loadsDefinitions();
  void badDefinitions();
  void polarisIsOptical();
  void gatesCanBeOpened();
  void isFound();
  void everyFaultIsTried();
  void faults_data();
  void faults();
  void breakAndSpeed_data();
  void breakAndSpeed();
  void findsItAfterItsSilence();
  void noTool();
  void goesSilent();
  void stopsWhileConnecting();
  void addresses();
};

void NdiDeviceTest::tracksOverEveryCarrier_data() { addCarriers(); }

void NdiDeviceTest::tracksOverEveryCarrier() {
  QFETCH(QByteArray, carrier);
  LineBench bench = makeNdiBench(carrier, {kToolPose});
  DeviceProbe& probe = *bench.probe;
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= 60, qPrintable(probe.last_text), 15000);
  QCOMPARE(probe.state, DeviceState::kRunning);
  checkStanding(probe.samples, kToolPose, 1e-7, 2e-6);
  // It was asked much oftener than it has frames: the same frame is one reading.
  FT_VERIFY_MATCH(near(probe.samples[59].time_s - probe.samples[0].time_s, 59.0 / 40.0, 0.1));
  const TableMetadata about = bench.device->describe();
  QCOMPARE(*about.rate_hz, 40.0);
  QCOMPARE(*about.transmitter_model, std::string("planar_coils"));
  QCOMPARE(*about.excitation, std::string("ac"));
  QVERIFY(about.tracker->find("NDI Aurora 007.000.012") != std::string::npos);
  QCOMPARE(about.other.at("ndi_reply"), std::string("bx"));
  QCOMPARE(about.other.at("ndi_units"), std::string("millimetres"));
  QCOMPARE(about.other.at("ndi_tool_0A"), std::string("34801401 Fieldtrue"));
  QCOMPARE(about.setup.at("tracker_serial"), std::string("EM-00001"));
  bench.device->stop();
  QTRY_COMPARE(probe.state, DeviceState::kClosed);
  QVERIFY(!ndiOf(bench).tracking());
  QCOMPARE(probe.failures, 0);
}

void NdiDeviceTest::severalTools() {
  LineBench bench = makeNdiBench("in process", rowOfTools(4));
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 120, qPrintable(bench.probe->last_text), 15000);
  const auto& samples = bench.probe->samples;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    QCOMPARE(samples[i].sensor, static_cast<int>(i % 4));
    FT_VERIFY_MATCH(near(samples[i].tracker_from_sensor.position_m, rowOfTools(4)[i % 4].position_m, 1e-7));
    // Tools of one frame have one time.
    QCOMPARE(samples[i].time_s, samples[i - i % 4].time_s);
  }
}

void NdiDeviceTest::oneToolOfMany() {
  NdiSetup setup = quickNdi();
  setup.stations = {3};
  LineBench bench = makeNdiBench("in process", rowOfTools(4), {}, 1.0, setup);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 20, qPrintable(bench.probe->last_text), 15000);
  for (const Sample& sample : bench.probe->samples) {
    QCOMPARE(sample.sensor, 2);
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor.position_m, rowOfTools(4)[2].position_m, 1e-7));
  }
}

void NdiDeviceTest::framesAreTheClock() {
  LineBench bench = makeNdiBench("in process", {kToolPose}, {}, 5.0);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 400, qPrintable(bench.probe->last_text), 20000);
  // Whole frames lie between the readings, whatever their arrival.
  const auto& samples = bench.probe->samples;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double frames = (samples[i].time_s - samples[i - 1].time_s) * 40.0;
    QVERIFY(std::lround(frames) >= 1);
    FT_VERIFY_MATCH(near(frames, static_cast<double>(std::lround(frames)), 0.2));
  }
}

void NdiDeviceTest::fallsBackToText() {
  NdiEmulatorOptions options;
  options.knows_bx = false;
  LineBench bench = makeNdiBench("in process", {kToolPose}, options);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 20, qPrintable(bench.probe->last_text), 15000);
  QCOMPARE(bench.device->describe().other.at("ndi_reply"), std::string("tx"));
  for (const Sample& sample : bench.probe->samples) {
    // Text has hundredths of a millimetre and four decimals of a quaternion.
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor, kToolPose, 1e-5, 3e-4));
  }
}

void NdiDeviceTest::replyCanBeChosen_data() {
  QTest::addColumn<QByteArray>("reply");
  QTest::addColumn<bool>("knows_bx");
  QTest::newRow("tx") << QByteArray("tx") << true;
  QTest::newRow("bx") << QByteArray("bx") << true;
  QTest::newRow("bx that is refused") << QByteArray("bx") << false;
}

void NdiDeviceTest::replyCanBeChosen() {
  QFETCH(QByteArray, reply);
  QFETCH(bool, knows_bx);
  NdiEmulatorOptions options;
  options.knows_bx = knows_bx;
  NdiSetup setup = quickNdi();
  setup.reply = reply.toStdString();
  LineBench bench = makeNdiBench("in process", {kToolPose}, options, 1.0, setup);
  bench.device->start();
  if (!knows_bx) {
    QTRY_COMPARE_WITH_TIMEOUT(bench.probe->state, DeviceState::kFailed, 10000);
    FT_VERIFY_MATCH(holdsAll(bench.probe->last_text.toStdString(), {"unknown to this firmware", "ERROR01"}));
    return;
  }
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 10, qPrintable(bench.probe->last_text), 15000);
  QCOMPARE(bench.device->describe().other.at("ndi_reply"), reply.toStdString());
}

void NdiDeviceTest::loadsDefinitions() {
  QTemporaryDir folder;
  std::string rom = "NDI";
  rom.resize(752, '\x5A');
  const std::string path = folder.filePath("probe.rom").toStdString();
  std::ofstream(path, std::ios::binary) << rom;
  NdiEmulatorOptions options;
  options.wireless = 2;
  NdiSetup setup = quickNdi();
  setup.roms = {{path, rom}, {path, rom}};
  LineBench bench = makeNdiBench("in process", rowOfTools(3), options, 1.0, setup);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 30, qPrintable(bench.probe->last_text), 15000);
  QCOMPARE(ndiOf(bench).definition(0x0B).substr(0, rom.size()), rom);
  QCOMPARE(ndiOf(bench).definition(0x0C).substr(0, rom.size()), rom);
  for (std::size_t i = 0; i < 30; ++i) {
    const Sample& sample = bench.probe->samples[i];
    QCOMPARE(sample.sensor, static_cast<int>(i % 3));
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor.position_m, rowOfTools(3)[i % 3].position_m, 1e-7));
  }
  QCOMPARE(bench.device->describe().other.at("ndi_rom_2"), path);
}

void NdiDeviceTest::badDefinitions() {
  QTemporaryDir folder;
  const std::string big = folder.filePath("big.rom").toStdString();
  std::ofstream(big, std::ios::binary) << std::string(5000, 'x');
  const std::string good = folder.filePath("good.rom").toStdString();
  std::ofstream(good, std::ios::binary) << std::string(752, 'x');
  FT_VERIFY_OK(makeDevice("ndi:/dev/ttyUSB0,rom=" + good + "+" + good, {}));
  FT_VERIFY_MATCH(holdsAll(makeDevice("ndi:/dev/ttyUSB0,rom=" + big, {}).error().message, {"big.rom", "5000"}));
  FT_VERIFY_MATCH(holdsAll(makeDevice("ndi:/dev/ttyUSB0,rom=/nowhere.rom", {}).error().message, {"/nowhere.rom"}));
}

void NdiDeviceTest::polarisIsOptical() {
  NdiEmulatorOptions options;
  options.identity = "Polaris Vicra";
  options.rate_hz = kNdiPolarisRate_hz;
  LineBench bench = makeNdiBench("in process", {kToolPose}, options);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 60, qPrintable(bench.probe->last_text), 15000);
  const TableMetadata about = bench.device->describe();
  QCOMPARE(*about.rate_hz, 60.0);
  QCOMPARE(*about.transmitter_model, std::string("optical"));
  QVERIFY(!about.excitation);
  FT_VERIFY_MATCH(near(bench.probe->samples[59].time_s - bench.probe->samples[0].time_s, 59.0 / 60.0, 0.1));
  // A setting goes before what it says.
  QCOMPARE(std::string(ndiSystem("aurora", "Polaris").id), std::string("aurora"));
  QCOMPARE(std::string(ndiSystem("auto", "NDI POLARIS Vega").id), std::string("polaris"));
  QCOMPARE(std::string(ndiSystem("auto", "something else").id), std::string("other"));
}

void NdiDeviceTest::gatesCanBeOpened() {
  NdiEmulatorOptions options;
  options.faults = *parseFaults("out_of_volume,error_status", "ndi");
  NdiSetup setup = quickNdi();
  setup.gate = {0.0, false};
  LineBench bench = makeNdiBench("in process", {kToolPose}, options, 10.0, setup);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 200, qPrintable(bench.probe->last_text), 15000);
  QCOMPARE(bench.probe->good().size(), bench.probe->samples.size());
}

void NdiDeviceTest::isFound() {
  const TrackerProbe probe = ndiProbe();
  QCOMPARE(probe.ask, std::string("VER:065EE\r"));
  const auto aurora = probe.answer(encodeNdiReply("Aurora Control Firmware\nNDI S/N: A1-00001\nFreeze Tag: Rev 010"));
  QCOMPARE(aurora->model, std::string("NDI Aurora Control Firmware"));
  QCOMPARE(aurora->firmware, std::string("Rev 010"));
  QVERIFY(probe.answer(encodeNdiReply("ERROR0C")));
  for (const char* other : {"", "6DFOB     ", "OKAY\r", "21S3F0    F31  G1.02 \r\n"})
    QVERIFY2(!probe.answer(other), other);
}

void NdiDeviceTest::everyFaultIsTried() { QCOMPARE(untried(ndiFaults(), "ndi"), std::string()); }

void NdiDeviceTest::faults_data() {
  QTest::addColumn<int>("number");
  QTest::addColumn<QByteArray>("carrier");
  QTest::addColumn<bool>("binary");
  const std::vector<FaultCase> cases = ndiFaults();
  for (const auto& [carrier, binary] : {std::pair{"pty", true}, {"pty", false}, {"tcp", true}}) {
    for (std::size_t i = 0; i < cases.size(); ++i) {
      QTest::addRow("%s, %s, %s", cases[i].fault.c_str(), carrier, binary ? "BX" : "TX")
          << static_cast<int>(i) << QByteArray(carrier) << binary;
    }
  }
}

void NdiDeviceTest::faults() {
  QFETCH(int, number);
  QFETCH(QByteArray, carrier);
  QFETCH(bool, binary);
  const FaultCase now = ndiFaults()[static_cast<std::size_t>(number)];
  const std::string& fault = now.fault;
  constexpr double kSpeed = 10.0;
  NdiEmulatorOptions options;
  options.faults = *parseFaults(fault, "ndi");
  options.reset_silence_s = 1.0;
  NdiSetup setup = quickNdi();
  setup.reply = binary ? "bx" : "tx";
  const std::vector<Pose> poses(2, kToolPose);
  LineBench bench = makeNdiBench(carrier, poses, options, kSpeed, setup);
  DeviceProbe& probe = *bench.probe;
  bench.device->start();
  const std::size_t enough = now.leaves_outliers ? 1400 : fault == "lost_bytes" ? 100 : 400;
  const auto done = [&] { return now.fails ? probe.state == DeviceState::kFailed : probe.good().size() >= enough; };
  QTRY_VERIFY2_WITH_TIMEOUT(done(), qPrintable(probe.last_text), 30000);
  QCOMPARE(probe.failures, now.fails ? 1 : 0);
  const QString said = now.fails ? probe.last_text : probe.texts.join('\n');
  FT_VERIFY_MATCH(holdsAll(said.toStdString(), now.says));
  auto good = probe.good();
  if (now.leaves_outliers) std::erase_if(good, [](const Sample& sample) { return sample.sensor != 0; });
  checkGood(good, now, kToolPose, binary ? 1e-6 : 1e-5, 3e-4);
  if (!good.empty() && !now.leaves_outliers) QCOMPARE(good.size() < probe.samples.size(), now.marks_readings);
}

void NdiDeviceTest::breakAndSpeed_data() {
  QTest::addColumn<int>("most_baud");
  QTest::addColumn<int>("ends_at");
  QTest::addColumn<int>("breaks");
  QTest::newRow("the speed is reached") << 115200 << 115200 << 1;
  // An adapter that garbles it: reset once more, and slow.
  QTest::newRow("the speed is garbled") << 9600 << 9600 << 2;
}

void NdiDeviceTest::breakAndSpeed() {
  QFETCH(int, most_baud);
  QFETCH(int, ends_at);
  QFETCH(int, breaks);
  NdiEmulatorOptions options;
  options.reset_silence_s = 0.0;
  auto ends = LoopbackTransport::pair();
  auto emulator = emulatorOnLine<NdiEmulatorCore>(
      std::make_unique<StandingSource>(std::vector{kToolPose}, options.rate_hz), std::move(ends.second), options);
  FT_VERIFY_OK(emulator->start());
  auto inner = std::make_shared<std::unique_ptr<LoopbackTransport>>(std::move(ends.first));
  SerialNdi* serial = nullptr;
  const auto device = makeLineDevice<NdiStartup>(quickNdi(), [&]() -> Result<std::unique_ptr<Transport>> {
    auto line = std::make_unique<SerialNdi>(std::move(*inner), *emulator, most_baud);
    serial = line.get();
    return line;
  });
  DeviceProbe probe(*device);
  device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.state == DeviceState::kRunning, qPrintable(probe.last_text), 20000);
  QCOMPARE(serial->bauds.front(), 9600);
  QCOMPARE(serial->bauds.back(), ends_at);
  QCOMPARE(serial->breaks, breaks);
  QCOMPARE(probe.last_text.contains("found at 9600 baud"), ends_at == 9600);
}

void NdiDeviceTest::findsItAfterItsSilence() {
  // A soft reset by somebody else: silent for a while, then as new.
  NdiEmulatorOptions options;
  options.reset_silence_s = 1.5;
  NdiSetup setup = quickNdi();
  setup.timings.reset_ms = 2000;
  LineBench bench = makeNdiBench("in process", {kToolPose}, options, 1.0, setup);
  std::vector<EmulatedOutput> none;
  ndiOf(bench).receive(ndiCommand("RESET", "0"), 0.0, none);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->state == DeviceState::kRunning, qPrintable(bench.probe->last_text), 20000);
}

void NdiDeviceTest::noTool() {
  NdiEmulatorOptions options;
  options.wireless = 1;
  LineBench bench = makeNdiBench("in process", {kToolPose}, options);
  bench.device->start();
  QTRY_COMPARE_WITH_TIMEOUT(bench.probe->state, DeviceState::kFailed, 10000);
  FT_VERIFY_MATCH(holdsAll(bench.probe->last_text.toStdString(), {"no tool", "rom=FILE"}));
}

void NdiDeviceTest::goesSilent() {
  LineBench bench = makeNdiBench("in process", {kToolPose});
  bench.device->start();
  QTRY_COMPARE_WITH_TIMEOUT(bench.probe->state, DeviceState::kRunning, 10000);
  std::vector<EmulatedOutput> none;
  ndiOf(bench).receive("\r" + ndiCommand("RESET", "0"), bench.emulator->time_s(), none);
  QTRY_COMPARE_WITH_TIMEOUT(bench.probe->state, DeviceState::kFailed, 5000);
  FT_VERIFY_MATCH(holdsAll(bench.probe->last_text.toStdString(), {"NDI tracker", "connect again"}));
}

void NdiDeviceTest::stopsWhileConnecting() {
  checkStopsWhileConnecting([] { return makeNdiBench("in process", rowOfTools(2)); });
}

void NdiDeviceTest::addresses() {
  FT_VERIFY_OK(makeDevice("ndi:/dev/ttyUSB0@1228739,stations=1+2,max_error_mm=0.5", {}));
  FT_VERIFY_OK(makeDevice("ndi:tcp:localhost:8765,reply=tx,volume=any", {}));
  FT_VERIFY_MATCH(holdsAll(makeDevice("ndi:/dev/ttyUSB0@4800", {}).error().message, {"4800", "115200"}));
  FT_VERIFY_MATCH(holdsAll(makeDevice("ndi:/dev/ttyUSB0,reply=gx", {}).error().message, {"reply", "gx"}));
}

FIELDTRUE_TEST(NdiDeviceTest)
#include "ndi_device_test.moc"
