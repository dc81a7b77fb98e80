#include "widgets/pages/plan_page.h"

#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFileDialog>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QRegularExpressionValidator>
#include <QScrollArea>
#include <QSpinBox>
#include <QSplitter>
#include <QVBoxLayout>
#include <cmath>
#include <limits>
#include <set>

#include "acquisition/plan/plan_text.h"
#include "calib/evaluation/orientation/planned_orientations.h"
#include "widgets/forms/length_box.h"
#include "widgets/forms/number_box.h"
#include "widgets/style/unit_texts.h"
#include "widgets/style/units.h"
#include "widgets/views/room/room_view.h"

namespace fieldtrue::widgets {
namespace {

constexpr std::array kAxes{"x", "y", "z"};
constexpr int kFormWidth = 360;
constexpr int kScrollBarWidth = 14;
constexpr int kMaxCount = 40;
// A practised operator carries the jig to the next mark and lets it settle in about this time.
constexpr double kWidest_m = 30.0;  ///< What tables are refused for too.
constexpr double kSecondsPerPlacement = 15.0;
constexpr double kSamplesPerSecond = 120.0;
constexpr std::int64_t kBuiltAtOnce = 2000;  ///< Stops that take a few milliseconds.

/// About how long a take lasts; one until its mean is known lasts as long as it must.
double secondsOf(const acquisition::TakeLength& length) {
  if (length.until == acquisition::TakeLength::Until::kSamples) return length.amount / kSamplesPerSecond;
  return length.until == acquisition::TakeLength::Until::kSeconds ? length.amount : 1.0;
}

QWidget* inRow(std::initializer_list<QWidget*> widgets) {
  auto* row = new QWidget;
  auto* layout = new QHBoxLayout(row);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(4);
  for (QWidget* widget : widgets) layout->addWidget(widget, 1);
  return row;
}

}  // namespace

PlanPage::PlanPage(Workbench& workbench, QWidget* parent)
    : QWidget(parent), workbench_(workbench), shown_unit_(placingUnit()) {
  auto* layout = new QHBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  auto* splitter = new QSplitter(this);
  room_ = new RoomView(splitter);
  room_->setObjectName(QStringLiteral("planView"));
  auto* scroll = new QScrollArea(splitter);
  scroll->setWidgetResizable(true);
  scroll->setFrameShape(QFrame::NoFrame);
  scroll->setWidget(makeForm());
  scroll->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  scroll->setMinimumWidth(std::max(kFormWidth, scroll->widget()->minimumSizeHint().width() + kScrollBarWidth));
  splitter->addWidget(room_);
  splitter->addWidget(scroll);
  splitter->setStretchFactor(0, 1);
  splitter->setSizes({940, kFormWidth});
  layout->addWidget(splitter);
  connect(&workbench_, &Workbench::sessionChanged, this, [this] { showPlan(workbench_.plan()); });
  connect(&workbench_, &Workbench::takeLengthKnown, this, &PlanPage::showTakeLength);
  onChanged();
}

LengthBox* PlanPage::makeLength(const QString& name, double metres) {
  auto* box = new LengthBox(metres, shown_unit_, this);
  box->setAccessibleName(name);
  connect(box, &QDoubleSpinBox::valueChanged, this, &PlanPage::onChanged);
  return box;
}

QWidget* PlanPage::makeForm() {
  auto* panel = new QWidget(this);
  panel->setObjectName(QStringLiteral("inspector"));
  panel->setAttribute(Qt::WA_StyledBackground);
  auto* layout = new QVBoxLayout(panel);
  layout->setContentsMargins(12, 12, 12, 12);
  auto* title = new QLabel(tr("Where the jig is to stand"), panel);
  title->setProperty("role", "heading");
  layout->addWidget(title);

  const acquisition::Plan start;
  auto makeCount = [this](const QString& name, int value, int low, int high) {
    auto* box = new CountBox(this);
    box->setRange(low, high);
    box->setValue(value);
    box->setAccessibleName(name);
    connect(box, &QSpinBox::valueChanged, this, &PlanPage::onChanged);
    return box;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const QString letter = QLatin1String(kAxes[axis]);
    counts_[axis] = makeCount(tr("Places along %1").arg(letter), start.counts[axis], 1, kMaxCount);
    counts_[axis]->setObjectName(QStringLiteral("count_") + letter);
    pitch_[axis] = makeLength(tr("Pitch along %1").arg(letter), start.pitch_m[static_cast<Eigen::Index>(axis)]);
    pitch_[axis]->setObjectName(QStringLiteral("pitch_") + letter);
    // Zero can be typed, so that it can be answered at the field instead of being put back in silence.
    pitch_[axis]->setMinimum(0.0);
    origin_[axis] = makeLength(tr("First place %1").arg(letter), origin_m(start)[static_cast<Eigen::Index>(axis)]);
  }
  pipe_foot_ = makeLength(tr("Height of the pipes' feet"), start.pipe_base_m);
  unit_ = new QComboBox(this);
  unit_->setObjectName(QStringLiteral("placingUnit"));
  for (LengthUnit unit : {LengthUnit::kMetre, LengthUnit::kMillimetre, LengthUnit::kFoot, LengthUnit::kInch})
    unit_->addItem(unitSymbol(unit), static_cast<int>(unit));
  unit_->setCurrentIndex(static_cast<int>(shown_unit_));
  unit_->setAccessibleName(tr("Unit of places"));
  connect(unit_, &QComboBox::currentIndexChanged, this, &PlanPage::onUnit);
  default_origin_ = new QCheckBox(tr("centred in front"), this);
  default_origin_->setChecked(true);
  connect(default_origin_, &QCheckBox::toggled, this, &PlanPage::onChanged);
  order_ = new QComboBox(this);
  order_->addItems({tr("Serpentine"), tr("Random")});
  order_->setItemData(0, tr("Shortest way, fewest pipe changes"), Qt::ToolTipRole);
  order_->setItemData(1, tr("Tells drift with time from error with place"), Qt::ToolTipRole);
  order_->setAccessibleName(tr("Order"));
  connect(order_, &QComboBox::currentIndexChanged, this, &PlanPage::onChanged);
  makeSeed(start.seed);
  orientations_ = makeCount(tr("Sensor orientations at each place"), 1, 1, acquisition::kMaxOrientations);
  orientations_->setObjectName(QStringLiteral("orientations"));
  reseat_ = makeCount(tr("Times each place is seated anew"), 1, 1, 8);
  reseat_->setObjectName(QStringLiteral("seatings"));
  samples_ = makeCount(tr("Samples at each place"), 60, 1, 10000);
  samples_->setObjectName(QStringLiteral("samplesPerNode"));
  amount_ = new NumberBox(this);
  amount_->setObjectName(QStringLiteral("takeAmount"));
  amount_->setAccessibleName(tr("Length of a take"));
  amount_->setDecimals(3);
  connect(amount_, &QDoubleSpinBox::valueChanged, this, &PlanPage::onChanged);
  until_ = new QComboBox(this);
  until_->setObjectName(QStringLiteral("takeUntil"));
  until_->addItems({tr("samples"), tr("seconds"), tr("mm known")});
  until_->setItemData(2,
                      tr("Until the mean position is known so well: its standard error, with the correlation of the "
                         "readings counted in"),
                      Qt::ToolTipRole);
  until_->setAccessibleName(tr("What a take is counted in"));
  // What is typed counts when it is whole: the open session takes it over.
  samples_->setKeyboardTracking(false);
  amount_->setKeyboardTracking(false);
  connect(samples_, &QSpinBox::valueChanged, this, &PlanPage::onTakeLength);
  connect(amount_, &QDoubleSpinBox::valueChanged, this, &PlanPage::onTakeLength);
  for (QWidget* box : {static_cast<QWidget*>(samples_), static_cast<QWidget*>(amount_)})
    box->setToolTip(tr("Of the open session too, from its next take on"));
  connect(until_, &QComboBox::currentIndexChanged, this, &PlanPage::onUntil);
  onUntil();
  makeAtTimeLimit();

  problem_ = new QLabel(panel);
  problem_->setObjectName(QStringLiteral("planProblem"));
  problem_->setProperty("role", "attention");
  problem_->setWordWrap(true);
  problem_->hide();

  auto* form = new QFormLayout;
  form->setRowWrapPolicy(QFormLayout::WrapLongRows);
  form->addRow(tr("Unit"), unit_);
  form->addRow(tr("Places x, y, z"), inRow({counts_[0], counts_[1], counts_[2]}));
  form->addRow(tr("Pitch x, y, z"), inRow({pitch_[0], pitch_[1], pitch_[2]}));
  form->addRow(problem_);
  form->addRow(tr("First place"), default_origin_);
  form->addRow(QString(), inRow({origin_[0], origin_[1], origin_[2]}));
  form->addRow(tr("Pipe foot z"), pipe_foot_);
  form->addRow(tr("Order"), order_);
  form->addRow(tr("Seed"), seed_);
  form->addRow(tr("Orientations"), orientations_);
  form->addRow(tr("Seatings"), reseat_);
  form->addRow(tr("Each take"), inRow({samples_, amount_, until_}));
  form->addRow(tr("Time is up"), at_time_limit_);
  layout->addLayout(form);

  summary_ = new QLabel(panel);
  summary_->setObjectName(QStringLiteral("planSummary"));
  summary_->setWordWrap(true);
  layout->addWidget(summary_);
  create_ = new QPushButton(tr("Start a session with this plan"), panel);
  create_->setObjectName(QStringLiteral("createSession"));
  create_->setProperty("primary", true);
  connect(create_, &QPushButton::clicked, this, &PlanPage::create);
  auto* load = new QPushButton(tr("Load a plan file..."), panel);
  connect(load, &QPushButton::clicked, this, &PlanPage::loadPlanFile);
  layout->addWidget(create_);
  layout->addWidget(load);
  use_grid_ = new QPushButton(tr("Use a grid instead of the file's places"), panel);
  connect(use_grid_, &QPushButton::clicked, this, [this] {
    explicit_places_.clear();
    onChanged();
  });
  layout->addWidget(use_grid_);
  layout->addStretch();
  // In the order in which they stand, not in that in which they were made.
  QWidget* const in_order[] = {unit_,     counts_[0],      counts_[1],    counts_[2], pitch_[0],  pitch_[1],
                               pitch_[2], default_origin_, origin_[0],    origin_[1], origin_[2], pipe_foot_,
                               order_,    seed_,           orientations_, reseat_,    samples_,   amount_,
                               until_,    at_time_limit_,  create_,       load,       use_grid_};
  for (std::size_t i = 1; i < std::size(in_order); ++i) setTabOrder(in_order[i - 1], in_order[i]);
  return panel;
}

void PlanPage::makeSeed(std::uint64_t seed) {
  seed_ = new QLineEdit(QString::number(seed), this);
  seed_->setObjectName(QStringLiteral("seed"));
  seed_->setAccessibleName(tr("Seed of the random order"));
  // A box for numbers would end at 31 bits, and change the seed of a plan that has one of 64.
  seed_->setValidator(new QRegularExpressionValidator(QRegularExpression(QStringLiteral("[0-9]*")), seed_));
  connect(seed_, &QLineEdit::textEdited, this, &PlanPage::onChanged);
}

acquisition::Plan PlanPage::plan() const {
  acquisition::Plan plan;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    plan.counts[axis] = counts_[axis]->value();
    plan.pitch_m[static_cast<Eigen::Index>(axis)] = pitch_[axis]->metres();
  }
  if (!default_origin_->isChecked())
    plan.origin_m = Eigen::Vector3d(origin_[0]->metres(), origin_[1]->metres(), origin_[2]->metres());
  plan.order = order_->currentIndex() == 0 ? acquisition::PlanOrder::kSerpentine : acquisition::PlanOrder::kRandom;
  plan.seed = seed_->text().toULongLong();
  plan.orientations = orientations_->value();
  plan.reseat = reseat_->value();
  plan.pipe_base_m = pipe_foot_->metres();
  plan.explicit_places = explicit_places_;
  return plan;
}

void PlanPage::onUnit() {
  const auto unit = static_cast<LengthUnit>(unit_->currentData().toInt());
  shown_unit_ = unit;
  setPlacingUnit(unit);
  for (const auto& boxes : {pitch_, origin_})
    for (LengthBox* box : boxes) box->setUnit(unit);
  pipe_foot_->setUnit(unit);
  onChanged();
}

QString PlanPage::problemOf(const acquisition::Plan& now) const {
  bool is_seed = false;
  seed_->text().toULongLong(&is_seed);
  if (!is_seed && now.order == acquisition::PlanOrder::kRandom)
    return tr("The seed must be a whole number from 0 to %1.").arg(std::numeric_limits<std::uint64_t>::max());
  const QString pitch = pitchProblem(now);
  if (!pitch.isEmpty()) return pitch;
  const Result<void> size = acquisition::checkPlanSize(now, tr("This plan").toStdString());
  return size ? QString() : QString::fromStdString(size.error().message + ".");
}

QString PlanPage::pitchProblem(const acquisition::Plan& now) const {
  if (!now.explicit_places.empty()) return {};
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (now.pitch_m[static_cast<Eigen::Index>(axis)] <= 0.0)
      return tr("The pitch along %1 is 0: the places would stand on each other. Enter a distance above 0.")
          .arg(QLatin1String(kAxes[axis]));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double extent_m = (now.counts[axis] - 1) * now.pitch_m[static_cast<Eigen::Index>(axis)];
    if (extent_m > kWidest_m)
      return tr("Along %1 the places would span %2 m; no tracker reaches farther than %3 m. Look at pitch and unit.")
          .arg(QLatin1String(kAxes[axis]))
          .arg(extent_m, 0, 'g', 4)
          .arg(kWidest_m);
  }
  return {};
}

void PlanPage::onChanged() {
  if (filling_) return;
  const acquisition::Plan now = plan();
  enableFields(now);
  const QString problem = problemOf(now);
  problem_->setText(problem);
  problem_->setVisible(!problem.isEmpty());
  create_->setEnabled(problem.isEmpty());
  building_.stop();
  if (!problem.isEmpty()) return summary_->clear();
  const Eigen::Vector3d first_m = origin_m(now);
  for (std::size_t axis = 0; axis < 3 && !now.origin_m; ++axis)
    origin_[axis]->setMetres(first_m[static_cast<Eigen::Index>(axis)]);
  build(now);
}

PlanPage::BuiltPlan PlanPage::built(const acquisition::Plan& plan) {
  BuiltPlan built{places(plan), 0, {}};
  std::set<double> levels_m;
  for (const PlannedPlace& place : built.places)
    levels_m.insert(std::round(place.reference_from_sensor.position_m.z() * 1000.0) / 1000.0);
  built.n_levels = levels_m.size();
  built.orientations = evaluation::plannedOrientations(built.places, Pose{}).text;
  return built;
}

void PlanPage::build(const acquisition::Plan& now) {
  const std::int64_t stops = acquisition::stopsOf(now);
  if (stops <= kBuiltAtOnce) return show(now, built(now));
  summary_->setText(tr("Laying out %1 placements...").arg(stops));
  auto work = [now](const RunControl& control) -> Result<BuiltPlan> {
    if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Another plan was asked for");
    return built(now);
  };
  building_.run(std::move(work), [this, now](const Result<BuiltPlan>& result) {
    if (!result) return summary_->setText(QString::fromStdString(result.error().message));
    show(now, *result);
  });
}

void PlanPage::show(const acquisition::Plan& now, const BuiltPlan& built) {
  room_->setPlaces(built.places);
  room_->setTransmitter(Pose{});
  summary_->setText(summary(now, built));
}

void PlanPage::enableFields(const acquisition::Plan& now) {
  const bool grid = now.explicit_places.empty();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    counts_[axis]->setEnabled(grid);
    pitch_[axis]->setEnabled(grid);
    origin_[axis]->setEnabled(grid && now.origin_m.has_value());
  }
  default_origin_->setEnabled(grid);
  seed_->setEnabled(now.order == acquisition::PlanOrder::kRandom);
  use_grid_->setVisible(!grid);
}

QString PlanPage::summary(const acquisition::Plan& now, const BuiltPlan& built) const {
  const std::size_t n = built.places.size();
  const double minutes = static_cast<double>(n) * (kSecondsPerPlacement + secondsOf(takeLength())) / 60.0;
  QString text = tr("%1 on %2, about %3 min for a practised operator.")
                     .arg(n == 1 ? tr("1 placement") : tr("%1 placements").arg(n))
                     .arg(built.n_levels == 1 ? tr("1 level") : tr("%1 levels").arg(built.n_levels))
                     .arg(std::ceil(minutes), 0, 'f', 0);
  QStringList pipes;
  for (const double length_m : acquisition::pipeLengths_m(now)) pipes << coordinateText(length_m);
  if (!pipes.isEmpty()) text += tr(" Pipes: %1.").arg(pipes.join(QStringLiteral(", ")));
  return text + QStringLiteral("\n\n") + QString::fromStdString(built.orientations);
}

void PlanPage::makeAtTimeLimit() {
  using acquisition::AtTimeLimit;
  at_time_limit_ = new QComboBox(this);
  at_time_limit_->setObjectName(QStringLiteral("atTimeLimit"));
  at_time_limit_->setAccessibleName(tr("What becomes of a take that is not complete within its time"));
  at_time_limit_->setToolTip(tr("A take that is not complete within 30 s, and the time that was asked for"));
  const auto add = [this](const QString& label, AtTimeLimit at_time_limit) {
    at_time_limit_->addItem(label, static_cast<int>(at_time_limit));
  };
  add(tr("ask: keep, wait, again, skip"), AtTimeLimit::kAsk);
  add(tr("keep what it has"), AtTimeLimit::kKeep);
  add(tr("take it again, up to twice"), AtTimeLimit::kAgain);
  add(tr("skip the place"), AtTimeLimit::kSkip);
  connect(at_time_limit_, &QComboBox::currentIndexChanged, this,
          [this] { workbench_.setAtTimeLimit(static_cast<AtTimeLimit>(at_time_limit_->currentData().toInt())); });
}

void PlanPage::onUntil() {
  const auto until = static_cast<acquisition::TakeLength::Until>(until_->currentIndex());
  const bool counts = until == acquisition::TakeLength::Until::kSamples;
  samples_->setVisible(counts);
  amount_->setVisible(!counts);
  const QSignalBlocker quiet(amount_);
  if (until == acquisition::TakeLength::Until::kSeconds) {
    amount_->setRange(0.1, 600.0);
    amount_->setValue(1.0);
  } else if (!counts) {
    amount_->setRange(0.001, 100.0);
    amount_->setValue(0.1);
  }
  if (!summary_) return;
  onChanged();
  onTakeLength();
}

void PlanPage::onTakeLength() {
  if (!filling_) workbench_.setTakeLength(takeLength());
}

void PlanPage::showTakeLength(const acquisition::TakeLength& length) {
  filling_ = true;
  until_->setCurrentIndex(static_cast<int>(length.until));
  if (length.until == acquisition::TakeLength::Until::kSamples) {
    const int samples = static_cast<int>(length.amount);
    samples_->setMaximum(std::max(samples_->maximum(), samples));
    samples_->setValue(samples);
  } else {
    amount_->setValue(length.amount / takeUnit());
  }
  filling_ = false;
  onChanged();
}

double PlanPage::takeUnit() const {
  return until_->currentIndex() == static_cast<int>(acquisition::TakeLength::Until::kStandardError) ? 1e-3 : 1.0;
}

acquisition::TakeLength PlanPage::takeLength() const {
  const auto until = static_cast<acquisition::TakeLength::Until>(until_->currentIndex());
  if (until == acquisition::TakeLength::Until::kSamples) return {until, static_cast<double>(samples_->value())};
  return {until, takeUnit() * amount_->value()};
}

void PlanPage::loadPlanFile() {
  const QString path = QFileDialog::getOpenFileName(this, tr("Load a plan"), QString(), tr("Plans (*.plan.json)"));
  if (path.isEmpty()) return;
  const Result<acquisition::Plan> loaded = acquisition::readPlan(path.toStdString());
  if (!loaded) {
    workbench_.showMessage({QString::fromStdString(loaded.error().message), Severity::kAttention, {}, {}});
    return;
  }
  showPlan(*loaded);
}

void PlanPage::showPlan(const acquisition::Plan& plan) {
  filling_ = true;
  const auto count = [](QSpinBox* box, int value) {
    box->setMaximum(std::max(box->maximum(), value));
    box->setValue(value);
  };
  explicit_places_ = plan.explicit_places;
  pipe_foot_->setMetres(plan.pipe_base_m);
  default_origin_->setChecked(!plan.origin_m.has_value());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto row = static_cast<Eigen::Index>(axis);
    count(counts_[axis], plan.counts[axis]);
    pitch_[axis]->setMetres(plan.pitch_m[row]);
    if (plan.origin_m) origin_[axis]->setMetres((*plan.origin_m)[row]);
  }
  order_->setCurrentIndex(plan.order == acquisition::PlanOrder::kSerpentine ? 0 : 1);
  seed_->setText(QString::number(plan.seed));
  count(orientations_, plan.orientations);
  count(reseat_, plan.reseat);
  filling_ = false;
  onChanged();
}

void PlanPage::create() {
  if (!problemOf(plan()).isEmpty()) return;
  workbench_.createSession(Workbench::freshSessionPath(QStringLiteral("session")), plan(), takeLength());
}

}  // namespace fieldtrue::widgets
