#include "widgets/pages/method_panel.h"

#include <QApplication>
#include <QClipboard>
#include <QComboBox>
#include <QHeaderView>
#include <QShortcut>
#include <QTableView>
#include <QVBoxLayout>

#include "calib/correctors/registry.h"
#include "widgets/pages/settings_form.h"

namespace fieldtrue {

MethodPanel::MethodPanel(ScoreModel::Part part, const QString& name, QWidget* parent)
    : QWidget(parent), entries_(entriesOf(part)), scores_(new ScoreModel(part, this)) {
  makeTable(name);
  choice_ = new QComboBox(this);
  choice_->setObjectName(name + QStringLiteral("Method"));
  choice_->setAccessibleName(part == ScoreModel::Part::kPosition ? tr("Position method") : tr("Orientation method"));
  for (const Entry& entry : entries_)
    choice_->addItem(QString::fromStdString(entry.label), QString::fromStdString(entry.id));
  form_ = new SettingsForm(this);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 8, 0, 0);
  layout->addWidget(table_, 1);
  layout->addWidget(choice_);
  layout->addWidget(form_);
  connect(choice_, &QComboBox::currentIndexChanged, this, [this](int row) {
    form_->setSettings(entries_[static_cast<std::size_t>(row)].settings);
    emit methodChanged();
  });
  connect(table_->selectionModel(), &QItemSelectionModel::currentRowChanged, this, [this](const QModelIndex& row) {
    if (row.isValid()) choose(scores_->method(sorted_->mapToSource(row).row()));
  });
}

std::vector<MethodPanel::Entry> MethodPanel::entriesOf(ScoreModel::Part part) {
  std::vector<Entry> entries;
  const auto add = [&entries](const auto& methods) {
    for (const auto& method : methods) entries.push_back({method.id, method.label, method.settings});
  };
  if (part == ScoreModel::Part::kPosition) {
    add(positionMethods());
  } else {
    add(orientationMethods());
  }
  return entries;
}

void MethodPanel::makeTable(const QString& name) {
  sorted_ = new QSortFilterProxyModel(this);
  sorted_->setSourceModel(scores_);
  sorted_->setSortRole(ScoreModel::kSortRole);
  table_ = new QTableView(this);
  table_->setObjectName(name + QStringLiteral("Table"));
  table_->setModel(sorted_);
  table_->setSortingEnabled(true);
  table_->sortByColumn(ScoreModel::kRms, Qt::AscendingOrder);
  table_->setShowGrid(false);
  table_->setSelectionBehavior(QAbstractItemView::SelectRows);
  table_->setSelectionMode(QAbstractItemView::SingleSelection);
  table_->verticalHeader()->hide();
  table_->horizontalHeader()->setSectionResizeMode(QHeaderView::ResizeToContents);
  table_->horizontalHeader()->setSectionResizeMode(ScoreModel::kMethod, QHeaderView::Stretch);
  auto* copy = new QShortcut(QKeySequence::Copy, table_);
  copy->setContext(Qt::WidgetShortcut);
  connect(copy, &QShortcut::activated, this, [this] { QApplication::clipboard()->setText(scores_->toText()); });
}

void MethodPanel::setComparison(const std::optional<Comparison>& comparison) {
  scores_->setComparison(comparison);
  table_->setColumnHidden(ScoreModel::kUncovered, !scores_->anyUncovered());
}

QString MethodPanel::method() const { return choice_->currentData().toString(); }
QString MethodPanel::label() const { return choice_->currentText(); }
Settings MethodPanel::settings() const { return form_->values(); }

void MethodPanel::choose(const QString& method) {
  const int row = choice_->findData(method.isEmpty() ? QStringLiteral("none") : method);
  if (row >= 0) choice_->setCurrentIndex(row);
}

}  // namespace fieldtrue
