// What a person at the jig meets, in the real window by keys and clicks: a sensor at the wrong place, a cable that is
// pulled, a place taken again. The tracker is an emulated Fastrak on a line of this machine, whose sensor the test
// puts where it wants.

#include <QApplication>
#include <QComboBox>
#include <QDir>
#include <QFontMetrics>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSettings>
#include <QSignalSpy>
#include <QSpinBox>
#include <QTableView>
#include <QTemporaryDir>
#include <QTest>
#include <memory>

#include "acquisition/devices/registry.h"
#include "acquisition/emulators/fastrak_emulator.h"
#include "acquisition/emulators/pty_endpoint.h"
#include "acquisition/plan/place_state.h"
#include "tests/support/full_disk.h"
#include "tests/widgets/pages/window_driver.h"
#include "tests/widgets/session_fixture.h"
#include "widgets/shell/main_window.h"
#include "widgets/shell/message_line.h"
#include "widgets/style/theme.h"
#include "widgets/style/unit_texts.h"
#include "widgets/views/room/room_view.h"

namespace fieldtrue::widgets {
using testing::kWaitMs;

namespace {

const Eigen::Vector3d kWrong_m{0.0, 0.36, 0.48};  ///< 0.6 m long.

/// Every sample of a recording, played to its end.
std::vector<Sample> playedFrom(const QString& file) {
  auto device = acquisition::makeDevice("trace:" + file.toStdString() + ",rate=100", {});
  FT_CHECK(device.has_value());
  std::vector<Sample> played;
  bool over = false;
  QObject::connect(
      device->get(), &acquisition::TrackerDevice::samplesReceived,
      [&played](const std::vector<Sample>& more) { played.insert(played.end(), more.begin(), more.end()); });
  QObject::connect(device->get(), &acquisition::TrackerDevice::stateChanged,
                   [&over](acquisition::DeviceState state) { over = state == acquisition::DeviceState::kClosed; });
  (*device)->start();
  FT_CHECK(QTest::qWaitFor([&over] { return over; }, kWaitMs));
  return played;
}

/// Whether readings are among others, one after the other, to the bit; clocks may begin at different times. Arrivals
/// jitter by microseconds, so that no others are taken for them.
bool isAmong(const std::vector<SampleRow>& rows, const std::vector<Sample>& samples) {
  for (std::size_t first = 0; first + rows.size() <= samples.size(); ++first) {
    const auto same = [&](std::size_t i) {
      const Sample &row = rows[i].sample, &sample = samples[first + i];
      const double apart_s = (row.time_s - rows[0].sample.time_s) - (sample.time_s - samples[first].time_s);
      return std::abs(apart_s) < 1e-9 && row.tracker_from_sensor.position_m == sample.tracker_from_sensor.position_m;
    };
    std::size_t n = 0;
    while (n < rows.size() && same(n)) ++n;
    if (n == rows.size()) return true;
  }
  return false;
}

bool isWholeIn(const QLabel& label) {
  const QRect needed =
      QFontMetrics(label.font()).boundingRect(0, 0, label.width(), 10000, Qt::TextWordWrap, label.text());
  return needed.height() <= label.height() && needed.width() <= label.width();
}

}  // namespace

class OperatorTest : public testing::WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase();
  void init();
  void cleanup();
  void aSensorElsewhereIsRefusedAndThenMarked();
  void anEarlierWrongTakeIsNamed();
  void theRoomStandsStill();
  void aRetakeReachesListAndTable();
  void takingByItselfEndsWithTheSession();
  void aMessageGoesWithItsCause();
  void theTrackerComesBack_data();
  void theTrackerComesBack();
  void theLineIsSavedAndPlaysAgain();
  void aTakeLastsAsThePlanSays();
  void whatIsNotStoredIsReadFromAfar();
  void withoutATrackerThePageToConnectIsOffered();

 private:
  void picture(const char* name) {
    const QString folder = qEnvironmentVariable("FIELDTRUE_ARTEFACTS");
    if (folder.isEmpty()) return;
    QTest::qWait(300);
    QDir().mkpath(folder);
    window_->grab().save(folder + QStringLiteral("/operator-") + QString::fromLatin1(name) + QStringLiteral(".png"));
  }
  const acquisition::AcquisitionStatus& status() { return window_->workbench().status(); }
  QString message() { return window_->findChild<MessageLine*>()->text(); }
  QString stateInList(int row) {
    const auto* model = find<QTableView>("placeList")->model();
    return model->index(row, 1).data().toString();
  }
  Pose placeOf(std::size_t place) { return status().session->places.at(place).reference_from_sensor; }

  void plugIn(const QString& line);
  void pullThePlug();
  void connectTo(const QString& address);
  void makePlan(int nx, int ny, int nz);
  bool standAt(const Eigen::Vector3d& p_true_m);
  bool takeAt(const Eigen::Vector3d& p_true_m);
  bool takeRight() { return takeAt(placeOf(*status().current).position_m); }

  const Pose reference_from_tracker_{{-0.4, 0.3, 0.2}, rotationFromVector({0.0, 0.0, 0.3})};
  Eigen::Vector3d stands_m_{0.6, 0.0, 0.1};
  std::unique_ptr<acquisition::EmulatorRunner> emulator_;
  acquisition::StandingSource* sensor_ = nullptr;
};

void OperatorTest::initTestCase() {
  QVERIFY(folder_.isValid());
  testing::keepIn(folder_);
  applyTheme(*qApp, qEnvironmentVariableIsSet("FIELDTRUE_DARK"));
}

void OperatorTest::init() {
  stands_m_ = {0.6, 0.0, 0.1};
  window_ = std::make_unique<MainWindow>();
  window_->resize(1280, 800);
  window_->show();
  window_->activateWindow();
  QVERIFY(QTest::qWaitForWindowExposed(window_.get()));
}

void OperatorTest::cleanup() {
  window_.reset();
  emulator_.reset();
  sensor_ = nullptr;
}

/// @param line a path for a pty behind that link, or the number of a TCP port (0 = any)
void OperatorTest::plugIn(const QString& line) {
  auto source = std::make_unique<acquisition::StandingSource>(std::vector<Pose>{Pose{}});
  sensor_ = source.get();
  bool is_port = false;
  const int port = line.toInt(&is_port);
  std::unique_ptr<acquisition::EmulatorEndpoint> endpoint;
  if (is_port)
    endpoint = std::make_unique<acquisition::TcpEndpoint>(static_cast<quint16>(port));
  else
    endpoint = std::make_unique<acquisition::PtyEndpoint>(line);
  emulator_ = std::make_unique<acquisition::EmulatorRunner>(
      std::make_unique<acquisition::FastrakEmulatorCore>(std::move(source), acquisition::FastrakEmulatorOptions{}),
      std::move(endpoint));
  QVERIFY(emulator_->start().has_value());
  sensor_->put(0, inverse(reference_from_tracker_) * Pose{stands_m_, Eigen::Quaterniond::Identity()});
}

/// Messages come at once, the status a moment later: only when that says it too is the sensor of before out of sight.
void OperatorTest::pullThePlug() {
  emulator_.reset();
  QTRY_COMPARE_WITH_TIMEOUT(status().device, acquisition::DeviceState::kFailed, kWaitMs);
}

void OperatorTest::connectTo(const QString& address) {
  click("step_connect");
  auto* kind = find<QComboBox>("deviceKind");
  kind->setFocus();
  QTest::keyClicks(kind, QStringLiteral("Polhemus"));
  auto* line = find<QComboBox>("deviceAddress");
  QTest::keyClick(line->lineEdit(), Qt::Key_A, Qt::ControlModifier);
  QTest::keyClicks(line->lineEdit(), address);
  click("connectButton");
  QTRY_COMPARE_WITH_TIMEOUT(status().device, acquisition::DeviceState::kRunning, kWaitMs);
}

void OperatorTest::makePlan(int nx, int ny, int nz) {
  const QString before = window_->workbench().sessionPath();
  click("step_plan");
  const std::pair<const char*, int> counts[] = {{"count_x", nx}, {"count_y", ny}, {"count_z", nz}};
  for (const auto& [name, count] : counts) {
    auto* box = find<QSpinBox>(name);
    QTest::keyClick(box, Qt::Key_A, Qt::ControlModifier);
    QTest::keyClicks(box, QString::number(count));
  }
  click("createSession");
  QTRY_VERIFY_WITH_TIMEOUT(window_->workbench().sessionPath() != before, kWaitMs);
  QTRY_COMPARE_WITH_TIMEOUT(status().session->places.size(), static_cast<std::size_t>(nx * ny * nz), kWaitMs);
  QTRY_COMPARE_WITH_TIMEOUT(status().session->path, window_->workbench().sessionPath(), kWaitMs);
  QVERIFY(find<QWidget>("page_acquire")->isVisible());
}

bool OperatorTest::standAt(const Eigen::Vector3d& p_true_m) {
  stands_m_ = p_true_m;
  const Pose tracked = inverse(reference_from_tracker_) * Pose{p_true_m, Eigen::Quaterniond::Identity()};
  sensor_->put(0, tracked);
  return QTest::qWaitFor(
      [&] {
        return status().live && status().still &&
               (status().live->tracker_from_sensor.position_m - tracked.position_m).norm() < 0.002;
      },
      kWaitMs);
}

bool OperatorTest::takeAt(const Eigen::Vector3d& p_true_m) {
  const std::uint64_t revision = status().recorded->revision;
  if (!standAt(p_true_m)) return false;
  QTest::keyClick(window_.get(), Qt::Key_Space);
  return QTest::qWaitFor([&] { return status().recorded->revision > revision; }, kWaitMs);
}

void OperatorTest::aSensorElsewhereIsRefusedAndThenMarked() {
  plugIn(QStringLiteral("0"));
  connectTo(emulator_->endpoint().address());
  makePlan(4, 3, 2);
  for (int i = 0; i < 9; ++i) QVERIFY2(takeRight(), qPrintable(status().reason));
  QCOMPARE(status().recorded->n_done, std::size_t{9});
  const std::size_t place = *status().current;
  QVERIFY(standAt(placeOf(place).position_m + kWrong_m));
  auto* to_go = find<QLabel>("bannerToGo");
  QTRY_VERIFY(to_go->isVisible());
  QTRY_COMPARE(to_go->text(), QStringLiteral("0.60 m"));
  QTRY_COMPARE(find<QLabel>("bannerReason")->text(), QStringLiteral("not at the place: carry the sensor here"));
  picture("to-go");

  QTest::keyClick(window_.get(), Qt::Key_Space);
  QTRY_VERIFY2_WITH_TIMEOUT(message().contains(QStringLiteral("is not taken: the sensor is 0.60 m away")),
                            qPrintable(message()), 3000);
  QVERIFY(message().contains(QString::fromStdString(placeName(status().session->places[place]))));
  QTest::qWait(800);
  QCOMPARE(status().recorded->n_done, std::size_t{9});
  QVERIFY(status().refused);
  picture("refused");

  QTest::keyClick(window_.get(), Qt::Key_Space);
  QTRY_COMPARE_WITH_TIMEOUT(status().recorded->n_done, std::size_t{10}, kWaitMs);
  const QString name = QString::fromStdString(placeName(status().session->places[place]));
  QTRY_COMPARE(message(), name + QStringLiteral(" does not fit the others: 0.60 m off."));
  QVERIFY(status().recorded->states[place] == acquisition::PlaceState::kSuspicious);
  QTRY_COMPARE(stateInList(static_cast<int>(place)), QStringLiteral("0.60 m off"));
  picture("misfit");

  // The button of the message leads back to the place; taken right, nothing is left to be said.
  QPushButton* retake = nullptr;
  for (QPushButton* button : window_->findChild<MessageLine*>()->findChildren<QPushButton*>())
    if (button->text() == QStringLiteral("Retake it")) retake = button;
  QVERIFY(retake != nullptr && retake->isVisible());
  QTest::mouseClick(retake, Qt::LeftButton);
  QTRY_VERIFY(status().current == place);
  QVERIFY(takeRight());
  QTRY_VERIFY(status().recorded->states[place] == acquisition::PlaceState::kDone);
  QTRY_COMPARE(message(), QString());
}

void OperatorTest::anEarlierWrongTakeIsNamed() {
  plugIn(QStringLiteral("0"));
  connectTo(emulator_->endpoint().address());
  makePlan(3, 3, 2);
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d p_m = placeOf(*status().current).position_m;
    QVERIFY2(takeAt(i == 1 ? Eigen::Vector3d(p_m + kWrong_m) : p_m), qPrintable(status().reason));
  }
  QTRY_COMPARE(status().recorded->misfits.size(), std::size_t{1});
  QCOMPARE(status().recorded->misfits[0].place, std::size_t{1});
  QVERIFY(std::abs(status().recorded->misfits[0].off_m - 0.6) < 0.01);
  QCOMPARE(message(), QStringLiteral("B1, pipe 1 does not fit the others: 0.60 m off."));
  QVERIFY(status().recorded->states[1] == acquisition::PlaceState::kSuspicious);
}

void OperatorTest::theRoomStandsStill() {
  plugIn(QStringLiteral("0"));
  connectTo(emulator_->endpoint().address());
  makePlan(3, 3, 2);
  QTest::qWait(500);
  auto* room = find<QWidget>("page_acquire")->findChild<RoomView*>(QStringLiteral("roomView"));
  QVERIFY(room != nullptr);
  const CameraPose before = room->cameraPose();
  const Pose guess = status().reference_from_tracker;
  for (int i = 0; i < 6; ++i) {
    QVERIFY(takeRight());
    QVERIFY(room->cameraPose() == before);
  }
  QVERIFY((status().reference_from_tracker.position_m - guess.position_m).norm() > 0.4);
  QTest::qWait(500);
  QVERIFY(room->cameraPose() == before);
}

void OperatorTest::aRetakeReachesListAndTable() {
  plugIn(QStringLiteral("0"));
  connectTo(emulator_->endpoint().address());
  makePlan(3, 2, 2);
  for (int i = 0; i < 4; ++i) QVERIFY(takeRight());
  const auto& table = window_->workbench().table();
  QTRY_COMPARE(table.nodes.size(), std::size_t{4});
  const Eigen::Vector3d first_m = table.nodes[0].tracker_from_sensor.position_m;
  find<QTableView>("placeList")->selectRow(0);
  QTest::keyClick(window_.get(), Qt::Key_R);
  QTRY_VERIFY(status().current == std::size_t{0});
  QVERIFY(takeAt(placeOf(0).position_m + Eigen::Vector3d(0.0, 0.0, 0.05)));
  QTRY_VERIFY(std::abs((table.nodes[0].tracker_from_sensor.position_m - first_m).norm() - 0.05) < 0.001);
  QCOMPARE(table.nodes.size(), std::size_t{4});
}

void OperatorTest::takingByItselfEndsWithTheSession() {
  plugIn(QStringLiteral("0"));
  connectTo(emulator_->endpoint().address());
  makePlan(3, 2, 2);
  QTest::keyClick(window_.get(), Qt::Key_A);
  QTRY_VERIFY(status().automatic);
  auto* button = find<QPushButton>("automatic");
  QTRY_VERIFY(button->isChecked());
  makePlan(2, 2, 2);
  QTRY_VERIFY(!button->isChecked());
  QVERIFY(!status().automatic);
  QVERIFY(standAt(placeOf(0).position_m));
  QTest::qWait(4000);
  QCOMPARE(status().recorded->n_done, std::size_t{0});
}

void OperatorTest::aMessageGoesWithItsCause() {
  plugIn(QStringLiteral("0"));
  const QString address = emulator_->endpoint().address();
  const QString port = address.section(QLatin1Char(':'), -1);
  connectTo(address);
  makePlan(3, 2, 2);
  QVERIFY(takeRight());
  QVERIFY(standAt(placeOf(1).position_m));
  QTest::keyClick(window_.get(), Qt::Key_Space);
  QTRY_VERIFY(status().take == acquisition::TakeState::kCollecting);
  pullThePlug();
  QTRY_VERIFY2(message().startsWith(QStringLiteral("B1, pipe 1: the tracker was lost")), qPrintable(message()));
  plugIn(port);
  QTRY_COMPARE_WITH_TIMEOUT(status().device, acquisition::DeviceState::kRunning, kWaitMs);
  QVERIFY(takeRight());
  QTRY_VERIFY2(!message().contains(QStringLiteral("lost")), qPrintable(message()));
  // Nor does anything of this session stand in the next.
  QVERIFY(standAt(placeOf(2).position_m));
  QTest::keyClick(window_.get(), Qt::Key_Space);
  QTRY_VERIFY(status().take == acquisition::TakeState::kCollecting);
  pullThePlug();
  QTRY_VERIFY2(message().startsWith(QStringLiteral("C1, pipe 1: the tracker was lost")), qPrintable(message()));
  plugIn(port);
  QTRY_COMPARE_WITH_TIMEOUT(status().device, acquisition::DeviceState::kRunning, kWaitMs);
  makePlan(2, 2, 2);
  QTRY_VERIFY2(!message().contains(QStringLiteral("C1, pipe 1")), qPrintable(message()));
}

void OperatorTest::theTrackerComesBack_data() {
  QTest::addColumn<QString>("line");
  QTest::newRow("tcp") << QStringLiteral("0");
  QTest::newRow("pty") << folder_.filePath(QStringLiteral("a line with a long name as the links of a machine are"));
}

void OperatorTest::theTrackerComesBack() {
  QFETCH(QString, line);
  plugIn(line);
  const QString address = emulator_->endpoint().address();
  if (line == QStringLiteral("0")) line = address.section(QLatin1Char(':'), -1);
  connectTo(address);
  makePlan(3, 2, 2);
  QVERIFY(takeRight());
  pullThePlug();
  auto* reason = find<QLabel>("bannerReason");
  QTRY_COMPARE(find<QWidget>("banner")->property("state").toString(), QStringLiteral("danger"));
  QVERIFY(find<QLabel>("deviceState")->property("failed").toBool());
  const QString why = status().device_text;
  QVERIFY2(why.contains(line), qPrintable(why));
  QTRY_COMPARE(reason->text(), why);
  auto* place = find<QLabel>("bannerPlace");
  QTRY_COMPARE(place->text(), QStringLiteral("Tracker lost - reconnecting"));
  picture(line.startsWith(QLatin1Char('/')) ? "lost-pty" : "lost-tcp");
  QVERIFY(QFontMetrics(place->font()).horizontalAdvance(place->text()) <= place->width());
  QVERIFY2(place->font().pixelSize() >= window_->height() / 20, "to be read from 3 m");
  QCOMPARE(find<QPushButton>("connectButton")->text(), QStringLiteral("Stop reconnecting"));
  for (QLabel* label : {reason, find<QLabel>("deviceState")}) {
    QCOMPARE(label->text(), why);
    QTRY_VERIFY2(isWholeIn(*label), qPrintable(label->objectName()));
  }
  QTest::qWait(2500);  // attempts that fail change nothing of what is said
  QCOMPARE(status().device, acquisition::DeviceState::kFailed);
  QCOMPARE(reason->text(), why);

  plugIn(line);
  QTRY_COMPARE_WITH_TIMEOUT(status().device, acquisition::DeviceState::kRunning, kWaitMs);
  QTRY_COMPARE(message(), QStringLiteral("The tracker is back."));
  QTRY_COMPARE(place->text(), QStringLiteral("Tracker is back"));
  picture("back");
  QTRY_COMPARE_WITH_TIMEOUT(place->text(), QStringLiteral("B1, pipe 1"), kWaitMs);
  QTRY_VERIFY(find<QWidget>("banner")->property("state").toString() != QStringLiteral("danger"));
  QVERIFY(!find<QLabel>("deviceState")->property("failed").toBool());
  QVERIFY(takeRight());
  QCOMPARE(status().recorded->n_done, std::size_t{2});
}

void OperatorTest::theLineIsSavedAndPlaysAgain() {
  auto* save = find<QPushButton>("saveTrace");
  QVERIFY(!save->isEnabled());
  plugIn(QStringLiteral("0"));
  connectTo(emulator_->endpoint().address());
  makePlan(2, 2, 2);
  QVERIFY(takeRight());
  click("step_connect");
  QTRY_VERIFY(save->isEnabled());
  // While it runs, after a fault, and when nothing is connected any more.
  QStringList files;
  for (const char* when : {"running", "lost", "closed"}) {
    if (when == QLatin1String("lost")) pullThePlug();
    if (when == QLatin1String("closed")) {
      click("connectButton");
      QTRY_COMPARE(status().device, acquisition::DeviceState::kClosed);
    }
    QTRY_VERIFY2(save->isEnabled(), when);
    click("saveTrace");
    const QString said = QStringLiteral("are saved: ");
    QTRY_VERIFY2_WITH_TIMEOUT(message().contains(said), qPrintable(message()), kWaitMs);
    files << message().section(said, 1);
    picture(qPrintable(QStringLiteral("saved-") + QLatin1String(when)));
    window_->workbench().endCondition(QStringLiteral("trace"));
  }
  QCOMPARE(QFileInfo(files[0]).absolutePath(), QFileInfo(window_->workbench().sessionPath()).absolutePath());
  const SampleTable taken = window_->workbench().samplesAt(status().session->places[0].node);
  QCOMPARE(taken.rows.size(), std::size_t{60});
  for (const QString& file : files) QVERIFY2(isAmong(taken.rows, playedFrom(file)), qPrintable(file));

  const bool told = [&] {
    const testing::FullDisk full(100);
    click("saveTrace");
    return QTest::qWaitFor([&] { return message().contains(QStringLiteral("are not saved: ")); }, kWaitMs);
  }();
  QVERIFY2(told, qPrintable(message()));
}

void OperatorTest::aTakeLastsAsThePlanSays() {
  plugIn(QStringLiteral("0"));
  connectTo(emulator_->endpoint().address());
  click("step_plan");
  find<QComboBox>("takeUntil")->setCurrentIndex(1);
  QVERIFY(!find<QSpinBox>("samplesPerNode")->isVisible());
  find<QDoubleSpinBox>("takeAmount")->setValue(0.5);
  picture("plan-by-time");
  makePlan(2, 2, 2);
  QVERIFY(takeRight());
  const auto& table = window_->workbench().table();
  QTRY_COMPARE(table.nodes.size(), std::size_t{1});
  // Half a second at 120 a second, both ends; a busy machine moves arrivals.
  QVERIFY2(std::abs(table.nodes[0].n_used + table.nodes[0].n_rejected - 61) <= 4,
           qPrintable(QString::number(table.nodes[0].n_used)));
  // The boxes are of the open session: what is changed there counts for its next take.
  QCOMPARE(find<QComboBox>("takeUntil")->currentIndex(), 1);
  QCOMPARE(find<QDoubleSpinBox>("takeAmount")->value(), 0.5);
  find<QComboBox>("takeUntil")->setCurrentIndex(0);
  find<QSpinBox>("samplesPerNode")->setValue(25);
  QTRY_COMPARE(window_->workbench().status().wanted, 25);
}

void OperatorTest::whatIsNotStoredIsReadFromAfar() {
  plugIn(QStringLiteral("0"));
  connectTo(emulator_->endpoint().address());
  makePlan(2, 2, 2);
  QVERIFY(takeRight());
  const QString here = find<QLabel>("bannerPlace")->text();
  const auto large = [&] { return find<QLabel>("bannerPlace")->text(); };
  {
    const testing::FullDisk full(100);
    QVERIFY(standAt(placeOf(*status().current).position_m));
    QTest::keyClick(window_.get(), Qt::Key_Space);
    QTRY_COMPARE(large(), QStringLiteral("Not stored"));
    QCOMPARE(find<QWidget>("banner")->property("state").toString(), QStringLiteral("danger"));
    QVERIFY(find<QLabel>("bannerPosition")->text().contains(here));
    QVERIFY(find<QLabel>("bannerReason")->text().contains(QStringLiteral("not stored: ")));
  }
  picture("not-stored");
  for (const QPushButton* button : find<QWidget>("messageLine")->findChildren<QPushButton*>())
    QVERIFY(!button->isVisible() || !button->text().isEmpty());
  QVERIFY(takeRight());
  QTRY_VERIFY(large() != QStringLiteral("Not stored") && large() != here);

  // What is on the page is told in the unit that is chosen, at once.
  const QString in_metres = find<QLabel>("bannerPosition")->text();
  setPlacingUnit(LengthUnit::kFoot);
  const QString in_feet = find<QLabel>("bannerPosition")->text();
  setPlacingUnit(LengthUnit::kMetre);
  QVERIFY2(in_metres.endsWith(QStringLiteral(" m")) && in_feet.endsWith(QStringLiteral(" ft")), qPrintable(in_feet));
  QCOMPARE(find<QLabel>("bannerPosition")->text(), in_metres);
}

void OperatorTest::withoutATrackerThePageToConnectIsOffered() {
  plugIn(QStringLiteral("0"));
  connectTo(emulator_->endpoint().address());
  makePlan(2, 2, 2);
  QVERIFY(takeRight());
  window_->workbench().disconnectDevice();
  QTRY_VERIFY(status().device == acquisition::DeviceState::kClosed);
  QTest::keyClick(window_.get(), Qt::Key_Space);
  QTRY_VERIFY2(message().contains(QStringLiteral("The tracker is not connected")), qPrintable(message()));
  auto* connect = find<QWidget>("messageLine")->findChild<QPushButton*>();
  QCOMPARE(connect->text(), QStringLiteral("Connect"));
  QSignalSpy pages(&window_->workbench(), &Workbench::pageRequested);
  QTest::mouseClick(connect, Qt::LeftButton);
  QCOMPARE(pages.size(), 1);
  QCOMPARE(pages[0][0].toString(), QStringLiteral("connect"));
}

}  // namespace fieldtrue::widgets

FIELDTRUE_WINDOW_TEST(fieldtrue::widgets::OperatorTest)
#include "operator_test.moc"
