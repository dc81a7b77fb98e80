#include "widgets/pages/device_strip.h"

#include <QFileInfo>
#include <QHBoxLayout>
#include <QLabel>
#include <QPainter>
#include <QPixmap>

#include "widgets/pages/units.h"
#include "widgets/views/theme.h"

namespace fieldtrue {
namespace {

// Filled = recording, ring = connected, nothing = no tracker; red only when it is lost.
QPixmap lightPicture(DeviceState device, bool recording, qreal ratio) {
  QPixmap picture(QSize(16, 16) * ratio);
  picture.setDevicePixelRatio(ratio);
  picture.fill(Qt::transparent);
  QPainter painter(&picture);
  painter.setRenderHint(QPainter::Antialiasing);
  const QColor color = device == DeviceState::kFailed    ? theme().danger
                       : device == DeviceState::kRunning ? theme().done
                                                         : theme().text_muted;
  painter.setPen(QPen(color, 2));
  if (recording || device == DeviceState::kFailed) painter.setBrush(color);
  painter.drawEllipse(QRectF(3, 3, 10, 10));
  return picture;
}

}  // namespace

DeviceStrip::DeviceStrip(QWidget* parent) : QWidget(parent) {
  setObjectName(QStringLiteral("deviceStrip"));
  setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QHBoxLayout(this);
  layout->setContentsMargins(12, 4, 12, 4);
  layout->setSpacing(20);
  light_ = new QLabel(this);
  state_ = new QLabel(this);
  rate_ = new QLabel(this);
  noise_ = new QLabel(this);
  pose_ = new QLabel(this);
  session_ = new QLabel(this);
  layout->addWidget(light_);
  layout->addWidget(state_);
  layout->addWidget(rate_);
  layout->addWidget(noise_);
  layout->addWidget(pose_);
  layout->addStretch();
  layout->addWidget(session_);
  setStatus({});
}

void DeviceStrip::setStatus(const AcquisitionStatus& status) {
  const bool running = status.device == DeviceState::kRunning;
  light_->setPixmap(lightPicture(status.device, status.take == TakeState::kCollecting, devicePixelRatioF()));
  state_->setText(status.device == DeviceState::kClosed ? tr("No tracker connected") : status.device_text);
  light_->setAccessibleName(state_->text());
  for (QLabel* label : {rate_, noise_, pose_}) label->setVisible(running && status.live.has_value());
  session_->setText(status.session_path.isEmpty() ? QString() : QFileInfo(status.session_path).fileName());
  if (!running || !status.live) return;
  rate_->setText(tr("%1 Hz").arg(status.rate_hz, 0, 'f', 0));
  noise_->setText(tr("SD now %1").arg(errorText(status.sd_m)));
  const Eigen::Vector3d p_reference_m = status.reference_from_tracker * status.live->tracker_from_sensor.position_m;
  pose_->setText(positionText(p_reference_m));
}

}  // namespace fieldtrue
