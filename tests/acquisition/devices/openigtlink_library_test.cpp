#include <QTest>

#include "tests/support/test_main.h"

#ifdef FIELDTRUE_OPENIGTLINK

#include <igtlClientSocket.h>
#include <igtlMessageHeader.h>
#include <igtlPositionMessage.h>
#include <igtlQuaternionTrackingDataMessage.h>
#include <igtlServerSocket.h>
#include <igtlStatusMessage.h>
#include <igtlTrackingDataMessage.h>
#include <igtlTransformMessage.h>

#include <atomic>
#include <thread>

#include "acquisition/devices/openigtlink_device.h"
#include "acquisition/emulators/openigtlink_emulator.h"
#include "tests/acquisition/devices/device_probe.h"
#include "tests/support/matchers.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

const Pose kPose{{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536).normalized()};
constexpr double kStamp_s = 1700000000.25;

void fill(igtl::Matrix4x4& matrix, const Pose& pose) {
  const Eigen::Matrix3d rotation = pose.orientation.toRotationMatrix();
  igtl::IdentityMatrix(matrix);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) matrix[row][column] = static_cast<float>(rotation(row, column));
    matrix[row][3] = static_cast<float>(1000.0 * pose.position_m[row]);
  }
}

Pose poseOf(const igtl::Matrix4x4& matrix) {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d position_m;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) rotation(row, column) = static_cast<double>(matrix[row][column]);
    position_m[row] = 1e-3 * static_cast<double>(matrix[row][3]);
  }
  return {position_m, Eigen::Quaterniond(rotation)};
}

std::string packed(igtl::MessageBase& message, const char* device) {
  igtl::TimeStamp::Pointer stamp = igtl::TimeStamp::New();
  stamp->SetTime(kStamp_s);
  message.SetDeviceName(device);
  message.SetTimeStamp(stamp);
  message.Pack();
  return {static_cast<const char*>(message.GetPackPointer()), static_cast<std::size_t>(message.GetPackSize())};
}

std::string packedTracking(const Pose& first, const Pose& second) {
  igtl::TrackingDataMessage::Pointer message = igtl::TrackingDataMessage::New();
  for (const auto& [name, pose] : {std::pair("First", first), std::pair("Second", second)}) {
    igtl::TrackingDataElement::Pointer element = igtl::TrackingDataElement::New();
    igtl::Matrix4x4 matrix;
    fill(matrix, pose);
    element->SetName(name);
    element->SetType(igtl::TrackingDataElement::TYPE_6D);
    element->SetMatrix(matrix);
    message->AddTrackingDataElement(element);
  }
  return packed(*message, "Tracker");
}

IgtlMessage onlyMessage(const std::string& bytes) {
  IgtlParser parser;
  std::vector<IgtlMessage> messages;
  parser.add(bytes, messages);
  FT_CHECK(messages.size() == 1 && parser.dropped_bytes() == 0);
  return messages.front();
}

std::vector<IgtlReading> readings(const std::string& bytes) {
  const IgtlMessage message = onlyMessage(bytes);
  const auto found = readingsOf(message.header, message.body);
  FT_CHECK(found.has_value());
  return *found;
}

/// Receives one message as the library's ReceiveClient does. @return its type; empty when the connection ended
template <class Message>
bool receiveBody(igtl::ClientSocket& socket, igtl::MessageHeader& header, Message& message) {
  message.SetMessageHeader(&header);
  message.AllocatePack();
  socket.Receive(message.GetPackBodyPointer(), message.GetPackBodySize());
  return (message.Unpack(1) & igtl::MessageHeader::UNPACK_BODY) != 0;
}

}  // namespace

class OpenigtlinkLibraryTest : public QObject {
  Q_OBJECT
 private slots:
  void readsWhatTheLibraryPacks();
  void theLibraryReadsWhatIsWritten();
  void aClientOfTheLibraryReadsTheEmulator();
  void aServerOfTheLibraryIsRead();
};

void OpenigtlinkLibraryTest::readsWhatTheLibraryPacks() {
  igtl::TransformMessage::Pointer transform = igtl::TransformMessage::New();
  igtl::Matrix4x4 matrix;
  fill(matrix, kPose);
  transform->SetMatrix(matrix);
  const std::string bytes = packed(*transform, "Probe");
  const IgtlMessage message = onlyMessage(bytes);
  QCOMPARE(message.header.device, std::string("Probe"));
  FT_VERIFY_MATCH(near(secondsOfIgtlStamp(message.header.stamp), kStamp_s, 1e-6));
  QCOMPARE(readings(bytes).front().name, std::string("Probe"));
  FT_VERIFY_MATCH(near(readings(bytes).front().tracker_from_sensor, kPose, 1e-7, 1e-6));

  igtl::PositionMessage::Pointer position = igtl::PositionMessage::New();
  position->SetPosition(254.0f, -127.0f, 63.5f);
  const auto q = kPose.orientation.cast<float>();
  position->SetQuaternion(q.x(), q.y(), q.z(), q.w());
  for (const int form : {igtl::PositionMessage::ALL, igtl::PositionMessage::WITH_QUATERNION3}) {
    position->SetPackType(form);
    FT_VERIFY_MATCH(near(readings(packed(*position, "Probe")).front().tracker_from_sensor, kPose, 1e-7, 1e-5));
  }

  const auto two = readings(packedTracking(kPose, inverse(kPose)));
  QCOMPARE(two.size(), std::size_t{2});
  QCOMPARE(two[1].name, std::string("Second"));
  FT_VERIFY_MATCH(near(two[0].tracker_from_sensor, kPose, 1e-7, 1e-6));
  FT_VERIFY_MATCH(near(two[1].tracker_from_sensor, inverse(kPose), 1e-7, 1e-6));

  igtl::QuaternionTrackingDataMessage::Pointer quaternions = igtl::QuaternionTrackingDataMessage::New();
  igtl::QuaternionTrackingDataElement::Pointer element = igtl::QuaternionTrackingDataElement::New();
  element->SetName("Tip");
  element->SetType(igtl::QuaternionTrackingDataElement::TYPE_6D);
  element->SetPosition(254.0f, -127.0f, 63.5f);
  element->SetQuaternion(q.x(), q.y(), q.z(), q.w());
  quaternions->AddQuaternionTrackingDataElement(element);
  FT_VERIFY_MATCH(near(readings(packed(*quaternions, "Tracker")).front().tracker_from_sensor, kPose, 1e-7, 1e-6));

  igtl::StatusMessage::Pointer status = igtl::StatusMessage::New();
  status->SetCode(igtl::StatusMessage::STATUS_NOT_READY);
  status->SetErrorName("NotReady");
  status->SetStatusString("starting up");
  const IgtlMessage said = onlyMessage(packed(*status, "Server"));
  QCOMPARE(serverStatusOf(said.header, said.body)->code, 13);
  QCOMPARE(serverStatusOf(said.header, said.body)->message, std::string("starting up"));
}

void OpenigtlinkLibraryTest::theLibraryReadsWhatIsWritten() {
  const std::string bytes = encodeIgtl("TRANSFORM", "Probe", igtlStampOf(kStamp_s), encodeTransformBody(kPose));
  igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
  header->InitPack();
  std::copy_n(bytes.begin(), kIgtlHeaderBytes, static_cast<char*>(header->GetPackPointer()));
  header->Unpack();
  QCOMPARE(std::string(header->GetDeviceName()), std::string("Probe"));
  igtl::TransformMessage::Pointer transform = igtl::TransformMessage::New();
  transform->SetMessageHeader(header);
  transform->AllocatePack();
  std::copy(bytes.begin() + kIgtlHeaderBytes, bytes.end(), static_cast<char*>(transform->GetPackBodyPointer()));
  // With its CRC.
  QVERIFY((transform->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) != 0);
  igtl::Matrix4x4 matrix;
  transform->GetMatrix(matrix);
  FT_VERIFY_MATCH(near(poseOf(matrix), kPose, 1e-7, 1e-6));
  igtl::TimeStamp::Pointer stamp = igtl::TimeStamp::New();
  header->GetTimeStamp(stamp);
  FT_VERIFY_MATCH(near(stamp->GetTimeStamp(), kStamp_s, 1e-6));
}

void OpenigtlinkLibraryTest::aClientOfTheLibraryReadsTheEmulator() {
  IgtlEmulatorOptions options;
  options.start_utc_s = kStamp_s;
  auto core =
      std::make_unique<IgtlEmulatorCore>(std::make_unique<StandingSource>(std::vector{kPose, inverse(kPose)}), options);
  EmulatorRunner server(std::move(core), std::make_unique<TcpEndpoint>(quint16{0}));
  FT_VERIFY_OK(server.start());
  const int port = server.endpoint().address().section(':', -1).toInt();
  std::atomic<int> transforms = 0, tracking = 0, wrong = 0;
  std::atomic<bool> ended = false;
  std::thread client([&] {
    igtl::ClientSocket::Pointer socket = igtl::ClientSocket::New();
    if (socket->ConnectToServer("127.0.0.1", port) != 0) ++wrong;
    for (int i = 0; i < 90 && wrong == 0; ++i) {
      igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
      header->InitPack();
      if (socket->Receive(header->GetPackPointer(), header->GetPackSize()) != header->GetPackSize()) ++wrong;
      header->Unpack();
      if (std::string(header->GetDeviceType()) == "TDATA") {
        igtl::TrackingDataMessage::Pointer message = igtl::TrackingDataMessage::New();
        const bool whole = receiveBody(*socket, *header, *message);
        ++(whole && message->GetNumberOfTrackingDataElements() == 2 ? tracking : wrong);
      } else {
        igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
        const bool whole = receiveBody(*socket, *header, *message);
        igtl::Matrix4x4 matrix;
        message->GetMatrix(matrix);
        const Pose expected = std::string(header->GetDeviceName()) == "Sensor1" ? kPose : inverse(kPose);
        ++(whole && near(poseOf(matrix), expected, 1e-6, 1e-5).ok ? transforms : wrong);
      }
    }
    socket->CloseSocket();
    ended = true;
  });
  for (int waited_ms = 0; !ended && waited_ms < 20000; waited_ms += 20) QTest::qWait(20);
  if (!ended) server.unplug();
  client.join();
  QCOMPARE(wrong.load(), 0);
  QCOMPARE(tracking.load(), 30);
  QCOMPARE(transforms.load(), 60);
}

void OpenigtlinkLibraryTest::aServerOfTheLibraryIsRead() {
  igtl::ServerSocket::Pointer server = igtl::ServerSocket::New();
  QCOMPARE(server->CreateServer(0), 0);
  const int port = server->GetServerPort();
  std::atomic<bool> stop = false;
  std::thread sender([&] {
    igtl::ClientSocket::Pointer host = server->WaitForConnection(10000);
    while (host.IsNotNull() && !stop) {
      const std::string bytes = packedTracking(kPose, inverse(kPose));
      if (host->Send(bytes.data(), static_cast<int>(bytes.size())) == 0) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    if (host.IsNotNull()) host->CloseSocket();
  });
  auto device = makeOpenigtlink("127.0.0.1:" + std::to_string(port), {});
  FT_VERIFY_OK(device);
  DeviceProbe probe(**device);
  (*device)->start();
  for (int waited_ms = 0; probe.samples.size() < 40 && waited_ms < 10000; waited_ms += 20) QTest::qWait(20);
  stop = true;
  sender.join();
  QVERIFY2(probe.samples.size() >= 40, qPrintable(probe.last_text));
  // Every message has the one stamp of packed(), which is no clock.
  QCOMPARE((*device)->describe().other.at("openigtlink_clock"), std::string("arrival"));
  for (const Sample& sample : probe.samples) {
    const Pose expected = sample.sensor == 0 ? kPose : inverse(kPose);
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor, expected, 1e-6, 1e-5));
  }
}

#else

class OpenigtlinkLibraryTest : public QObject {
  Q_OBJECT
 private slots:
  void all() { QSKIP("libopenigtlink-dev is not installed"); }
};

#endif

FIELDTRUE_TEST(OpenigtlinkLibraryTest)
#include "openigtlink_library_test.moc"
