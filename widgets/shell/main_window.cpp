#include "widgets/shell/main_window.h"

#include <QCloseEvent>
#include <QDragEnterEvent>
#include <QFileInfo>
#include <QHBoxLayout>
#include <QMimeData>
#include <QSettings>
#include <QShortcut>
#include <QStackedWidget>
#include <QUrl>
#include <QVBoxLayout>

#include "widgets/shell/device_strip.h"
#include "widgets/shell/help_window.h"
#include "widgets/shell/message_line.h"
#include "widgets/shell/page_registry.h"
#include "widgets/shell/step_rail.h"
#include "widgets/style/theme.h"

namespace fieldtrue::widgets {

MainWindow::MainWindow(QWidget* parent) : QMainWindow(parent), workbench_(new Workbench(this)) {
  setWindowTitle(tr("Fieldtrue"));
  setAcceptDrops(true);
  auto* center = new QWidget(this);
  auto* columns = new QHBoxLayout(center);
  columns->setContentsMargins(0, 0, 0, 0);
  columns->setSpacing(0);
  rail_ = new StepRail(center);
  pages_ = new QStackedWidget(center);
  messages_ = new MessageLine(center);
  strip_ = new DeviceStrip(center);
  auto* rows = new QVBoxLayout;
  rows->setContentsMargins(0, 0, 0, 0);
  rows->setSpacing(0);
  rows->addWidget(pages_, 1);
  rows->addWidget(messages_);
  rows->addWidget(strip_);
  columns->addWidget(rail_);
  columns->addLayout(rows, 1);
  setCentralWidget(center);

  for (const PageRow& row : pageRows()) {
    QWidget* page = row.make(*workbench_, this);
    page->setObjectName(QStringLiteral("page_") + QLatin1String(row.id));
    pages_->addWidget(page);
  }

  connect(rail_, &StepRail::pageClicked, workbench_, &Workbench::goToPage);
  connect(rail_, &StepRail::helpClicked, this, &MainWindow::openHelp);
  connect(new QShortcut(Qt::Key_F1, this), &QShortcut::activated, this, &MainWindow::openHelp);
  connect(workbench_, &Workbench::pageRequested, this, &MainWindow::openPage);
  connect(workbench_, &Workbench::messageShown, messages_, &MessageLine::show);
  connect(workbench_, &Workbench::conditionEnded, messages_, &MessageLine::endCondition);
  connect(workbench_, &Workbench::statusChanged, strip_, &DeviceStrip::setStatus);
  connect(workbench_, &Workbench::statusChanged, this, &MainWindow::showStates);
  connect(workbench_, &Workbench::comparisonChanged, this, &MainWindow::showStates);
  connect(workbench_, &Workbench::correctorChanged, this, &MainWindow::showStates);
  connect(workbench_, &Workbench::gapReportChanged, this, &MainWindow::showStates);
  connect(workbench_, &Workbench::sessionChanged, this, [this] {
    setWindowTitle(tr("%1 - Fieldtrue").arg(QFileInfo(workbench_->sessionPath()).completeBaseName()));
  });
  connect(&themeNotifier(), &ThemeNotifier::themeChanged, rail_, &StepRail::refreshIcons);
  restoreLayout();
  openPage(QStringLiteral("start"));
  showStates();
}

MainWindow::~MainWindow() = default;

void MainWindow::openPage(const QString& id) {
  messages_->leavePage();
  page_ = &pageRow(id);
  pages_->setCurrentIndex(static_cast<int>(page_ - pageRows().data()));
  rail_->setCurrent(*page_);
  // Who chose a page goes on in it: Tab leads to its first control.
  if (focusWidget() == nullptr || rail_->isAncestorOf(focusWidget())) pages_->currentWidget()->setFocus();
}

void MainWindow::showStates() {
  for (const PageRow& row : pageRows()) rail_->setMark(row, row.mark(*workbench_));
}

void MainWindow::restoreLayout() {
  resize(1280, 800);
  const QByteArray geometry = QSettings().value(QStringLiteral("geometry")).toByteArray();
  if (!geometry.isEmpty()) restoreGeometry(geometry);
}

void MainWindow::openHelp() {
  if (help_ == nullptr) help_ = new HelpWindow(this);
  help_->show();
  help_->showPage(QLatin1String(page_->guide));
  help_->raise();
  help_->activateWindow();
}

void MainWindow::dragEnterEvent(QDragEnterEvent* event) {
  if (event->mimeData()->hasUrls()) event->acceptProposedAction();
}

void MainWindow::dropEvent(QDropEvent* event) {
  const QList<QUrl> urls = event->mimeData()->urls();
  const QString path = urls.isEmpty() ? QString() : urls.front().toLocalFile();
  if (path.isEmpty()) return;
  event->acceptProposedAction();
  if (path.endsWith(QStringLiteral(".fieldtrue"), Qt::CaseInsensitive)) {
    workbench_->openSession(path);
    return;
  }
  if (path.endsWith(QStringLiteral(".ftcal.json"))) return workbench_->compareWith(path);
  workbench_->importFile(path);
}

void MainWindow::closeEvent(QCloseEvent* event) {
  QSettings().setValue(QStringLiteral("geometry"), saveGeometry());
  event->accept();
}

}  // namespace fieldtrue::widgets
