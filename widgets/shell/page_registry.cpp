// A new page: write it in widgets/pages (a QWidget over the Workbench) and add its row below. Rail, window, keys,
// sessions and Help read the table.
#include "widgets/shell/page_registry.h"

#include <QCoreApplication>
#include <algorithm>
#include <array>
#include <string_view>

#include "widgets/pages/acquire_page.h"
#include "widgets/pages/compare_page.h"
#include "widgets/pages/connect_page.h"
#include "widgets/pages/difference_page.h"
#include "widgets/pages/export_page.h"
#include "widgets/pages/gap_page.h"
#include "widgets/pages/import_page.h"
#include "widgets/pages/plan_page.h"
#include "widgets/pages/signal_page.h"
#include "widgets/pages/start_page.h"

namespace fieldtrue::widgets {
namespace {

struct PageWords {
  Q_DECLARE_TR_FUNCTIONS(PageWords)
};

template <class Page>
QWidget* make(Workbench& workbench, QWidget* parent) {
  return new Page(workbench, parent);
}

QWidget* makeGapPage(Workbench& workbench, QWidget* parent) { return new GapPage(workbench, {}, parent); }

/// Places that are done or skipped.
std::size_t handledPlaces(const Workbench& workbench) {
  return workbench.status().recorded->n_done + workbench.status().recorded->n_skipped;
}

PageState readyWithPlaces(const Workbench& workbench) {
  return handledPlaces(workbench) > 0 ? PageState::kReady : PageState::kNotYet;
}

PageMark markStart(const Workbench&) { return {}; }

PageMark markConnect(const Workbench& workbench) {
  switch (workbench.status().device) {
    case acquisition::DeviceState::kRunning:
      return {PageState::kDone, PageWords::tr("connected")};
    case acquisition::DeviceState::kFailed:
      return {PageState::kAttention,
              workbench.status().reconnecting ? PageWords::tr("reconnecting") : PageWords::tr("not connected")};
    default:
      return {PageState::kReady, PageWords::tr("not connected")};
  }
}

PageMark markSignal(const Workbench& workbench) {
  const bool running = workbench.status().device == acquisition::DeviceState::kRunning;
  return {running ? PageState::kReady : PageState::kNotYet,
          running ? PageWords::tr("look before a day's recording") : PageWords::tr("no tracker")};
}

PageMark markPlan(const Workbench& workbench) {
  if (workbench.sessionIsOpen()) return {PageState::kDone, PageWords::tr("session open")};
  return {PageState::kReady, PageWords::tr("no session")};
}

PageMark markAcquire(const Workbench& workbench) {
  const acquisition::AcquisitionStatus& status = workbench.status();
  const bool session = workbench.sessionIsOpen();
  const std::size_t handled = handledPlaces(workbench);
  const bool complete = session && !status.session->places.empty() && handled == status.session->places.size();
  const PageState state = complete           ? PageState::kDone
                          : status.attention ? PageState::kAttention
                          : session          ? PageState::kReady
                                             : PageState::kNotYet;
  return {state, session ? PageWords::tr("%1 of %2 places done").arg(handled).arg(status.session->places.size())
                         : PageWords::tr("no session")};
}

PageMark markCompare(const Workbench& workbench) {
  if (workbench.comparisonIsFinal()) return {PageState::kDone, PageWords::tr("compared")};
  return {readyWithPlaces(workbench), workbench.isComparing()  ? PageWords::tr("comparing")
                                      : workbench.comparison() ? PageWords::tr("compared in part")
                                                               : PageWords::tr("not compared yet")};
}

PageMark markGap(const Workbench& workbench) {
  if (workbench.gapReport()) return {PageState::kDone, PageWords::tr("diagnosed")};
  return {readyWithPlaces(workbench), PageWords::tr("not diagnosed yet")};
}

PageMark markExport(const Workbench& workbench) {
  if (workbench.correctorCorrects()) return {PageState::kReady, PageWords::tr("a calibration is ready")};
  return {PageState::kNotYet, PageWords::tr("no calibration yet")};
}

constexpr std::array kRows = {
    PageRow{"start", QT_TRANSLATE_NOOP("StepRail", "Start"), "home", "index", make<StartPage>, markStart},
    PageRow{"connect", QT_TRANSLATE_NOOP("StepRail", "Connect"), "connect", "trackers", make<ConnectPage>, markConnect},
    PageRow{"signal", QT_TRANSLATE_NOOP("StepRail", "Signal"), "signal", "signal", make<SignalPage>, markSignal},
    PageRow{"plan", QT_TRANSLATE_NOOP("StepRail", "Plan"), "plan", "recording", make<PlanPage>, markPlan},
    PageRow{"acquire", QT_TRANSLATE_NOOP("StepRail", "Acquire"), "acquire", "recording", make<AcquirePage>,
            markAcquire},
    PageRow{"compare", QT_TRANSLATE_NOOP("StepRail", "Compare"), "compare", "comparing", make<ComparePage>,
            markCompare},
    PageRow{"gap", QT_TRANSLATE_NOOP("StepRail", "Gap"), "gap", "diagnosis", makeGapPage, markGap},
    PageRow{"export", QT_TRANSLATE_NOOP("StepRail", "Export"), "export", "export", make<ExportPage>, markExport},
    PageRow{"difference", QT_TRANSLATE_NOOP("StepRail", "Changes"), "difference", "comparing", make<DifferencePage>,
            markStart},
    PageRow{"import", QT_TRANSLATE_NOOP("StepRail", "Import"), "import", "importing", make<ImportPage>, markStart},
};

}  // namespace

std::span<const PageRow> pageRows() { return kRows; }

const PageRow& pageRow(const QString& id) {
  const auto row =
      std::find_if(kRows.begin(), kRows.end(), [&](const PageRow& one) { return id == QLatin1String(one.id); });
  constexpr std::size_t kAcquire = 4;
  static_assert(std::string_view(kRows[kAcquire].id) == "acquire");
  return row != kRows.end() ? *row : kRows[kAcquire];
}

}  // namespace fieldtrue::widgets
