#include "widgets/shell/device_strip.h"

#include <QFileInfo>
#include <QHBoxLayout>
#include <QLabel>
#include <QPainter>
#include <QPixmap>
#include <QStyle>
#include <algorithm>

#include "widgets/style/theme.h"
#include "widgets/style/unit_texts.h"

namespace fieldtrue::widgets {
namespace {

// Filled = recording, ring = connected, nothing = no tracker; red only when it is lost.
QPixmap lightPicture(acquisition::DeviceState device, bool recording, qreal ratio) {
  QPixmap picture(QSize(16, 16) * ratio);
  picture.setDevicePixelRatio(ratio);
  picture.fill(Qt::transparent);
  QPainter painter(&picture);
  painter.setRenderHint(QPainter::Antialiasing);
  const QColor color = device == acquisition::DeviceState::kFailed    ? theme().danger
                       : device == acquisition::DeviceState::kRunning ? theme().done
                                                                      : theme().text_muted;
  painter.setPen(QPen(color, 2));
  if (recording || device == acquisition::DeviceState::kFailed) painter.setBrush(color);
  painter.drawEllipse(QRectF(3, 3, 10, 10));
  return picture;
}

/// A number that changes many times a second neither moves what stands beside it nor is cut before there is room.
void setSteadyText(QLabel& label, const QString& text) {
  label.setText(text);
  label.setMinimumWidth(std::max(label.minimumWidth(), label.sizeHint().width()));
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
  state_->setObjectName(QStringLiteral("deviceState"));
  layout->addWidget(light_);
  layout->addWidget(state_);
  layout->addWidget(rate_);
  layout->addWidget(noise_);
  layout->addWidget(pose_);
  layout->addStretch();
  layout->addWidget(session_);
  setStatus({});
}

void DeviceStrip::setStatus(const acquisition::AcquisitionStatus& status) {
  const bool running = status.device == acquisition::DeviceState::kRunning;
  light_->setPixmap(
      lightPicture(status.device, status.take == acquisition::TakeState::kCollecting, devicePixelRatioF()));
  state_->setText(status.device == acquisition::DeviceState::kClosed ? tr("No tracker connected") : status.device_text);
  light_->setAccessibleName(state_->text());
  state_->setToolTip(state_->text());
  // Why a tracker is lost may be long: it has the whole strip, in lines.
  const bool failed = status.device == acquisition::DeviceState::kFailed;
  state_->setWordWrap(failed);
  static_cast<QHBoxLayout*>(layout())->setStretchFactor(state_, failed ? 1 : 0);
  setStyled(*state_, "failed", failed);
  for (QLabel* label : {rate_, noise_, pose_}) label->setVisible(running && status.live.has_value());
  session_->setText(status.session->path.isEmpty() ? QString() : QFileInfo(status.session->path).fileName());
  if (!running || !status.live) return;
  setSteadyText(*rate_, tr("%1 Hz").arg(status.rate_hz, 0, 'f', 0));
  setSteadyText(*noise_, tr("SD now %1").arg(millimetreText(status.sd_m)));
  const Eigen::Vector3d p_reference_m = status.reference_from_tracker * status.live->tracker_from_sensor.position_m;
  setSteadyText(*pose_, tr("rig: %1").arg(positionText(p_reference_m)));
}

}  // namespace fieldtrue::widgets
