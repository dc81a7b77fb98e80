#include "widgets/forms/recorded_sensors.h"

#include <QCheckBox>
#include <QComboBox>
#include <QGridLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QVBoxLayout>
#include <algorithm>
#include <set>
#include <vector>

#include "acquisition/session/recorded_sensors.h"
#include "widgets/style/theme.h"
#include "widgets/workbench/workbench.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kBoxesInARow = 6;

/// Those that report, and those that are recorded whether they do or not.
std::vector<int> knownSensors(const acquisition::AcquisitionStatus& status) {
  std::set<int> sensors(status.reporting.begin(), status.reporting.end());
  for (const acquisition::SensorProgress& one : status.sensors) sensors.insert(one.sensor);
  sensors.insert(status.of_session.begin(), status.of_session.end());
  return {sensors.begin(), sensors.end()};
}

/// Once places are taken one that is dead may be left out, and taken in again.
bool mayChange(const acquisition::AcquisitionStatus& status, int sensor, const acquisition::SensorProgress* recorded) {
  if (recorded && status.sensors.size() == 1) return false;
  if (!status.takes_settle_sensors || (recorded && recorded->silent)) return true;
  return !recorded && acquisition::isAmong(sensor, status.of_session);
}

}  // namespace

RecordedSensors::RecordedSensors(Workbench& workbench, QWidget* parent) : QWidget(parent), workbench_(workbench) {
  setObjectName(QStringLiteral("recordedSensors"));
  auto* rows = new QVBoxLayout(this);
  rows->setContentsMargins(0, 0, 0, 0);
  rows->addWidget(new QLabel(tr("Recorded sensors"), this));
  grid_ = new QGridLayout;
  rows->addLayout(grid_);
  leader_ = new QComboBox(this);
  leader_->setObjectName(QStringLiteral("leadingSensor"));
  leader_->setAccessibleName(tr("Leading sensor"));
  leader_->setToolTip(tr("By it rest, the distance to go and the place are judged."));
  auto* leader_row = new QHBoxLayout;
  leader_row->addWidget(new QLabel(tr("Leads"), this));
  leader_row->addWidget(leader_);
  leader_row->addStretch();
  rows->addLayout(leader_row);
  connect(leader_, &QComboBox::activated, this, [this] { lead(leader_->currentData().toInt()); });
  hint_ = new QLabel(this);
  hint_->setObjectName(QStringLiteral("recordedSensorsHint"));
  hint_->setProperty("role", "muted");
  hint_->setWordWrap(true);
  rows->addWidget(hint_);
  hide();
  connect(&workbench_, &Workbench::statusChanged, this, &RecordedSensors::onStatus);
}

void RecordedSensors::onStatus(const acquisition::AcquisitionStatus& status) {
  const std::vector<int> sensors = knownSensors(status);
  const bool shown =
      status.device == acquisition::DeviceState::kRunning && sensors.size() > 1 && !status.sensors.empty();
  setVisible(shown);
  if (!shown) return;
  const bool same = std::equal(boxes_.begin(), boxes_.end(), sensors.begin(), sensors.end(),
                               [](const auto& box, int sensor) { return box.first == sensor; });
  if (!same) makeBoxes(sensors);
  for (const auto& [sensor, box] : boxes_) {
    const auto is_it = [of = sensor](const acquisition::SensorProgress& one) { return one.sensor == of; };
    const auto recorded = std::find_if(status.sensors.begin(), status.sensors.end(), is_it);
    const bool is_recorded = recorded != status.sensors.end();
    box->setChecked(is_recorded);
    box->setEnabled(mayChange(status, sensor, is_recorded ? &*recorded : nullptr));
    const bool is_silent = is_recorded && recorded->silent;
    setStyled(*box, "silent", is_silent);
    box->setText(is_silent ? tr("Sensor %1, silent").arg(sensor) : tr("Sensor %1").arg(sensor));
  }
  showLeader(status);
  hint_->setText(
      status.takes_settle_sensors
          ? tr("The places of this session were taken by these. One that is silent may be left out from here on.")
          : tr("Those ticked are recorded at every place, at once. Sensor %1 leads: by it rest and place are judged.")
                .arg(status.sensors.front().sensor));
}

void RecordedSensors::makeBoxes(const std::vector<int>& sensors) {
  for (const auto& [sensor, box] : boxes_) box->deleteLater();
  boxes_.clear();
  for (const int sensor : sensors) {
    auto* box = new QCheckBox(this);
    box->setObjectName(QStringLiteral("recordSensor%1").arg(sensor));
    const int n = static_cast<int>(boxes_.size());
    grid_->addWidget(box, n / kBoxesInARow, n % kBoxesInARow, Qt::AlignLeft);
    connect(box, &QCheckBox::clicked, this, [this, sensor](bool recorded) { choose(sensor, recorded); });
    boxes_[sensor] = box;
  }
}

void RecordedSensors::showLeader(const acquisition::AcquisitionStatus& status) {
  std::vector<int> recorded, listed;
  for (const acquisition::SensorProgress& one : status.sensors) recorded.push_back(one.sensor);
  const int leading = recorded.front();
  std::sort(recorded.begin(), recorded.end());
  for (int i = 0; i < leader_->count(); ++i) listed.push_back(leader_->itemData(i).toInt());
  if (listed != recorded) {
    leader_->clear();
    for (const int sensor : recorded) leader_->addItem(tr("Sensor %1").arg(sensor), sensor);
  }
  leader_->setCurrentIndex(leader_->findData(leading));
  // The takes of a session were led by it.
  leader_->setEnabled(!status.takes_settle_sensors && recorded.size() > 1);
}

void RecordedSensors::choose(int sensor, bool recorded) {
  std::vector<int> sensors;
  for (const acquisition::SensorProgress& one : workbench_.status().sensors)
    if (one.sensor != sensor) sensors.push_back(one.sensor);
  // One that was chosen to lead goes on leading; else the lowest does.
  const bool is_led_by_choice = !sensors.empty() && sensors.front() == workbench_.status().sensors.front().sensor &&
                                sensors.front() != *std::min_element(sensors.begin(), sensors.end());
  if (recorded) sensors.push_back(sensor);
  std::sort(sensors.begin() + (is_led_by_choice ? 1 : 0), sensors.end());
  record(sensors);
}

void RecordedSensors::lead(int sensor) {
  std::vector<int> sensors{sensor};
  for (const acquisition::SensorProgress& one : workbench_.status().sensors)
    if (one.sensor != sensor) sensors.push_back(one.sensor);
  std::sort(sensors.begin() + 1, sensors.end());
  record(sensors);
}

void RecordedSensors::record(const std::vector<int>& sensors) {
  // All that there are, led as they are by themselves: one that is plugged in later is recorded too.
  const bool all = sensors.size() == boxes_.size() && std::is_sorted(sensors.begin(), sensors.end());
  workbench_.setSensors(all ? std::vector<int>() : sensors);
}

}  // namespace fieldtrue::widgets
