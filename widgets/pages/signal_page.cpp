#include "widgets/pages/signal_page.h"

#include <QGridLayout>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QLabel>
#include <QPushButton>
#include <QStackedWidget>
#include <QTableWidget>
#include <QVBoxLayout>
#include <algorithm>
#include <array>
#include <numbers>

#include "widgets/figures/signal_sketch.h"
#include "widgets/forms/empty_page.h"
#include "widgets/style/icons.h"
#include "widgets/style/theme.h"
#include "widgets/style/unit_texts.h"
#include "widgets/views/charts/sketch_view.h"
#include "widgets/views/charts/spectrum_view.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kInterval_ms = 500;
constexpr int kPicture = 140;
constexpr int kInspectorWidth = 360;
constexpr int kNarrowestColumn = 100;
constexpr int kMostRows = 4;  ///< Of the table without scrolling.
constexpr double kDegree = std::numbers::pi / 180.0;

/// Shape and colour together.
QPixmap markOf(acquisition::Verdict verdict) {
  const std::array<std::pair<const char*, QColor>, 3> marks{
      {{"more", theme().text_muted}, {"check", theme().done}, {"warning", theme().attention}}};
  const auto& [name, color] = marks[static_cast<std::size_t>(verdict)];
  return icon(QLatin1String(name), color).pixmap(22, 22);
}

QString sentence(const std::string& text) {
  const QString plain = QString::fromStdString(text);
  return plain.left(1).toUpper() + plain.mid(1) + QLatin1Char('.');
}

QString marksText(const acquisition::SignalReport& report) {
  if (report.marks.empty()) return SignalPage::tr("good");
  QStringList parts;
  for (const auto& [mark, count] : report.marks)
    parts << SignalPage::tr("%1 x %2").arg(count).arg(QString::fromStdString(mark));
  return parts.join(QStringLiteral(", "));
}

QString numbersText(const acquisition::SignalReport& report) {
  if (!report.stand) return SignalPage::tr("The sensor moves.");
  const Eigen::Vector3d& sds_m = report.noise->sds_m;
  QString text = SignalPage::tr("Noise %1: %2, %3 and %4 along its axes, the largest %5° from the line of sight")
                     .arg(millimetreText(report.noise->sd_m()), millimetreText(sds_m[0]), millimetreText(sds_m[1]),
                          millimetreText(sds_m[2]))
                     .arg(report.noise->from_line_of_sight_rad / kDegree, 0, 'f', 0);
  text += SignalPage::tr("\nTurning %1°\n%2 readings are worth %3 (correlation %4)")
              .arg(threeFigures(report.sd_rot_rad / kDegree))
              .arg(report.of_stand)
              .arg(report.worth, 0, 'f', 0)
              .arg(report.correlation, 0, 'f', 2);
  return text;
}

}  // namespace

SignalPage::SignalPage(Workbench& workbench, QWidget* parent) : QWidget(parent), workbench_(workbench) {
  stack_ = new QStackedWidget(this);
  stack_->addWidget(
      new EmptyPage(tr("No tracker is connected."), tr("Connect one to see what its sensors send."),
                    {{tr("Connect a tracker"), [this] { workbench_.goToPage(QStringLiteral("connect")); }}}, this));
  stack_->addWidget(makeContent());
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(stack_);
  timer_.setInterval(kInterval_ms);
  connect(&timer_, &QTimer::timeout, &workbench_, &Workbench::requestSignal);
  connect(&workbench_, &Workbench::signalReady, this, &SignalPage::onSignal);
  connect(&workbench_, &Workbench::statusChanged, this, &SignalPage::onStatus);
  onStatus(workbench_.status());
}

QWidget* SignalPage::makeContent() {
  auto* content = new QWidget(this);
  auto* columns = new QHBoxLayout(content);
  columns->setContentsMargins(0, 0, 0, 0);
  columns->setSpacing(0);
  auto* main = new QWidget(content);
  auto* rows = new QVBoxLayout(main);
  rows->setContentsMargins(20, 16, 20, 12);
  rows->setSpacing(12);
  rows->addWidget(makeHead(main));
  rows->addWidget(sensors_);
  rows->addWidget(makeCards(main), 1);
  columns->addWidget(main, 1);
  columns->addWidget(makeInspector(content));
  return content;
}

QWidget* SignalPage::makeHead(QWidget* parent) {
  auto* head = new QWidget(parent);
  auto* row = new QHBoxLayout(head);
  row->setContentsMargins(0, 0, 0, 0);
  auto* title = new QLabel(tr("Signal"), head);
  title->setProperty("role", "title");
  device_ = new QLabel(head);
  device_->setProperty("role", "muted");
  save_ = new QPushButton(tr("Save the line's bytes"), head);
  save_->setObjectName(QStringLiteral("saveTraceOfSignal"));
  connect(save_, &QPushButton::clicked, &workbench_, &Workbench::saveTrace);
  row->addWidget(title);
  row->addSpacing(12);
  row->addWidget(device_, 1);
  row->addWidget(save_);

  sensors_ = new QTableWidget(0, 6, parent);
  sensors_->setObjectName(QStringLiteral("sensorTable"));
  sensors_->setAccessibleName(tr("Sensors"));
  sensors_->setHorizontalHeaderLabels(
      {tr("Sensor"), tr("Position"), tr("Orientation"), tr("Rate"), tr("Noise, SD"), tr("Status")});
  sensors_->verticalHeader()->hide();
  sensors_->setEditTriggers(QAbstractItemView::NoEditTriggers);
  sensors_->setSelectionBehavior(QAbstractItemView::SelectRows);
  sensors_->setSelectionMode(QAbstractItemView::SingleSelection);
  sensors_->setShowGrid(false);
  sensors_->setWordWrap(false);
  sensors_->horizontalHeader()->setDefaultAlignment(Qt::AlignLeft | Qt::AlignVCenter);
  sensors_->horizontalHeader()->setMinimumSectionSize(kNarrowestColumn);
  sensors_->horizontalHeader()->setSectionResizeMode(QHeaderView::ResizeToContents);
  sensors_->horizontalHeader()->setStretchLastSection(true);
  connect(sensors_, &QTableWidget::itemSelectionChanged, this, &SignalPage::showSensor);
  return head;
}

QWidget* SignalPage::makeCards(QWidget* parent) {
  auto* cards = new QWidget(parent);
  auto* grid = new QGridLayout(cards);
  grid->setContentsMargins(0, 0, 0, 0);
  grid->setSpacing(12);
  int number = 0;
  for (const acquisition::SignalQuestion& question : acquisition::signalQuestions())
    cards_.push_back(makeCard(question, *grid, number++));
  return cards;
}

SignalPage::Card SignalPage::makeCard(const acquisition::SignalQuestion& question, QGridLayout& grid, int number) {
  auto* frame = new QWidget(this);
  frame->setObjectName(QStringLiteral("signalCard"));
  frame->setAttribute(Qt::WA_StyledBackground);
  auto* rows = new QVBoxLayout(frame);
  Card card{new SketchView(frame), new QLabel(frame), new QLabel(frame)};
  card.picture->setObjectName(QStringLiteral("picture_") + QLatin1String(question.id));
  card.picture->setMinimumSize(kPicture, kPicture);
  auto* heading = new QLabel(tr(question.text), frame);
  heading->setProperty("role", "heading");
  card.answer->setObjectName(QStringLiteral("answer_") + QLatin1String(question.id));
  card.answer->setWordWrap(true);
  card.answer->setTextInteractionFlags(Qt::TextSelectableByMouse);
  auto* head = new QHBoxLayout;
  head->addWidget(card.mark);
  head->addWidget(heading, 1);
  if (QLatin1String(question.id) == QLatin1String("axes")) {
    move_ = new QPushButton(tr("Move it along the axes"), frame);
    move_->setObjectName(QStringLiteral("moveButton"));
    connect(move_, &QPushButton::clicked, this, &SignalPage::beginMoves);
    head->addWidget(move_);
  }
  rows->addLayout(head);
  rows->addWidget(card.answer);
  rows->addWidget(card.picture, 1);
  grid.addWidget(frame, number / 2, number % 2);
  return card;
}

QWidget* SignalPage::makeInspector(QWidget* parent) {
  auto* inspector = new QWidget(parent);
  inspector->setObjectName(QStringLiteral("inspector"));
  inspector->setAttribute(Qt::WA_StyledBackground);
  inspector->setFixedWidth(kInspectorWidth);
  auto* layout = new QVBoxLayout(inspector);
  layout->setContentsMargins(12, 16, 12, 12);
  auto* heading = new QLabel(tr("Spectrum of the noise"), inspector);
  heading->setProperty("role", "heading");
  spectrum_ = new SpectrumView(inspector);
  spectrum_->setObjectName(QStringLiteral("spectrum"));
  auto* caption = new QLabel(
      tr("Power by frequency. Dashed is what the noise beside each frequency, and its autoregression, lead one to "
         "expect there; a peak that stands out of it is no noise."),
      inspector);
  numbers_ = new QLabel(inspector);
  numbers_->setObjectName(QStringLiteral("signalNumbers"));
  for (QLabel* label : {caption, numbers_}) label->setWordWrap(true);
  caption->setProperty("role", "muted");
  layout->addWidget(heading);
  layout->addWidget(spectrum_, 1);
  layout->addWidget(caption);
  layout->addSpacing(8);
  layout->addWidget(numbers_);
  layout->addStretch();
  return inspector;
}

void SignalPage::showEvent(QShowEvent* event) {
  QWidget::showEvent(event);
  timer_.start();
  workbench_.requestSignal();
}

void SignalPage::hideEvent(QHideEvent* event) {
  QWidget::hideEvent(event);
  timer_.stop();
  moves_.stop();
}

void SignalPage::onStatus(const acquisition::AcquisitionStatus& status) {
  const bool is_there = status.device == acquisition::DeviceState::kRunning || status.reconnecting;
  stack_->setCurrentIndex(is_there ? 1 : 0);
  device_->setText(status.device_text);
  save_->setEnabled(status.has_trace);
  // What is connected next may be set otherwise.
  if (status.device != acquisition::DeviceState::kRunning) moves_ = {};
}

void SignalPage::onSignal(const acquisition::SignalSnapshot& snapshot) {
  if (jobs_.busy()) return;
  jobs_.run([snapshot](const RunControl&) { return judged(snapshot); },
            [this](const Result<std::vector<acquisition::JudgedSignal>>& judged_signals) {
              if (judged_signals) show(*judged_signals);
            });
}

void SignalPage::show(const std::vector<acquisition::JudgedSignal>& judged_signals) {
  signals_ = judged_signals;
  showSensors();
  showSensor();
}

void SignalPage::showSensors() {
  const auto rows = static_cast<int>(signals_.size());
  const QSignalBlocker quiet(sensors_);
  sensors_->setRowCount(rows);
  for (int row = 0; row < rows; ++row) {
    const acquisition::SignalReport& report = signals_[static_cast<std::size_t>(row)].report;
    const Pose now = report.newest ? report.newest->tracker_from_sensor : Pose{};
    const QStringList texts = {QString::number(report.sensor),
                               positionText(now.position_m),
                               shortTurnText(now.orientation),
                               tr("%1 Hz").arg(report.rate_hz, 0, 'f', 1),
                               report.noise ? millimetreText(report.noise->sd_m()) : tr("moves"),
                               marksText(report)};
    for (int column = 0; column < texts.size(); ++column) {
      if (!sensors_->item(row, column)) sensors_->setItem(row, column, new QTableWidgetItem);
      sensors_->item(row, column)->setText(texts[column]);
      sensors_->item(row, column)->setToolTip(texts[column]);
    }
  }
  if (rows > 0 && sensors_->selectedItems().isEmpty()) sensors_->selectRow(0);
  const int height = sensors_->rowHeight(0) * std::clamp(rows, 1, kMostRows);
  sensors_->setFixedHeight(sensors_->horizontalHeader()->height() + height + 4);
}

const acquisition::JudgedSignal* SignalPage::chosen() const {
  const int row = sensors_->currentRow();
  return row < 0 || static_cast<std::size_t>(row) >= signals_.size() ? nullptr
                                                                     : &signals_[static_cast<std::size_t>(row)];
}

void SignalPage::showSensor() {
  const acquisition::JudgedSignal* signal = chosen();
  static const acquisition::JudgedSignal kNone;
  const acquisition::SignalReport& report = signal ? signal->report : kNone.report;
  if (report.sensor != moved_sensor_) moves_ = {};
  moved_sensor_ = report.sensor;
  moves_.add(report.stand ? std::optional<Eigen::Vector3d>(report.stand->position_m) : std::nullopt);
  spectrum_->setSpectrum(report.spectrum);
  numbers_->setText(signal ? numbersText(report) : QString());
  showAnswers(signal ? *signal : kNone);
}

void SignalPage::showAnswers(const acquisition::JudgedSignal& signal) {
  const auto& questions = acquisition::signalQuestions();
  for (std::size_t i = 0; i < cards_.size(); ++i) {
    const acquisition::Answer said = questions[i].answer(signal, moves_.moves());
    cards_[i].mark->setPixmap(markOf(said.verdict));
    cards_[i].answer->setText(sentence(said.text));
    cards_[i].picture->setSketch(sketchOf(i, signal));
  }
  const auto asked = moves_.asked();
  move_->setText(asked ? tr("Begin anew") : tr("Move it along the axes"));
  if (!asked) return;
  QLabel& axes = *cards_[1].answer;
  axes.setText(moves_.hasStart() ? tr("Move the sensor along +%1, a hand's breadth or more, and rest it there.")
                                       .arg(QLatin1Char(static_cast<char>('x' + *asked)))
                                 : tr("Rest the sensor."));
}

Sketch SignalPage::sketchOf(std::size_t question, const acquisition::JudgedSignal& signal) const {
  const acquisition::SignalReport& report = signal.report;
  const Pose now = report.stand.value_or(report.newest ? report.newest->tracker_from_sensor : Pose{});
  const std::array<std::function<Sketch()>, 4> sketches{
      [&] { return sideSketch(report.newest ? std::optional(now.position_m) : std::nullopt); },
      [&] { return movesSketch(moves_.asked(), moves_.moves()); }, [&] { return driftSketch(signal.seconds); },
      [&] { return noiseSketch(report.noise, now.position_m, signal.expected_sd_m); }};
  return sketches[question]();
}

void SignalPage::beginMoves() {
  moves_.begin();
  showSensor();
}

}  // namespace fieldtrue::widgets
