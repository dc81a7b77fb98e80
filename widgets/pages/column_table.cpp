#include "widgets/pages/column_table.h"

#include <QComboBox>
#include <QHeaderView>
#include <QSignalBlocker>

namespace fieldtrue::widgets {
namespace {

constexpr int kLeastWidth = 132;

QComboBox* choiceOf(const QTableWidget& table, int column) {
  return static_cast<QComboBox*>(table.cellWidget(0, column));
}

}  // namespace

ColumnTable::ColumnTable(QWidget* parent) : QTableWidget(parent) {
  setEditTriggers(QAbstractItemView::NoEditTriggers);
  setSelectionMode(QAbstractItemView::NoSelection);
  verticalHeader()->hide();
  setAccessibleName(tr("Columns of the table and what they are"));
}

void ColumnTable::setTable(const importers::TextPreview& preview, const std::vector<Setting>& roles,
                           const Settings& chosen) {
  roles_ = roles;
  columns_ = preview.columns;
  clear();
  setRowCount(static_cast<int>(preview.rows.size()) + 1);
  setColumnCount(static_cast<int>(columns_.size()));
  for (int column = 0; column < columnCount(); ++column) {
    const std::string& name = columns_[static_cast<std::size_t>(column)];
    setHorizontalHeaderItem(column, new QTableWidgetItem(QString::fromStdString(name)));
    auto* choice = new QComboBox;
    choice->setObjectName(QStringLiteral("column_") + QString::fromStdString(name));
    choice->setAccessibleName(tr("What column %1 is").arg(QString::fromStdString(name)));
    choice->addItem(tr("not used"), QString());
    for (const Setting& role : roles_)
      choice->addItem(QString::fromStdString(role.label), QString::fromStdString(role.key));
    for (const Setting& role : roles_)
      if (choiceSetting(chosen, role.key) == name)
        choice->setCurrentIndex(choice->findData(QString::fromStdString(role.key)));
    setCellWidget(0, column, choice);
    connect(choice, &QComboBox::currentIndexChanged, this, [this, column] { onChosen(column); });
    for (std::size_t row = 0; row < preview.rows.size(); ++row) {
      auto* item = new QTableWidgetItem(QString::fromStdString(preview.rows[row][static_cast<std::size_t>(column)]));
      item->setTextAlignment(Qt::AlignRight | Qt::AlignVCenter);
      setItem(static_cast<int>(row) + 1, column, item);
    }
  }
  resizeColumnsToContents();
  for (int column = 0; column < columnCount(); ++column)
    setColumnWidth(column, std::max(columnWidth(column), kLeastWidth));
}

void ColumnTable::onChosen(int column) {
  // One column to a role: who had it before has none.
  const QVariant role = choiceOf(*this, column)->currentData();
  for (int other = 0; other < columnCount(); ++other) {
    QComboBox* choice = choiceOf(*this, other);
    if (other == column || role.toString().isEmpty() || choice->currentData() != role) continue;
    const QSignalBlocker quiet(choice);
    choice->setCurrentIndex(0);
  }
  emit changed();
}

Settings ColumnTable::values() const {
  Settings values;
  for (const Setting& role : roles_) values[role.key] = std::string();
  for (int column = 0; column < columnCount(); ++column) {
    const std::string role = choiceOf(*this, column)->currentData().toString().toStdString();
    if (!role.empty()) values[role] = columns_[static_cast<std::size_t>(column)];
  }
  return values;
}

}  // namespace fieldtrue::widgets
