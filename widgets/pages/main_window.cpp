#include "widgets/pages/main_window.h"

#include <QCloseEvent>
#include <QFileInfo>
#include <QHBoxLayout>
#include <QSettings>
#include <QStackedWidget>
#include <QVBoxLayout>

#include "widgets/pages/acquire_page.h"
#include "widgets/pages/compare_page.h"
#include "widgets/pages/connect_page.h"
#include "widgets/pages/device_strip.h"
#include "widgets/pages/export_page.h"
#include "widgets/pages/gap_page.h"
#include "widgets/pages/message_line.h"
#include "widgets/pages/plan_page.h"
#include "widgets/pages/start_page.h"
#include "widgets/pages/step_rail.h"
#include "widgets/views/theme.h"

namespace fieldtrue {

MainWindow::MainWindow(QWidget* parent) : QMainWindow(parent), workbench_(new Workbench(this)) {
  setWindowTitle(tr("Fieldtrue"));
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

  addPage(Step::kStart, new StartPage(*workbench_, this));
  addPage(Step::kConnect, new ConnectPage(*workbench_, this));
  addPage(Step::kPlan, new PlanPage(*workbench_, this));
  addPage(Step::kAcquire, new AcquirePage(*workbench_, this));
  addPage(Step::kCompare, new ComparePage(*workbench_, this));
  gap_ = new GapPage(*workbench_, {}, this);
  addPage(Step::kGap, gap_);
  addPage(Step::kExport, new ExportPage(*workbench_, this));

  connect(rail_, &StepRail::stepClicked, workbench_, &Workbench::goToStep);
  connect(workbench_, &Workbench::stepRequested, this, &MainWindow::openStep);
  connect(workbench_, &Workbench::messageShown, messages_, &MessageLine::show);
  connect(workbench_, &Workbench::statusChanged, strip_, &DeviceStrip::setStatus);
  connect(workbench_, &Workbench::statusChanged, this, &MainWindow::showStates);
  connect(workbench_, &Workbench::comparisonChanged, this, &MainWindow::showStates);
  connect(workbench_, &Workbench::correctorChanged, this, &MainWindow::showStates);
  connect(gap_, &GapPage::changed, this, &MainWindow::showStates);
  connect(workbench_, &Workbench::sessionChanged, this, [this] {
    setWindowTitle(tr("%1 - Fieldtrue").arg(QFileInfo(workbench_->sessionPath()).completeBaseName()));
  });
  connect(&themeNotifier(), &ThemeNotifier::themeChanged, rail_, &StepRail::refreshIcons);
  restoreLayout();
  openStep(Step::kStart);
  showStates();
}

MainWindow::~MainWindow() = default;

void MainWindow::addPage(Step step, QWidget* page) {
  page->setObjectName(QStringLiteral("page_") + stepId(step));
  page_of_[step] = page;
  pages_->addWidget(page);
}

void MainWindow::openStep(Step step) {
  messages_->clearInformation();
  pages_->setCurrentWidget(page_of_.at(step));
  rail_->setCurrent(step);
}

void MainWindow::showStates() {
  const AcquisitionStatus& status = workbench_->status();
  const bool running = status.device == DeviceState::kRunning;
  const bool session = workbench_->sessionIsOpen();
  const std::size_t handled = status.n_done + status.n_skipped;
  const bool complete = session && !status.places.empty() && handled == status.places.size();
  rail_->setState(Step::kConnect,
                  running                                 ? StepState::kDone
                  : status.device == DeviceState::kFailed ? StepState::kAttention
                                                          : StepState::kReady,
                  running ? tr("connected") : tr("not connected"));
  rail_->setState(Step::kPlan, session ? StepState::kDone : StepState::kReady,
                  session ? tr("session open") : tr("no session"));
  rail_->setState(Step::kAcquire,
                  complete           ? StepState::kDone
                  : status.attention ? StepState::kAttention
                  : session          ? StepState::kReady
                                     : StepState::kNotYet,
                  session ? tr("%1 of %2 places done").arg(handled).arg(status.places.size()) : tr("no session"));
  rail_->setState(Step::kCompare,
                  workbench_->comparison() ? StepState::kDone
                  : handled > 0            ? StepState::kReady
                                           : StepState::kNotYet,
                  workbench_->comparison() ? tr("compared") : tr("not compared yet"));
  rail_->setState(Step::kGap,
                  gap_->report() ? StepState::kDone
                  : handled > 0  ? StepState::kReady
                                 : StepState::kNotYet,
                  gap_->report() ? tr("diagnosed") : tr("not diagnosed yet"));
  rail_->setState(Step::kExport, workbench_->corrector() ? StepState::kReady : StepState::kNotYet,
                  workbench_->corrector() ? tr("a calibration is ready") : tr("no calibration yet"));
}

void MainWindow::restoreLayout() {
  resize(1280, 800);
  const QByteArray geometry = QSettings().value(QStringLiteral("geometry")).toByteArray();
  if (!geometry.isEmpty()) restoreGeometry(geometry);
}

void MainWindow::closeEvent(QCloseEvent* event) {
  QSettings().setValue(QStringLiteral("geometry"), saveGeometry());
  event->accept();
}

}  // namespace fieldtrue
