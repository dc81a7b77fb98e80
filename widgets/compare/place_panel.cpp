#include "widgets/compare/place_panel.h"

#include <QComboBox>
#include <QGridLayout>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QLabel>
#include <QTableWidget>
#include <QVBoxLayout>
#include <set>

#include "calib/calibration/alignment.h"
#include "calib/core/place_name.h"
#include "widgets/compare/node_facts.h"
#include "widgets/style/theme.h"
#include "widgets/style/unit_texts.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kPlaceRowHeight = 24;
constexpr int kNarrowestColumn = 64;  ///< What Qt deems enough for "mm" cuts it.

QTableWidgetItem* cell(const QString& text, Qt::Alignment alignment) {
  auto* item = new QTableWidgetItem(text);
  item->setTextAlignment(alignment | Qt::AlignVCenter);
  item->setFlags(Qt::ItemIsEnabled | Qt::ItemIsSelectable);
  return item;
}

}  // namespace

PlacePanel::PlacePanel(QWidget* parent)
    : QWidget(parent),
      places_(new QComboBox(this)),
      visits_(new QComboBox(this)),
      facts_(new QWidget(this)),
      facts_layout_(new QGridLayout(facts_)),
      note_(new QLabel(this)),
      position_(makeTable(QStringLiteral("placePosition"), tr("Position error, held out"), tr("mm"))),
      orientation_(makeTable(QStringLiteral("placeOrientation"), tr("Orientation error, held out"), tr("deg"))) {
  places_->setObjectName(QStringLiteral("placeChoice"));
  places_->setAccessibleName(tr("Place"));
  visits_->setAccessibleName(tr("Visit"));
  note_->setObjectName(QStringLiteral("placeNote"));
  note_->setProperty("role", "muted");
  note_->setWordWrap(true);
  facts_->setObjectName(QStringLiteral("placeFacts"));
  facts_layout_->setContentsMargins(0, 4, 0, 4);
  facts_layout_->setHorizontalSpacing(12);
  facts_layout_->setVerticalSpacing(3);
  facts_layout_->setColumnStretch(1, 1);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 8, 0, 0);
  auto* row = new QHBoxLayout;
  row->addWidget(places_, 1);
  row->addWidget(visits_);
  layout->addLayout(row);
  layout->addWidget(facts_);
  layout->addWidget(note_);
  layout->addWidget(position_, 3);
  layout->addWidget(orientation_, 2);
  connect(&placingUnitNotifier(), &PlacingUnitNotifier::placingUnitChanged, this, &PlacePanel::showRow);
  connect(places_, &QComboBox::activated, this, [this] { emit nodeChosen(places_->currentData().toInt()); });
  connect(visits_, &QComboBox::currentIndexChanged, this, &PlacePanel::showRow);
  setNode(std::nullopt);
}

QTableWidget* PlacePanel::makeTable(const QString& name, const QString& title, const QString& unit) {
  auto* table = new QTableWidget(0, 2, this);
  table->setObjectName(name);
  table->setHorizontalHeaderLabels({title, unit});
  table->horizontalHeaderItem(0)->setTextAlignment(Qt::AlignLeft | Qt::AlignVCenter);
  table->horizontalHeaderItem(1)->setTextAlignment(Qt::AlignRight | Qt::AlignVCenter);
  // A selected row would make its headings bold, and wider than their columns.
  table->horizontalHeader()->setHighlightSections(false);
  table->horizontalHeader()->setMinimumSectionSize(kNarrowestColumn);
  table->horizontalHeader()->setSectionResizeMode(0, QHeaderView::Stretch);
  table->horizontalHeader()->setSectionResizeMode(1, QHeaderView::ResizeToContents);
  table->verticalHeader()->hide();
  table->verticalHeader()->setDefaultSectionSize(kPlaceRowHeight);
  table->setShowGrid(false);
  table->setSelectionBehavior(QAbstractItemView::SelectRows);
  table->setEditTriggers(QAbstractItemView::NoEditTriggers);
  return table;
}

void PlacePanel::setData(const CalibrationTable& table, std::function<SampleTable(int)> samples_at,
                         const std::optional<evaluation::Comparison>& comparison) {
  table_ = table;
  samples_at_ = std::move(samples_at);
  comparison_ = comparison;
  fillPlaces();
  setNode(node_);
}

void PlacePanel::fillPlaces() {
  const QSignalBlocker quiet(places_);
  places_->clear();
  places_->setPlaceholderText(tr("No place chosen"));
  std::set<int> seen;
  for (const Node& node : table_.nodes)
    if (seen.insert(node.node).second)
      places_->addItem(QString::fromStdString(placeName(node.node, node.index)), node.node);
  places_->setCurrentIndex(-1);
}

void PlacePanel::setNode(std::optional<int> node) {
  node_ = node;
  const QSignalBlocker quiet(places_);
  places_->setCurrentIndex(node ? places_->findData(*node) : -1);
  fillVisits();
  showRow();
  showResiduals();
}

void PlacePanel::fillVisits() {
  const QSignalBlocker quiet(visits_);
  visits_->clear();
  for (std::size_t row = 0; row < table_.nodes.size(); ++row) {
    const Node& node = table_.nodes[row];
    if (node_ == node.node)
      visits_->addItem(tr("sensor %1, visit %2").arg(node.sensor).arg(node.visit), static_cast<int>(row));
  }
  visits_->setVisible(visits_->count() > 1);
}

void PlacePanel::showRow() {
  while (QLayoutItem* item = facts_layout_->takeAt(0)) {
    delete item->widget();
    delete item;
  }
  const bool known = visits_->currentIndex() >= 0;
  facts_->setVisible(known);
  if (!known) {
    note_->setText(
        tr("Click a place in a view, or choose one above: its samples, and what every method leaves there."));
    note_->show();
    return;
  }
  const Node& node = table_.nodes[static_cast<std::size_t>(visits_->currentData().toInt())];
  int row = 0;
  for (const Fact& fact : nodeFacts(node, samples_at_(node.node))) {
    auto* name = new QLabel(fact.name, facts_);
    name->setProperty("role", "muted");
    auto* value = new QLabel(fact.value, facts_);
    value->setWordWrap(true);
    value->setTextInteractionFlags(Qt::TextSelectableByMouse);
    facts_layout_->addWidget(name, row, 0, Qt::AlignTop);
    facts_layout_->addWidget(value, row++, 1);
  }
}

void PlacePanel::showResiduals() {
  const auto of = [this](auto residuals) {
    return comparison_ && node_ ? residuals(*comparison_, *node_) : std::vector<PlaceResidual>();
  };
  const std::vector<PlaceResidual> position = of(positionResiduals), orientation = of(orientationResiduals);
  fill(position_, position);
  fill(orientation_, orientation);
  position_->setVisible(!position.empty());
  orientation_->setVisible(!orientation.empty());
  if (!node_) return;
  note_->setVisible(position.empty());
  note_->setText(tr("This place was not scored: it is skipped, or only the validation places were."));
}

void PlacePanel::fill(QTableWidget* table, const std::vector<PlaceResidual>& residuals) {
  table->setRowCount(static_cast<int>(residuals.size()));
  for (int row = 0; row < table->rowCount(); ++row) {
    const PlaceResidual& residual = residuals[static_cast<std::size_t>(row)];
    QTableWidgetItem* name = cell(
        residual.covered ? residual.method : tr("%1  (not covered: unchanged)").arg(residual.method), Qt::AlignLeft);
    QTableWidgetItem* error = cell(threeFigures(residual.error), Qt::AlignRight);
    if (!residual.covered)
      for (QTableWidgetItem* item : {name, error}) item->setForeground(theme().text_muted);
    if (residual.before) {
      QFont font = name->font();
      font.setItalic(true);
      name->setFont(font);
      error->setFont(font);
    }
    name->setToolTip(name->text());
    table->setItem(row, 0, name);
    table->setItem(row, 1, error);
  }
}

}  // namespace fieldtrue::widgets
