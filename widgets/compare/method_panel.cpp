#include "widgets/compare/method_panel.h"

#include <QApplication>
#include <QClipboard>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QLabel>
#include <QPushButton>
#include <QScrollArea>
#include <QShortcut>
#include <QTableView>
#include <QVBoxLayout>
#include <algorithm>

#include "widgets/forms/settings_form.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kRowHeight = 26;
constexpr int kMethodWidth = 152;
constexpr int kFormHeight = 132;

}  // namespace

MethodPanel::MethodPanel(ScoreModel::Part part, const QString& name, QWidget* parent)
    : QWidget(parent), part_(part), scores_(new ScoreModel(part, this)) {
  scores_->setEntries(registeredMethods(part));
  makeTable(name);
  about_ = new QLabel(this);
  about_->setObjectName(name + QStringLiteral("About"));
  about_->setProperty("role", "muted");
  about_->setWordWrap(true);
  form_ = new SettingsForm(this);
  auto* scroll = new QScrollArea(this);
  scroll->setWidget(form_);
  scroll->setWidgetResizable(true);
  scroll->setMaximumHeight(kFormHeight);
  scroll->setSizePolicy(QSizePolicy::Preferred, QSizePolicy::Maximum);
  scroll->setFocusPolicy(Qt::NoFocus);
  remove_ = new QPushButton(tr("Remove this variant"), this);
  remove_->setObjectName(name + QStringLiteral("Remove"));
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 8, 0, 0);
  layout->addWidget(makeTicks(name));
  layout->addWidget(table_, 1);
  layout->addWidget(about_);
  layout->addWidget(scroll);
  layout->addWidget(remove_);
  connect(form_, &SettingsForm::changed, this, &MethodPanel::onSettings);
  connect(remove_, &QPushButton::clicked, this, &MethodPanel::removeVariant);
  connect(scores_, &ScoreModel::ticksChanged, this, [this] {
    showTicks();
    emit ticksChanged();
  });
  connect(table_->selectionModel(), &QItemSelectionModel::currentRowChanged, this, &MethodPanel::onRow);
  showTicks();
  choose(QString());
}

QWidget* MethodPanel::makeTicks(const QString& name) {
  auto* bar = new QWidget(this);
  auto* layout = new QHBoxLayout(bar);
  layout->setContentsMargins(0, 0, 0, 0);
  ticks_ = new QLabel(bar);
  ticks_->setObjectName(name + QStringLiteral("Ticks"));
  ticks_->setProperty("role", "muted");
  layout->addWidget(ticks_, 1);
  const auto add = [&](const QString& label, const char* suffix, auto wanted) {
    auto* button = new QPushButton(label, bar);
    button->setObjectName(name + QString::fromLatin1(suffix));
    button->setProperty("segment", true);
    connect(button, &QPushButton::clicked, this, [this, wanted] {
      for (std::size_t entry = 0; entry < scores_->entries().size(); ++entry)
        scores_->tick(entry, wanted(methodInfo(part_, scores_->entries()[entry].id)));
    });
    layout->addWidget(button);
  };
  add(tr("All"), "All", [](const MethodInfo&) { return true; });
  add(tr("Quick"), "Quick", [](const MethodInfo& info) { return !info.slow; });
  add(tr("None"), "None", [](const MethodInfo&) { return false; });
  return bar;
}

void MethodPanel::makeTable(const QString& name) {
  sorted_ = new QSortFilterProxyModel(this);
  sorted_->setSourceModel(scores_);
  sorted_->setSortRole(ScoreModel::kSortRole);
  table_ = new QTableView(this);
  table_->setObjectName(name + QStringLiteral("Table"));
  table_->setAccessibleName(part_ == ScoreModel::Part::kPosition ? tr("Position methods") : tr("Orientation methods"));
  table_->setModel(sorted_);
  table_->setSortingEnabled(true);
  table_->sortByColumn(ScoreModel::kRms, Qt::AscendingOrder);
  table_->setShowGrid(false);
  table_->setWordWrap(false);
  table_->setSelectionBehavior(QAbstractItemView::SelectRows);
  table_->setSelectionMode(QAbstractItemView::SingleSelection);
  table_->setTabKeyNavigation(false);
  table_->verticalHeader()->hide();
  table_->verticalHeader()->setDefaultSectionSize(kRowHeight);
  QHeaderView* header = table_->horizontalHeader();
  header->setHighlightSections(false);
  header->setSectionResizeMode(QHeaderView::ResizeToContents);
  header->setSectionResizeMode(ScoreModel::kMethod, QHeaderView::Interactive);
  header->resizeSection(ScoreModel::kMethod, kMethodWidth);
  auto* copy = new QShortcut(QKeySequence::Copy, table_);
  copy->setContext(Qt::WidgetShortcut);
  connect(copy, &QShortcut::activated, this, [this] { QApplication::clipboard()->setText(scores_->toText()); });
}

void MethodPanel::setComparison(const std::optional<evaluation::Comparison>& comparison) {
  setting_up_ = true;
  scores_->setComparison(comparison);
  table_->setColumnHidden(ScoreModel::kUncovered, !scores_->anyUncovered());
  setting_up_ = false;
}

QString MethodPanel::method() const { return method_; }
QString MethodPanel::label() const {
  return method_ == QLatin1String("none") ? tr("no correction") : methodLabel(part_, method_.toStdString(), settings_);
}
QString MethodPanel::whyUnusable() const {
  const int row = currentRow();
  if (row < 0 || method_ == QLatin1String("none") || scores_->isUsable(row)) return {};
  return tr("%1: %2").arg(label(), scores_->about(row));
}
Settings MethodPanel::settings() const { return settings_; }

int MethodPanel::tickedCount() const {
  return static_cast<int>(std::count_if(scores_->entries().begin(), scores_->entries().end(),
                                        [](const MethodEntry& entry) { return entry.ticked; }));
}

int MethodPanel::currentRow() const {
  const QModelIndex current = table_->currentIndex();
  return current.isValid() ? sorted_->mapToSource(current).row() : -1;
}

void MethodPanel::chooseRow(int row) {
  const QModelIndex index = sorted_->mapFromSource(scores_->index(std::max(0, row), ScoreModel::kMethod));
  table_->setCurrentIndex(index);
  table_->scrollTo(index);
  onRow();
}

void MethodPanel::choose(const QString& method) {
  if (scores_->rowCount() == 0) return;
  const int row = scores_->rowOf(method == QLatin1String("none") ? QString() : method);
  if (row >= 0) chooseRow(row);
}

void MethodPanel::onRow() {
  const int row = currentRow();
  if (setting_up_ || row < 0) return;
  const QString method = scores_->method(row);
  method_ = method.isEmpty() ? QStringLiteral("none") : method;
  settings_ = scores_->settings(row);
  about_->setText(scores_->about(row));
  const auto entry = scores_->entry(row);
  remove_->setVisible(entry && scores_->entries()[*entry].variant);
  const MethodInfo info = methodInfo(part_, method_.toStdString());
  setting_up_ = true;
  form_->setSettings(method.isEmpty() ? std::span<const Setting>() : info.settings, settings_);
  setting_up_ = false;
  form_->parentWidget()->parentWidget()->setVisible(!method.isEmpty() && !info.settings.empty());
  emit methodChanged();
}

void MethodPanel::onSettings() {
  const int row = currentRow();
  if (setting_up_ || row < 0 || method_ == QLatin1String("none")) return;
  settings_ = form_->values();
  std::vector<MethodEntry> entries = scores_->entries();
  const auto entry = scores_->entry(row);
  const auto same = std::find_if(entries.begin(), entries.end(), [this](const MethodEntry& other) {
    return other.id == method_.toStdString() && other.settings == settings_;
  });
  std::size_t chosen = static_cast<std::size_t>(same - entries.begin());
  if (same == entries.end()) {
    // A variant that nobody has seen scored yet is edited in place; anything else stays for the comparison.
    const bool in_place = entry && entries[*entry].variant && !scores_->isScored(row);
    if (in_place)
      chosen = *entry;
    else
      entries.push_back({method_.toStdString(), settings_, true, true});
    entries[chosen].settings = settings_;
  }
  setting_up_ = true;
  scores_->setEntries(entries);
  const QModelIndex index = sorted_->mapFromSource(scores_->index(scores_->rowOfEntry(chosen), ScoreModel::kMethod));
  table_->setCurrentIndex(index);
  setting_up_ = false;
  about_->setText(scores_->about(currentRow()));
  remove_->setVisible(entries[chosen].variant);
  showTicks();
  emit methodChanged();
  emit ticksChanged();
}

void MethodPanel::removeVariant() {
  const int row = currentRow();
  const auto entry = row < 0 ? std::nullopt : scores_->entry(row);
  if (!entry || !scores_->entries()[*entry].variant) return;
  std::vector<MethodEntry> entries = scores_->entries();
  entries.erase(entries.begin() + static_cast<std::ptrdiff_t>(*entry));
  const QString method = method_;
  setting_up_ = true;
  scores_->setEntries(entries);
  setting_up_ = false;
  choose(method);
  showTicks();
  emit ticksChanged();
}

void MethodPanel::showTicks() {
  int slow = 0;
  for (const MethodEntry& entry : scores_->entries()) slow += !entry.ticked && methodInfo(part_, entry.id).slow;
  QString text = tr("%1 of %2 ticked").arg(tickedCount()).arg(scores_->entries().size());
  if (slow > 0) text += slow == 1 ? tr("; 1 slow one is not") : tr("; %1 slow ones are not").arg(slow);
  ticks_->setText(text);
}

}  // namespace fieldtrue::widgets
