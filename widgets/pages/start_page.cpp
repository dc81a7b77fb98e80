#include "widgets/pages/start_page.h"

#include <QDateTime>
#include <QFileDialog>
#include <QFileInfo>
#include <QHBoxLayout>
#include <QLabel>
#include <QLocale>
#include <QPushButton>
#include <QSettings>
#include <QVBoxLayout>

#include "widgets/style/icons.h"
#include "widgets/style/theme.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kStartColumnWidth = 560;

QPushButton* makeChoice(const QString& name, const QString& icon_name, const QString& title, const QString& text,
                        bool primary) {
  auto* button = new QPushButton(primary ? icon(icon_name, theme().on_accent) : icon(icon_name),
                                 QStringLiteral("%1\n%2").arg(title, text));
  button->setObjectName(name);
  button->setProperty("choice", true);
  button->setProperty("primary", primary);
  button->setIconSize(QSize(32, 32));
  button->setMinimumHeight(72);
  button->setAccessibleName(title);
  button->setAccessibleDescription(text);
  return button;
}

}  // namespace

StartPage::StartPage(Workbench& workbench, QWidget* parent) : QWidget(parent), workbench_(workbench) {
  auto* outer = new QHBoxLayout(this);
  auto* column = new QWidget(this);
  column->setMaximumWidth(kStartColumnWidth);
  auto* layout = new QVBoxLayout(column);
  layout->setSpacing(12);
  layout->addStretch(1);

  auto* title = new QLabel(tr("Fieldtrue"), column);
  title->setProperty("role", "display");
  auto* subtitle = new QLabel(
      tr("Trues the field of an electromagnetic tracker: measure it place by place, see its error, correct it."),
      column);
  subtitle->setProperty("role", "muted");
  subtitle->setWordWrap(true);
  layout->addWidget(title);
  layout->addWidget(subtitle);
  layout->addSpacing(12);

  auto* demo = makeChoice(QStringLiteral("startDemo"), QStringLiteral("play"), tr("Run the demonstration"),
                          tr("A simulated room with a steel floor, recorded by itself."), true);
  auto* connect_tracker = makeChoice(QStringLiteral("startConnect"), QStringLiteral("connect"), tr("Connect a tracker"),
                                     tr("Serial line, network or the simulated tracker."), false);
  auto* open = makeChoice(QStringLiteral("startOpen"), QStringLiteral("folder"), tr("Open a session"),
                          tr("Goes on exactly where it was closed."), false);
  auto* import = makeChoice(QStringLiteral("startImport"), QStringLiteral("import"), tr("Import a file"),
                            tr("A recording or a calibration of another program, or any table of poses."), false);
  connect(demo, &QPushButton::clicked, this, [this] { workbench_.startDemonstration(); });
  connect(connect_tracker, &QPushButton::clicked, this, [this] { workbench_.goToPage(QStringLiteral("connect")); });
  connect(open, &QPushButton::clicked, this, &StartPage::openWithDialog);
  connect(import, &QPushButton::clicked, this, [this] { workbench_.goToPage(QStringLiteral("import")); });
  for (QPushButton* button : {demo, connect_tracker, open, import}) layout->addWidget(button);

  layout->addSpacing(12);
  recent_ = new QVBoxLayout;
  recent_->setSpacing(4);
  layout->addLayout(recent_);
  layout->addStretch(2);
  outer->addStretch();
  outer->addWidget(column, 1);
  outer->addStretch();

  connect(&workbench_, &Workbench::sessionChanged, this, &StartPage::refreshRecent);
  refreshRecent();
}

void StartPage::refreshRecent() {
  while (QLayoutItem* item = recent_->takeAt(0)) {
    if (item->widget()) item->widget()->deleteLater();
    delete item;
  }
  const QStringList paths = QSettings().value(QStringLiteral("recent")).toStringList();
  bool first = true;
  for (const QString& path : paths) {
    const QFileInfo file(path);
    if (!file.exists()) continue;
    if (first) {
      auto* heading = new QLabel(tr("Recent sessions"));
      heading->setProperty("role", "heading");
      recent_->addWidget(heading);
      first = false;
    }
    const QString when = QLocale().toString(file.lastModified(), QLocale::ShortFormat);
    auto* button = new QPushButton(QStringLiteral("%1    %2").arg(file.completeBaseName(), when));
    button->setProperty("listItem", true);
    button->setToolTip(path);
    connect(button, &QPushButton::clicked, this, [this, path] { workbench_.openSession(path); });
    recent_->addWidget(button);
  }
}

void StartPage::openWithDialog() {
  const QString path = QFileDialog::getOpenFileName(this, tr("Open a session"), Workbench::sessionFolder(),
                                                    tr("Fieldtrue sessions (*.fieldtrue)"));
  if (!path.isEmpty()) workbench_.openSession(path);
}

}  // namespace fieldtrue::widgets
