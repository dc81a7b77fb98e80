#include "widgets/compare/verdict_panel.h"

#include <QCheckBox>
#include <QGridLayout>
#include <QLabel>
#include <QScrollArea>
#include <QVBoxLayout>

#include "calib/evaluation/error_stats.h"
#include "widgets/report/report_data.h"
#include "widgets/style/unit_texts.h"
#include "widgets/views/charts/chart_views.h"
#include "widgets/views/field/volume_field.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kHistogramHeight = 170;
constexpr int kNameWidth = 162;

void clear(QLayout* layout) {
  while (QLayoutItem* item = layout->takeAt(0)) {
    delete item->widget();
    delete item;
  }
}

}  // namespace

VerdictPanel::VerdictPanel(QWidget* parent)
    : QWidget(parent),
      figures_(new QWidget(this)),
      figures_layout_(new QGridLayout(figures_)),
      histogram_(new HistogramView(this)),
      notes_(new QWidget(this)),
      notes_layout_(new QVBoxLayout(notes_)) {
  figures_layout_->setContentsMargins(0, 4, 0, 4);
  figures_layout_->setHorizontalSpacing(9);
  figures_layout_->setVerticalSpacing(4);
  figures_layout_->setColumnStretch(0, 1);
  histogram_->setObjectName(QStringLiteral("histogram"));
  histogram_->setFixedHeight(kHistogramHeight);
  notes_->setObjectName(QStringLiteral("verdictNotes"));
  notes_layout_->setContentsMargins(0, 0, 0, 0);
  notes_layout_->setSpacing(2);
  show_holes_ = makeMark(tr("Draw holes as balls"), QStringLiteral("showHoles"));
  show_folds_ = makeMark(tr("Draw folded cells as boxes"), QStringLiteral("showFolds"));
  auto* scroll = new QScrollArea(this);
  auto* inside = new QWidget(scroll);
  auto* rows = new QVBoxLayout(inside);
  rows->setContentsMargins(0, 0, 4, 0);
  rows->addWidget(notes_);
  rows->addWidget(show_holes_);
  rows->addWidget(show_folds_);
  rows->addStretch(1);
  scroll->setWidget(inside);
  scroll->setWidgetResizable(true);
  scroll->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 8, 0, 0);
  layout->addWidget(figures_);
  layout->addWidget(histogram_);
  layout->addWidget(scroll, 1);
  setComparison(std::nullopt);
}

QCheckBox* VerdictPanel::makeMark(const QString& label, const QString& name) {
  auto* box = new QCheckBox(label, this);
  box->setObjectName(name);
  box->setChecked(true);
  connect(box, &QCheckBox::toggled, this, &VerdictPanel::marksChanged);
  return box;
}

void VerdictPanel::setComparison(const std::optional<evaluation::Comparison>& comparison) {
  comparison_ = comparison;
  fillFigures();
  fillNotes();
  show_holes_->setVisible(comparison_ && comparison_->coverage && !comparison_->coverage->holes.empty());
  show_folds_->setVisible(comparison_ && comparison_->fold_back && comparison_->fold_back->n_folded > 0);
}

void VerdictPanel::fillFigures() {
  clear(figures_layout_);
  if (!comparison_) return;
  const QString headings[] = {QString(), tr("RMS"), tr("90 % interval"), tr("95 %"), tr("Max")};
  for (int column = 0; column < 5; ++column) {
    auto* heading = new QLabel(headings[column], figures_);
    heading->setProperty("role", "muted");
    figures_layout_->addWidget(heading, 0, column, column == 0 ? Qt::AlignLeft : Qt::AlignRight);
  }
  int row = 1;
  addFigures(row++, tr("Before, mm"), comparison_->before_position_mm, false);
  if (comparison_->best_position_row)
    addFigures(row++, positionLabel(*comparison_, comparison_->best_position_row),
               comparison_->position[*comparison_->best_position_row].stats, true);
  if (comparison_->before_orientation_deg)
    addFigures(row++, tr("Before, deg"), *comparison_->before_orientation_deg, false);
  if (comparison_->best_orientation_row)
    addFigures(row++, orientationLabel(comparison_->orientation[*comparison_->best_orientation_row]),
               comparison_->orientation[*comparison_->best_orientation_row].stats, true);
}

void VerdictPanel::addFigures(int row, const QString& name, const evaluation::ErrorStats& stats, bool bold) {
  const QString cells[] = {name, threeFigures(stats.rms),
                           tr("%1 to %2").arg(threeFigures(stats.rms_low90), threeFigures(stats.rms_high90)),
                           threeFigures(stats.p95), threeFigures(stats.max)};
  for (int column = 0; column < 5; ++column) {
    auto* label = new QLabel(cells[column], figures_);
    QFont font = label->font();
    font.setBold(bold);
    label->setFont(font);
    if (column == 0) {
      label->setText(label->fontMetrics().elidedText(name, Qt::ElideRight, kNameWidth));
      label->setToolTip(name);
    }
    figures_layout_->addWidget(label, row, column, (column == 0 ? Qt::AlignLeft : Qt::AlignRight) | Qt::AlignTop);
  }
}

void VerdictPanel::addNote(const QString& heading, const QString& text) {
  if (text.isEmpty()) return;
  auto* title = new QLabel(heading, notes_);
  title->setProperty("role", "heading");
  auto* words = new QLabel(text, notes_);
  words->setWordWrap(true);
  words->setTextInteractionFlags(Qt::TextSelectableByMouse);
  words->setContentsMargins(0, 0, 0, 8);
  notes_layout_->addWidget(title);
  notes_layout_->addWidget(words);
}

void VerdictPanel::fillNotes() {
  clear(notes_layout_);
  if (!comparison_) return;
  const evaluation::Comparison& c = *comparison_;
  if (c.floor_position_mm > 0.0)
    addNote(tr("Trueness apart from precision"),
            tr("Noise and jig alone leave %1 mm (from %2). Beyond them: %3 mm before, %4 mm after.")
                .arg(threeFigures(c.floor_position_mm), QString::fromStdString(c.floor_from),
                     threeFigures(c.trueness.before_position_mm), threeFigures(c.trueness.after_position_mm)));
  addNote(tr("Sensors"), QString::fromStdString(sensorsText(c)));
  if (c.coverage) addNote(tr("Coverage"), QString::fromStdString(c.coverage->text));
  if (c.fold_back) addNote(tr("One-to-one"), QString::fromStdString(c.fold_back->text));
  if (c.orientation_cover) addNote(tr("Orientations"), QString::fromStdString(c.orientation_cover->text));
  if (c.position_dependence) addNote(tr("Position error"), QString::fromStdString(c.position_dependence->text));
  if (c.orientation_dependence)
    addNote(tr("Orientation error"), QString::fromStdString(c.orientation_dependence->text));
  for (const std::string& note : c.notes) addNote(tr("Note"), QString::fromStdString(note));
}

void VerdictPanel::showMethods(MethodRow left, MethodRow right) {
  if (!comparison_) return;
  // A method keeps its colour in every chart: 0 is before, then the rows of the comparison.
  const auto color = [](MethodRow row) { return row ? *row + 1 : std::size_t{0}; };
  std::vector<QString> names = {positionLabel(*comparison_, left)};
  std::vector<std::vector<double>> errors = {heldOutErrors_mm(*comparison_, left)};
  std::vector<std::size_t> colors = {color(left)};
  if (left != right) {
    names.push_back(positionLabel(*comparison_, right));
    errors.push_back(heldOutErrors_mm(*comparison_, right));
    colors.push_back(color(right));
  }
  histogram_->setSeries(names, errors, tr("held-out error [mm]"), colors);
}

std::vector<SceneCell> VerdictPanel::holes() const {
  std::vector<SceneCell> cells;
  if (!comparison_ || !comparison_->coverage || !show_holes_->isChecked()) return cells;
  for (const evaluation::Hole& hole : comparison_->coverage->holes) cells.push_back({hole.center_m, hole.radius_m});
  return cells;
}

std::vector<SceneCell> VerdictPanel::folds() const {
  std::vector<SceneCell> cells;
  if (!comparison_ || !comparison_->fold_back || !show_folds_->isChecked()) return cells;
  for (const evaluation::FoldBackCell& cell : comparison_->fold_back->cells)
    if (!cell.one_to_one) cells.push_back({cell.center_m, cell.size_m});
  return cells;
}

}  // namespace fieldtrue::widgets
