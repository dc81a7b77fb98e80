#include "widgets/compare/curve_panel.h"

#include <QComboBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QVBoxLayout>
#include <algorithm>

#include "widgets/compare/method_list.h"
#include "widgets/style/unit_texts.h"
#include "widgets/views/charts/chart_views.h"

namespace fieldtrue::widgets {
namespace {

constexpr std::size_t kBestShown = 5;
constexpr double kStillFalling = 0.1;  ///< Of the error, lost over the last step of places.

}  // namespace

CurvePanel::CurvePanel(QWidget* parent)
    : QWidget(parent),
      which_(new QComboBox(this)),
      start_(new QPushButton(this)),
      progress_(new QProgressBar(this)),
      view_(new CurveView(this)),
      text_(new QLabel(this)) {
  which_->setObjectName(QStringLiteral("curveMethods"));
  which_->setAccessibleName(tr("Methods to draw"));
  which_->addItem(tr("The five best"), static_cast<int>(Which::kBest));
  which_->addItem(tr("The two shown"), static_cast<int>(Which::kShown));
  which_->addItem(tr("All compared"), static_cast<int>(Which::kAll));
  start_->setObjectName(QStringLiteral("curveStart"));
  progress_->setRange(0, 1000);
  progress_->setAccessibleName(tr("Learning curves"));
  view_->setObjectName(QStringLiteral("curveView"));
  text_->setObjectName(QStringLiteral("curveText"));
  text_->setWordWrap(true);
  text_->setProperty("role", "muted");
  auto* row = new QHBoxLayout;
  row->addWidget(which_, 1);
  row->addWidget(start_);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 8, 0, 0);
  layout->addLayout(row);
  layout->addWidget(progress_);
  layout->addWidget(view_, 1);
  layout->addWidget(text_);
  connect(start_, &QPushButton::clicked, this, [this] {
    if (jobs_.busy())
      stop();
    else
      run();
  });
  showState();
}

void CurvePanel::setComparison(const CalibrationTable& table, const std::optional<evaluation::Comparison>& comparison) {
  stop();
  table_ = table;
  comparison_ = comparison;
  left_row_.reset();
  right_row_.reset();
  curves_.clear();
  rows_.clear();
  draw();
}

void CurvePanel::showMethods(MethodRow left, MethodRow right) {
  left_row_ = left;
  right_row_ = right;
}

std::vector<std::size_t> CurvePanel::chosenRows() const {
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < comparison_->position.size(); ++row) {
    const evaluation::MethodScore& score = comparison_->position[row];
    if (!score.skipped && score.method != "none") rows.push_back(row);
  }
  const auto which = static_cast<Which>(which_->currentData().toInt());
  if (which == Which::kShown)
    std::erase_if(rows, [this](std::size_t row) { return row != left_row_ && row != right_row_; });
  if (which == Which::kBest) {
    std::stable_sort(rows.begin(), rows.end(), [this](std::size_t a, std::size_t b) {
      return comparison_->position[a].stats.rms < comparison_->position[b].stats.rms;
    });
    rows.resize(std::min(rows.size(), kBestShown));
  }
  return rows;
}

void CurvePanel::run() {
  if (!comparison_) return;
  const std::vector<std::size_t> rows = chosenRows();
  evaluation::ComparisonOptions options;
  options.validation = comparison_->validation;
  options.align = comparison_->align;
  options.with_surroundings = false;
  for (const std::size_t row : rows)
    options.position_methods.push_back(
        methodTextOf(comparison_->position[row].method, comparison_->position[row].settings));
  if (options.position_methods.empty()) {
    text_->setText(tr("Neither view shows a method: choose one above it."));
    return;
  }
  jobs_.run([table = table_,
             options](const RunControl& control) { return evaluation::learningCurves(table, options, control); },
            [this, rows](Result<std::vector<evaluation::LearningCurve>> result) { arrived(rows, std::move(result)); },
            [this](double fraction) { progress_->setValue(static_cast<int>(1000.0 * fraction)); });
  showState();
}

void CurvePanel::stop() {
  if (!jobs_.busy()) return;
  jobs_.stop();
  showState();
}

void CurvePanel::arrived(const std::vector<std::size_t>& rows, Result<std::vector<evaluation::LearningCurve>> result) {
  if (!result) {
    showState();
    text_->setText(QString::fromStdString(result.error().message));
    return;
  }
  rows_ = rows;
  curves_ = std::move(*result);
  draw();
}

void CurvePanel::draw() {
  std::vector<ChartLine> lines;
  for (std::size_t k = 0; k < curves_.size() && k < rows_.size(); ++k) {
    if (curves_[k].points.empty()) continue;
    ChartLine& line = lines.emplace_back();
    line.name = positionLabel(comparison_->position[rows_[k]]);
    line.color = rows_[k] + 1;
    for (const evaluation::LearningPoint& point : curves_[k].points)
      line.points.push_back({static_cast<double>(point.n_places), point.rms, point.low, point.high});
  }
  view_->setLines(lines, tr("places the fit used"), tr("held-out error [mm]"));
  view_->setVisible(!lines.empty());
  showState();
}

QString CurvePanel::verdictText() const {
  const evaluation::LearningCurve* best = nullptr;
  std::size_t best_row = 0;
  for (std::size_t k = 0; k < curves_.size() && k < rows_.size(); ++k) {
    const evaluation::LearningCurve& curve = curves_[k];
    if (curve.points.size() < 2 || (best != nullptr && curve.points.back().rms >= best->points.back().rms)) continue;
    best = &curve;
    best_row = rows_[k];
  }
  if (best == nullptr) return {};
  const evaluation::LearningPoint &last = best->points.back(), &earlier = best->points[best->points.size() - 2];
  const QString words = 1.0 - last.rms / earlier.rms > kStillFalling
                            ? tr("%1 still gains from more places: %2 mm on %3, %4 mm on %5.")
                            : tr("%1 gains little from more places: %2 mm on %3, %4 mm on %5.");
  return words.arg(positionLabel(comparison_->position[best_row]), threeFigures(earlier.rms))
      .arg(earlier.n_places)
      .arg(threeFigures(last.rms))
      .arg(last.n_places);
}

void CurvePanel::showState() {
  start_->setText(jobs_.busy() ? tr("Stop") : tr("Draw the curves"));
  progress_->setVisible(jobs_.busy());
  if (!jobs_.busy()) progress_->setValue(0);
  if (jobs_.busy()) {
    text_->setText(tr("Fitting growing parts of the places..."));
  } else if (curves_.empty()) {
    text_->setText(
        tr("How the error falls as more places are used: each method is fitted on growing random parts of the "
           "places and judged on a fifth that none of the fits see. This takes several fits a method."));
  } else {
    text_->setText(verdictText());
  }
}

}  // namespace fieldtrue::widgets
