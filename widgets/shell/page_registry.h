#pragma once

#include <QString>
#include <span>

#include "widgets/workbench/workbench.h"

namespace fieldtrue::widgets {

enum class PageState { kNotYet, kReady, kDone, kAttention };

/// How far the work on a page is, in shape and words.
struct PageMark {
  PageState state = PageState::kNotYet;
  QString words = {};
};

/// One page of the window.
struct PageRow {
  const char* id;     ///< "acquire"; of its widget ("page_acquire"), its button ("step_acquire") and in sessions.
  const char* label;  ///< Below its symbol.
  const char* icon;
  const char* guide;  ///< The page of the guide that Help opens there.
  QWidget* (*make)(Workbench& workbench, QWidget* parent);
  PageMark (*mark)(const Workbench& workbench);
};

/// Every page, in the order of the rail.
std::span<const PageRow> pageRows();

/// The row of an id; that of "acquire" where there is none.
const PageRow& pageRow(const QString& id);

}  // namespace fieldtrue::widgets
