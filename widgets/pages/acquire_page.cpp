#include "widgets/pages/acquire_page.h"

#include <QHBoxLayout>
#include <QHeaderView>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QResizeEvent>
#include <QShortcut>
#include <QSplitter>
#include <QStackedWidget>
#include <QStyle>
#include <QTableView>
#include <QTimer>
#include <QVBoxLayout>
#include <algorithm>

#include "widgets/forms/empty_page.h"
#include "widgets/forms/held_take.h"
#include "widgets/pages/place_list_model.h"
#include "widgets/style/icons.h"
#include "widgets/style/theme.h"
#include "widgets/style/unit_texts.h"
#include "widgets/views/room/room_view.h"
#include "widgets/views/room/sample_ring.h"

namespace fieldtrue::widgets {
namespace {

// The operator reads the place from 3 m: its letters are this share of the window's height.
constexpr double kPlaceTextShare = 1.0 / 11.0;
constexpr double kPositionTextShare = 1.0 / 24.0;
constexpr double kReasonTextShare = 1.0 / 28.0;
constexpr double kToGoTextShare = 1.0 / 15.0;
constexpr double kReasonHeightShare = 1.0 / 14.0;  ///< One line to read from afar, or two or three for a long reason.
constexpr int kSmallestReason = 12;                ///< Pixels; of a place's name too.
// How much of the way to a new guess of the transmitter's place is gone with each status, some thirty a second.
constexpr double kEase = 0.15;
constexpr int kInspectorWidth = 320;
constexpr int kNarrowestColumn = 42;   ///< Of the list of places: what Qt deems enough cuts "Out".
constexpr std::size_t kMostLines = 4;  ///< Of sensors; more stand side by side.
// Nearer than this the tracker's own error decides what it says of the distance, and the marks on the floor know
// better.
constexpr double kWorthTelling_m = 0.15;

void setPixelHeight(QLabel* label, int pixels) {
  QFont font = label->font();
  if (font.pixelSize() == pixels) return;
  font.setPixelSize(std::max(12, pixels));
  label->setFont(font);
}

SampleRing::State ringState(acquisition::TakeState take) {
  switch (take) {
    case acquisition::TakeState::kIdle:
      return SampleRing::State::kIdle;
    case acquisition::TakeState::kCollecting:
      return SampleRing::State::kCollecting;
    case acquisition::TakeState::kDone:
      return SampleRing::State::kDone;
    case acquisition::TakeState::kHeld:
    case acquisition::TakeState::kFailed:
      return SampleRing::State::kFailed;
  }
  return SampleRing::State::kIdle;
}

QString bannerState(const acquisition::AcquisitionStatus& status) {
  if (status.device == acquisition::DeviceState::kFailed || status.not_stored) return QStringLiteral("danger");
  if (status.attention || status.take == acquisition::TakeState::kFailed) return QStringLiteral("attention");
  if (!status.current) return QStringLiteral("done");
  return status.take == acquisition::TakeState::kCollecting ? QStringLiteral("collecting") : QStringLiteral("next");
}

/// A take runs, or is held.
bool takes(const acquisition::AcquisitionStatus& status) {
  return status.take == acquisition::TakeState::kCollecting || status.take == acquisition::TakeState::kHeld;
}

/// Nothing is left to take, and something was taken: the methods can be compared.
bool isDone(const acquisition::AcquisitionStatus& status) { return !status.current && status.recorded->n_done > 0; }

/// More sensors than there is room for below each other.
bool standSideBySide(const acquisition::AcquisitionStatus& status) { return status.sensors.size() > kMostLines; }

/// Its cells in the table of sensors.
QString sensorCells(const acquisition::SensorProgress& one, const acquisition::AcquisitionStatus& status) {
  const bool leads = one.sensor == status.sensors.front().sensor;
  const QString name =
      leads ? AcquirePage::tr("Sensor %1, leads").arg(one.sensor) : AcquirePage::tr("Sensor %1").arg(one.sensor);
  QString doing = AcquirePage::tr("ready");
  if (takes(status))
    doing = (standSideBySide(status) ? QStringLiteral("%1/%2") : AcquirePage::tr("%1 of %2"))
                .arg(one.collected)
                .arg(one.wanted);
  if (status.device != acquisition::DeviceState::kRunning) doing = QStringLiteral("-");
  if (one.silent) doing = AcquirePage::tr("silent");
  const QString color = one.silent ? QStringLiteral(" style='color:%1'").arg(theme().attention.name()) : QString();
  return QStringLiteral("<td%1>%2</td><td%1 align='right'>%3</td>").arg(color, name, doing);
}

Pose eased(const Pose& from, const Pose& to) {
  return {from.position_m + kEase * (to.position_m - from.position_m), from.orientation.slerp(kEase, to.orientation)};
}

}  // namespace

AcquirePage::AcquirePage(Workbench& workbench, QWidget* parent) : QWidget(parent), workbench_(workbench) {
  auto* content = new QWidget(this);
  auto* rows = new QVBoxLayout(content);
  rows->setContentsMargins(0, 0, 0, 0);
  rows->setSpacing(0);
  rows->addWidget(makeBanner());
  auto* splitter = new QSplitter(content);
  room_ = new RoomView(splitter);
  room_->setObjectName(QStringLiteral("roomView"));
  splitter->addWidget(room_);
  splitter->addWidget(makeInspector());
  splitter->setStretchFactor(0, 1);
  splitter->setSizes({960, kInspectorWidth});
  rows->addWidget(splitter, 1);

  stack_ = new QStackedWidget(this);
  stack_->addWidget(makeEmpty());
  stack_->addWidget(content);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(stack_);

  addShortcut(Qt::Key_Space, [this] { onTakeKey(); });
  addShortcut(Qt::Key_PageDown, [this] { onTakeKey(); });
  for (const Qt::Key key : {Qt::Key_W, Qt::Key_PageUp}) addShortcut(key, [this] { held_->waitKey(); });
  addShortcut(Qt::Key_Escape, [this] { workbench_.cancelTake(); });
  connect(room_, &RoomView::placeClicked, list_, &QTableView::selectRow);
  connect(&workbench_, &Workbench::sessionChanged, this, &AcquirePage::onSession);
  connect(&workbench_, &Workbench::statusChanged, this, &AcquirePage::onStatus);
  connect(&placingUnitNotifier(), &PlacingUnitNotifier::placingUnitChanged, this,
          [this] { onStatus(workbench_.status()); });
  connect(&workbench_, &Workbench::tableChanged, this, [this] { model_->setTable(workbench_.recordedTable()); });
}

QWidget* AcquirePage::makeEmpty() {
  return new EmptyPage(tr("No session is open."), tr("Plan where the jig is to stand, or run the demonstration."),
                       {{tr("Make a plan"), [this] { workbench_.goToPage(QStringLiteral("plan")); }},
                        {tr("Run the demonstration"), [this] { workbench_.startDemonstration(); }}},
                       this);
}

QWidget* AcquirePage::makeBanner() {
  banner_ = new QWidget(this);
  banner_->setObjectName(QStringLiteral("banner"));
  banner_->setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QHBoxLayout(banner_);
  layout->setContentsMargins(24, 8, 24, 8);
  auto* texts = new QVBoxLayout;
  texts->setSpacing(0);
  place_ = new QLabel(banner_);
  place_->setObjectName(QStringLiteral("bannerPlace"));
  position_ = new QLabel(banner_);
  position_->setObjectName(QStringLiteral("bannerPosition"));
  reason_ = new QLabel(banner_);
  reason_->setObjectName(QStringLiteral("bannerReason"));
  reason_->setWordWrap(true);
  for (QLabel* label : {place_, position_, reason_}) {
    label->setSizePolicy(QSizePolicy::Ignored, label == reason_ ? QSizePolicy::Fixed : QSizePolicy::Preferred);
    texts->addWidget(label);
  }
  place_->installEventFilter(this);
  held_ = new HeldTake(workbench_, banner_);
  texts->addWidget(held_);
  layout->addLayout(texts, 1);
  auto* distance = new QVBoxLayout;
  distance->setSpacing(0);
  to_go_ = new QLabel(banner_);
  to_go_->setObjectName(QStringLiteral("bannerToGo"));
  to_go_caption_ = new QLabel(tr("to go"), banner_);
  to_go_caption_->setObjectName(QStringLiteral("bannerToGoCaption"));
  distance->addStretch();
  for (QLabel* label : {to_go_, to_go_caption_}) {
    label->setAlignment(Qt::AlignRight);
    label->hide();
    distance->addWidget(label);
  }
  distance->addStretch();
  layout->addLayout(distance);
  layout->addSpacing(16);
  ring_ = new SampleRing(banner_);
  ring_->setObjectName(QStringLiteral("sampleRing"));
  layout->addWidget(ring_);
  return banner_;
}

QPushButton* AcquirePage::addAction(const QString& name, const QString& label, const QString& icon_name,
                                    const QString& keys, const std::function<void()>& action) {
  auto* button = new QPushButton(icon(icon_name), label, this);
  button->setObjectName(name);
  button->setFocusPolicy(Qt::TabFocus);
  button->setToolTip(keys.isEmpty() ? label : tr("%1 (%2)").arg(label, keys));
  connect(button, &QPushButton::clicked, this, [action] { action(); });
  if (!keys.isEmpty()) addShortcut(QKeySequence(keys.section(QLatin1Char(' '), 0, 0)), action);
  return button;
}

void AcquirePage::addShortcut(const QKeySequence& keys, const std::function<void()>& action) {
  auto* shortcut = new QShortcut(keys, this);
  shortcut->setContext(Qt::WindowShortcut);
  shortcut->setAutoRepeat(false);
  connect(shortcut, &QShortcut::activated, this, [action] { action(); });
}

QWidget* AcquirePage::makeInspector() {
  auto* inspector = new QWidget(this);
  inspector->setObjectName(QStringLiteral("inspector"));
  inspector->setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QVBoxLayout(inspector);
  layout->setContentsMargins(12, 12, 12, 12);
  layout->setSpacing(8);

  counts_ = new QLabel(inspector);
  counts_->setObjectName(QStringLiteral("counts"));
  progress_ = new QProgressBar(inspector);
  progress_->setTextVisible(false);
  progress_->setAccessibleName(tr("Places done"));
  layout->addWidget(counts_);
  layout->addWidget(progress_);
  sensors_ = new QLabel(inspector);
  sensors_->setObjectName(QStringLiteral("sensorLines"));
  sensors_->setAccessibleName(tr("Sensors recorded"));
  sensors_->hide();
  layout->addWidget(sensors_);

  take_ = new QPushButton(icon(QStringLiteral("take"), theme().on_accent), tr("Take  (Space or Page Down)"), inspector);
  take_->setObjectName(QStringLiteral("take"));
  take_->setProperty("primary", true);
  take_->setFocusPolicy(Qt::TabFocus);
  connect(take_, &QPushButton::clicked, this, &AcquirePage::takeOrGoOn);
  layout->addWidget(take_);

  undo_ = addAction(QStringLiteral("undo"), tr("Undo"), QStringLiteral("undo"), QStringLiteral("U"),
                    [this] { workbench_.undo(); });
  redo_ = addAction(QStringLiteral("redo"), tr("Redo"), QStringLiteral("redo"), QStringLiteral("Shift+U"),
                    [this] { workbench_.redo(); });
  skip_ = addAction(QStringLiteral("skip"), tr("Skip"), QStringLiteral("skip"), QStringLiteral("S"),
                    [this] { workbench_.skip(); });
  retake_ = addAction(QStringLiteral("retake"), tr("Retake"), QStringLiteral("retake"), QStringLiteral("R"), [this] {
    if (held_->againKey()) return;
    const QModelIndex row = list_->currentIndex();
    if (row.isValid()) workbench_.goTo(row.row());
  });
  auto* grid = new QGridLayout;
  grid->setSpacing(8);
  grid->addWidget(undo_, 0, 0);
  grid->addWidget(redo_, 0, 1);
  grid->addWidget(skip_, 1, 0);
  grid->addWidget(retake_, 1, 1);
  layout->addLayout(grid);

  automatic_ = new QPushButton(icon(QStringLiteral("auto")), tr("Take by itself when still"), inspector);
  automatic_->setObjectName(QStringLiteral("automatic"));
  automatic_->setCheckable(true);
  automatic_->setFocusPolicy(Qt::TabFocus);
  automatic_->setToolTip(tr("Takes a place as soon as the sensor stands still there (A)"));
  connect(automatic_, &QPushButton::clicked, this, [this](bool on) { workbench_.setAutomatic(on); });
  addShortcut(Qt::Key_A, [this] { automatic_->click(); });
  layout->addWidget(automatic_);

  model_ = new PlaceListModel(this);
  list_ = new QTableView(inspector);
  list_->setObjectName(QStringLiteral("placeList"));
  list_->setModel(model_);
  list_->setSelectionBehavior(QAbstractItemView::SelectRows);
  list_->setSelectionMode(QAbstractItemView::SingleSelection);
  list_->setShowGrid(false);
  list_->verticalHeader()->hide();
  list_->horizontalHeader()->setHighlightSections(false);
  list_->horizontalHeader()->setMinimumSectionSize(kNarrowestColumn);
  list_->horizontalHeader()->setSectionResizeMode(QHeaderView::ResizeToContents);
  list_->horizontalHeader()->setSectionResizeMode(0, QHeaderView::Stretch);
  connect(list_, &QTableView::doubleClicked, this, [this](const QModelIndex& row) { workbench_.goTo(row.row()); });
  connect(list_->selectionModel(), &QItemSelectionModel::currentRowChanged, this, [this](const QModelIndex& row) {
    room_->setSelected(row.isValid() ? std::optional<int>(row.row()) : std::nullopt);
    retake_->setEnabled(row.isValid());
  });
  layout->addWidget(list_, 1);
  inspector->setMinimumWidth(kInspectorWidth);
  return inspector;
}

void AcquirePage::onTakeKey() {
  if (!held_->takeKey()) takeOrGoOn();
}

void AcquirePage::takeOrGoOn() {
  const acquisition::AcquisitionStatus& status = workbench_.status();
  if (isDone(status) && status.session->path == workbench_.sessionPath())
    workbench_.goToPage(QStringLiteral("compare"));
  else
    workbench_.take();
}

void AcquirePage::onSession() {
  const std::vector<PlannedPlace> planned = places(workbench_.plan());
  model_->setPlaces(planned);
  room_->setPlaces(planned);
  states_.clear();
  current_.reset();
  shown_reference_.reset();
  stack_->setCurrentIndex(workbench_.sessionIsOpen() ? 1 : 0);
  retake_->setEnabled(false);
  onStatus(workbench_.status());
  fitText();
}

void AcquirePage::onStatus(const acquisition::AcquisitionStatus& status) {
  if (status.session->path != workbench_.sessionPath() || status.session->places.empty()) return;
  if (states_ != status.recorded->states || current_ != status.current) {
    states_ = status.recorded->states;
    current_ = status.current;
    model_->setStates(states_, current_);
    room_->setStates(states_, current_);
    room_->setJig(current_ ? std::optional<Pose>(status.session->places[*current_].reference_from_sensor)
                           : std::nullopt);
    showCurrentRow();
  }
  model_->setMisfits(status.recorded->misfits);
  shown_reference_ =
      shown_reference_ ? eased(*shown_reference_, status.reference_from_tracker) : status.reference_from_tracker;
  room_->setTransmitter(*shown_reference_);
  const bool live = status.live && status.live->status.empty() && status.device == acquisition::DeviceState::kRunning;
  room_->setLive(live ? std::optional<Pose>(*shown_reference_ * status.live->tracker_from_sensor) : std::nullopt);
  showPlace(status);
  showRing(status);
  showSensors(status);
  showButtons(status);
}

void AcquirePage::showCurrentRow() {
  if (current_) list_->scrollTo(model_->index(static_cast<int>(*current_), 0), QAbstractItemView::PositionAtCenter);
}

void AcquirePage::showEvent(QShowEvent* event) {
  QWidget::showEvent(event);
  // What was scrolled while the page was hidden had no height.
  QTimer::singleShot(0, this, &AcquirePage::showCurrentRow);
}

void AcquirePage::showPlace(const acquisition::AcquisitionStatus& status) {
  QString name = tr("All places done");
  QString detail = tr("%1 taken, %2 skipped").arg(status.recorded->n_done).arg(status.recorded->n_skipped);
  if (status.current) {
    const PlannedPlace& place = status.session->places[*status.current];
    const QString plain = QString::fromStdString(placeName(place));
    name = status.current_is_retake ? tr("Retake %1").arg(plain) : plain;
    detail = positionText(place.reference_from_sensor.position_m);
    if (status.current_is_retake && !takes(status)) detail = tr("%1   Esc keeps it as it is").arg(detail);
  }
  if (status.reconnecting || status.just_returned) {
    detail = status.current ? tr("next: %1").arg(name) : name;
    name = status.reconnecting ? tr("Tracker lost - reconnecting") : tr("Tracker is back");
  }
  if (status.take == acquisition::TakeState::kHeld) {
    detail = tr("at %1").arg(name);
    name = tr("Time is up - what now?");
  }
  if (status.not_stored) {
    detail = tr("at %1").arg(name);
    name = tr("Not stored");
  }
  place_->setText(name);
  position_->setText(detail);
  showDistance(status);
  fitPlace();
  const QString reason = isDone(status) && !status.attention ? tr("Next: compare the methods") : status.reason;
  if (reason_->text() != reason) {
    reason_->setText(reason);
    reason_->setToolTip(reason);
    fitReason();
  }
  const QString state = bannerState(status);
  if (banner_->property("state").toString() == state) return;
  banner_->setProperty("state", state);
  for (QWidget* widget :
       {banner_, static_cast<QWidget*>(place_), static_cast<QWidget*>(position_), static_cast<QWidget*>(reason_)})
    restyle(*widget);
  fitText();
}

void AcquirePage::showDistance(const acquisition::AcquisitionStatus& status) {
  const bool far = status.distance_known && status.distance_m.value_or(0.0) > kWorthTelling_m;
  const bool shown = status.current && far && !takes(status);
  to_go_->setVisible(shown);
  to_go_caption_->setVisible(shown);
  if (!shown) return;
  to_go_->setText(distanceText(*status.distance_m));
  if (setStyled(*to_go_, "away", status.away)) fitText();
}

void AcquirePage::fitPlace() {
  QFont font = place_->font();
  int pixels = static_cast<int>(window()->height() * kPlaceTextShare);
  const auto fits = [&] {
    font.setPixelSize(pixels);
    return QFontMetrics(font).horizontalAdvance(place_->text()) <= place_->width();
  };
  while (pixels > kSmallestReason && !fits()) --pixels;
  setPixelHeight(place_, pixels);
}

void AcquirePage::fitReason() {
  const int height = static_cast<int>(window()->height() * kReasonHeightShare);
  reason_->setFixedHeight(height);
  QFont font = reason_->font();
  int pixels = static_cast<int>(window()->height() * kReasonTextShare);
  const auto fits = [&] {
    font.setPixelSize(pixels);
    return QFontMetrics(font).boundingRect(0, 0, reason_->width(), 10000, Qt::TextWordWrap, reason_->text()).height() <=
           height;
  };
  while (pixels > kSmallestReason && !fits()) --pixels;
  setPixelHeight(reason_, pixels);
}

void AcquirePage::showRing(const acquisition::AcquisitionStatus& status) {
  ring_->setProgress(status.collected, status.wanted, ringState(status.take));
}

void AcquirePage::showSensors(const acquisition::AcquisitionStatus& status) {
  sensors_->setVisible(status.sensors.size() > 1);
  if (status.sensors.size() < 2) return;
  const std::size_t in_a_row = standSideBySide(status) ? 2 : 1;
  QString cells;
  for (std::size_t i = 0; i < status.sensors.size(); ++i) {
    if (i % in_a_row > 0) cells += QStringLiteral("<td width='16'></td>");
    if (i > 0 && i % in_a_row == 0) cells += QStringLiteral("</tr><tr>");
    cells += sensorCells(status.sensors[i], status);
  }
  sensors_->setText(QStringLiteral("<table width='100%'><tr>%1</tr></table>").arg(cells));
}

void AcquirePage::showButtons(const acquisition::AcquisitionStatus& status) {
  const auto total = static_cast<int>(status.session->places.size());
  const auto handled = static_cast<int>(status.recorded->n_done + status.recorded->n_skipped);
  progress_->setRange(0, total);
  progress_->setValue(handled);
  counts_->setText(
      tr("%1 of %2 places done%3")
          .arg(status.recorded->n_done)
          .arg(total)
          .arg(status.recorded->n_skipped > 0 ? tr(", %1 skipped").arg(status.recorded->n_skipped) : QString()));
  const bool running = status.device == acquisition::DeviceState::kRunning;
  const bool is_done = isDone(status);
  take_->setText(is_done ? tr("Compare  (Space or Page Down)") : tr("Take  (Space or Page Down)"));
  take_->setEnabled(is_done || (running && status.current && !takes(status)));
  skip_->setEnabled(status.current.has_value());
  undo_->setEnabled(status.recorded->can_undo);
  redo_->setEnabled(status.recorded->can_redo);
  automatic_->setChecked(status.automatic);
  automatic_->setText(status.automatic ? tr("Takes by itself when still: on") : tr("Take by itself when still"));
}

bool AcquirePage::eventFilter(QObject* watched, QEvent* event) {
  // A page that was hidden gets its width when it is shown, and its letters follow.
  if (event->type() == QEvent::Resize) {
    const auto* resized = static_cast<QResizeEvent*>(event);
    if (resized->size().width() != resized->oldSize().width()) fitText();
  }
  return QWidget::eventFilter(watched, event);
}

void AcquirePage::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  fitText();
}

void AcquirePage::fitText() {
  const double window_height = window()->height();
  setPixelHeight(position_, static_cast<int>(window_height * kPositionTextShare));
  setPixelHeight(to_go_, static_cast<int>(window_height * kToGoTextShare));
  setPixelHeight(to_go_caption_, static_cast<int>(window_height * kReasonTextShare));
  held_->setLetters(static_cast<int>(window_height * kReasonTextShare));
  fitPlace();
  fitReason();
  const int ring = static_cast<int>(window_height * 0.17);
  ring_->setFixedSize(ring, ring);
}

}  // namespace fieldtrue::widgets
