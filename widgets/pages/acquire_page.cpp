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
#include <QVBoxLayout>
#include <algorithm>

#include "widgets/pages/empty_page.h"
#include "widgets/pages/place_list_model.h"
#include "widgets/pages/units.h"
#include "widgets/views/room_view.h"
#include "widgets/views/sample_ring.h"

namespace fieldtrue {
namespace {

// The operator reads the place from 3 m: its letters are this share of the window's height.
constexpr double kPlaceTextShare = 1.0 / 11.0;
constexpr double kPositionTextShare = 1.0 / 24.0;
constexpr double kReasonTextShare = 1.0 / 28.0;
constexpr int kInspectorWidth = 320;
// Nearer than this the tracker's own error decides what it says of the distance, and the marks on the floor know
// better.
constexpr double kWorthTelling_m = 0.15;

void setPixelHeight(QLabel* label, int pixels) {
  QFont font = label->font();
  if (font.pixelSize() == pixels) return;
  font.setPixelSize(std::max(12, pixels));
  label->setFont(font);
}

SampleRing::State ringState(TakeState take) {
  switch (take) {
    case TakeState::kIdle:
      return SampleRing::State::kIdle;
    case TakeState::kCollecting:
      return SampleRing::State::kCollecting;
    case TakeState::kDone:
      return SampleRing::State::kDone;
    case TakeState::kFailed:
      return SampleRing::State::kFailed;
  }
  return SampleRing::State::kIdle;
}

QString bannerState(const AcquisitionStatus& status) {
  if (status.attention || status.take == TakeState::kFailed) return QStringLiteral("attention");
  if (!status.current) return QStringLiteral("done");
  return status.take == TakeState::kCollecting ? QStringLiteral("collecting") : QStringLiteral("next");
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

  addShortcut(Qt::Key_Space, [this] { workbench_.take(); });
  addShortcut(Qt::Key_PageDown, [this] { workbench_.take(); });
  addShortcut(Qt::Key_Escape, [this] { workbench_.cancelTake(); });
  connect(room_, &RoomView::placeClicked, list_, &QTableView::selectRow);
  connect(&workbench_, &Workbench::sessionChanged, this, &AcquirePage::onSession);
  connect(&workbench_, &Workbench::statusChanged, this, &AcquirePage::onStatus);
  connect(&workbench_, &Workbench::tableChanged, this, [this] { model_->setTable(workbench_.table()); });
}

QWidget* AcquirePage::makeEmpty() {
  return new EmptyPage(tr("No session is open."), tr("Plan where the jig is to stand, or run the demonstration."),
                       {{tr("Make a plan"), [this] { workbench_.goToStep(Step::kPlan); }},
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
  for (QLabel* label : {place_, position_, reason_}) {
    label->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
    texts->addWidget(label);
  }
  layout->addLayout(texts, 1);
  ring_ = new SampleRing(banner_);
  ring_->setObjectName(QStringLiteral("sampleRing"));
  layout->addWidget(ring_);
  return banner_;
}

QPushButton* AcquirePage::addAction(const QString& name, const QString& label, const QString& icon_name,
                                    const QString& keys, std::function<void()> action) {
  auto* button = new QPushButton(icon(icon_name), label, this);
  button->setObjectName(name);
  button->setFocusPolicy(Qt::TabFocus);
  button->setToolTip(keys.isEmpty() ? label : tr("%1 (%2)").arg(label, keys));
  connect(button, &QPushButton::clicked, this, [action] { action(); });
  if (!keys.isEmpty()) addShortcut(QKeySequence(keys.section(QLatin1Char(' '), 0, 0)), action);
  return button;
}

void AcquirePage::addShortcut(const QKeySequence& keys, std::function<void()> action) {
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

  take_ = new QPushButton(icon(QStringLiteral("take"), theme().on_accent), tr("Take  (Space or Page Down)"), inspector);
  take_->setObjectName(QStringLiteral("take"));
  take_->setProperty("primary", true);
  take_->setFocusPolicy(Qt::TabFocus);
  connect(take_, &QPushButton::clicked, this, [this] { workbench_.take(); });
  layout->addWidget(take_);

  undo_ = addAction(QStringLiteral("undo"), tr("Undo"), QStringLiteral("undo"), QStringLiteral("U"),
                    [this] { workbench_.undo(); });
  redo_ = addAction(QStringLiteral("redo"), tr("Redo"), QStringLiteral("redo"), QStringLiteral("Shift+U"),
                    [this] { workbench_.redo(); });
  skip_ = addAction(QStringLiteral("skip"), tr("Skip"), QStringLiteral("skip"), QStringLiteral("S"),
                    [this] { workbench_.skip(); });
  retake_ = addAction(QStringLiteral("retake"), tr("Retake"), QStringLiteral("retake"), QStringLiteral("R"), [this] {
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

void AcquirePage::onSession() {
  const std::vector<PlannedPlace> planned = places(workbench_.plan());
  model_->setPlaces(planned);
  room_->setPlaces(planned);
  states_.clear();
  current_.reset();
  stack_->setCurrentIndex(workbench_.sessionIsOpen() ? 1 : 0);
  retake_->setEnabled(false);
  onStatus(workbench_.status());
  fitText();
}

void AcquirePage::onStatus(const AcquisitionStatus& status) {
  if (status.session_path != workbench_.sessionPath() || status.places.empty()) return;
  if (states_ != status.states || current_ != status.current) {
    states_ = status.states;
    current_ = status.current;
    model_->setStates(states_, current_);
    room_->setStates(states_, current_);
    room_->setJig(current_ ? std::optional<Pose>(status.places[*current_].reference_from_sensor) : std::nullopt);
    if (current_) list_->scrollTo(model_->index(static_cast<int>(*current_), 0), QAbstractItemView::PositionAtCenter);
  }
  room_->setTransmitter(status.reference_from_tracker);
  const bool live = status.live && status.live->status.empty() && status.device == DeviceState::kRunning;
  room_->setLive(live ? std::optional<Pose>(status.reference_from_tracker * status.live->tracker_from_sensor)
                      : std::nullopt);
  showPlace(status);
  showRing(status);
  showButtons(status);
}

void AcquirePage::showPlace(const AcquisitionStatus& status) {
  if (status.current) {
    const PlannedPlace& place = status.places[*status.current];
    const QString name = QString::fromStdString(placeName(place));
    place_->setText(status.current_is_retake ? tr("Retake %1").arg(name) : name);
    QString where = positionText(place.reference_from_sensor.position_m);
    if (status.reference_known && status.distance_m.value_or(0.0) > kWorthTelling_m &&
        status.take != TakeState::kCollecting)
      where += tr("     %1 to go").arg(distanceText(*status.distance_m));
    position_->setText(where);
  } else {
    place_->setText(tr("All places done"));
    position_->setText(tr("%1 taken, %2 skipped").arg(status.n_done).arg(status.n_skipped));
  }
  reason_->setText(status.reason);
  const QString state = bannerState(status);
  if (banner_->property("state").toString() == state) return;
  banner_->setProperty("state", state);
  for (QWidget* widget :
       {banner_, static_cast<QWidget*>(place_), static_cast<QWidget*>(position_), static_cast<QWidget*>(reason_)}) {
    widget->style()->unpolish(widget);
    widget->style()->polish(widget);
  }
  fitText();
}

void AcquirePage::showRing(const AcquisitionStatus& status) {
  ring_->setProgress(status.collected, status.wanted, ringState(status.take));
}

void AcquirePage::showButtons(const AcquisitionStatus& status) {
  const auto total = static_cast<int>(status.places.size());
  const auto handled = static_cast<int>(status.n_done + status.n_skipped);
  progress_->setRange(0, total);
  progress_->setValue(handled);
  counts_->setText(tr("%1 of %2 places done%3")
                       .arg(status.n_done)
                       .arg(total)
                       .arg(status.n_skipped > 0 ? tr(", %1 skipped").arg(status.n_skipped) : QString()));
  const bool running = status.device == DeviceState::kRunning;
  take_->setEnabled(running && status.current && status.take != TakeState::kCollecting);
  skip_->setEnabled(status.current.has_value());
  undo_->setEnabled(status.can_undo);
  redo_->setEnabled(status.can_redo);
  automatic_->setChecked(status.automatic);
}

void AcquirePage::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  fitText();
}

void AcquirePage::fitText() {
  const double window_height = window()->height();
  setPixelHeight(place_, static_cast<int>(window_height * kPlaceTextShare));
  setPixelHeight(position_, static_cast<int>(window_height * kPositionTextShare));
  setPixelHeight(reason_, static_cast<int>(window_height * kReasonTextShare));
  const int ring = static_cast<int>(window_height * 0.17);
  ring_->setFixedSize(ring, ring);
}

}  // namespace fieldtrue
