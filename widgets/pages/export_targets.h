#pragma once

#include <QString>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/exporters/exporter.h"
#include "widgets/workbench/workbench.h"

/// What can be written out of a session: its calibration in every format, its tables and the report.
namespace fieldtrue::widgets {

/// How a person wants files to be; each takes what applies to it.
struct ExportChoices {
  bool bake = false;
  bool inverse = false;  ///< True to measured.
  double deviation_m = 0.0;
  std::optional<int> sensor;  ///< Whose correction, where each has its own and the format holds one.
};

/// Writes one file beside the window; answers with what is to be said of it.
using ExportWriting = std::function<Result<std::string>(const std::string& path, const RunControl& control)>;

/// One thing that can be written.
struct ExportTarget {
  QString id;
  QString label;
  QString extension;
  QString reads_it;
  QString section;                                ///< The heading it stands under.
  const exporters::Exporter* exporter = nullptr;  ///< Of a calibration's format.
  /// Copies what is needed in the window's thread and returns the writing itself.
  std::function<ExportWriting(const ExportChoices&)> prepare;
};

std::vector<ExportTarget> exportTargets(const Workbench& workbench);

}  // namespace fieldtrue::widgets
