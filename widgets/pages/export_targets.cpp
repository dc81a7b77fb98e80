#include "widgets/pages/export_targets.h"

#include <QCoreApplication>
#include <QDateTime>
#include <QFileInfo>

#include "calib/evaluation/judged_calibration.h"
#include "calib/exporters/export_calibration.h"
#include "calib/exporters/registry.h"
#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "widgets/report/report.h"
#include "widgets/views/draw_picture.h"

namespace fieldtrue::widgets {
namespace {

struct ExportWords {
  Q_DECLARE_TR_FUNCTIONS(ExportPage)
};

/// Heading of the formats for one purpose.
QString sectionOf(exporters::Purpose purpose) {
  switch (purpose) {
    case exporters::Purpose::kFieldtrue:
      return ExportWords::tr("For Fieldtrue");
    case exporters::Purpose::kSlicer:
      return ExportWords::tr("For 3D Slicer and ITK");
    case exporters::Purpose::kParaView:
      return ExportWords::tr("For ParaView and VTK");
    case exporters::Purpose::kVrui:
      return ExportWords::tr("For Vrui");
    case exporters::Purpose::kNumbers:
      return ExportWords::tr("For Python, MATLAB and spreadsheets");
    case exporters::Purpose::kProgram:
      return ExportWords::tr("For a program of your own");
    case exporters::Purpose::kPeriod:
      return ExportWords::tr("For CAVE software of its time");
    case exporters::Purpose::kRigid:
      return ExportWords::tr("For PLUS and VRPN: the rigid part");
  }
  return {};
}

Result<std::string> said(const Result<void>& written, const std::string& note = {}) {
  if (!written) return tl::unexpected(written.error());
  return note;
}

ExportWriting calibrationWriter(const Workbench& workbench, const exporters::Exporter& exporter,
                                const ExportChoices& choices) {
  const bool bake = exporter.knows_pose && choices.bake && !workbench.corrector()->isBaked();
  exporters::ExportOptions options;
  options.name = QFileInfo(workbench.sessionPath()).completeBaseName().toStdString();
  options.mean_orientation = true;
  if (exporter.has_free_pitch) options.max_deviation_m = choices.deviation_m;
  if (exporter.may_be_inverse && choices.inverse) options.direction = exporters::Direction::kTrueToMeasured;
  const auto sensor = exporter.knows_pose ? std::nullopt : choices.sensor;
  return [corrector = *workbench.corrector(), exporter = &exporter, bake, deviation_m = choices.deviation_m, sensor,
          options](const std::string& path, const RunControl& control) mutable -> Result<std::string> {
    const Result<calibration::Corrector> written = bake     ? corrector.baked(deviation_m, control)
                                                   : sensor ? corrector.ofSensor(*sensor)
                                                            : Result<calibration::Corrector>(corrector);
    if (!written) return tl::unexpected(written.error());
    if (exporter->tells_error)
      if (const auto judged = evaluation::heldOutRms(*written, control))
        options.held_out = exporters::HeldOutError{judged->rms_mm / 1000.0, judged->validated};
    if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
    FT_TRY(const auto done, exporters::exportCalibration(*exporter, *written, options, path, control));
    std::string note = bake ? written->report().notes.back() : std::string();
    for (const std::string& one : done.notes) note += (note.empty() ? "" : " ") + one;
    return note;
  };
}

ReportInput reportInput(const Workbench& workbench) {
  ReportInput input;
  input.draw = drawPictures;
  input.table = workbench.table();
  if (workbench.comparison()) input.comparison = *workbench.comparison();
  input.gap = workbench.gapReport();
  input.source = workbench.sessionPath().toStdString();
  input.plan = toJson(workbench.plan()).dump();
  input.places = workbench.status().session->places;
  input.states = workbench.status().recorded->states;
  if (!workbench.comparisonIsFinal()) {
    const Workbench::MethodCount count = workbench.comparedMethods();
    input.notes.push_back("The comparison tells " + std::to_string(count.done) + " of " + std::to_string(count.wanted) +
                          " methods that were asked for: it was not finished.");
  }
  input.made_at = QDateTime::currentDateTime().toString(Qt::ISODate).toStdString();
  return input;
}

ExportTarget nodesTarget(const Workbench& workbench) {
  return {QStringLiteral("nodes"),
          ExportWords::tr("Node table"),
          QStringLiteral(".nodes.csv"),
          ExportWords::tr("One row per place: what the rig says and what the tracker said."),
          ExportWords::tr("Recording and report"),
          nullptr,
          [&workbench](const ExportChoices&) -> ExportWriting {
            return [table = workbench.recordedTable()](const std::string& path, const RunControl&) {
              return said(writeNodeTable(std::filesystem::path(path), table));
            };
          }};
}

ExportTarget samplesTarget(const Workbench& workbench) {
  return {QStringLiteral("samples"),
          ExportWords::tr("Raw samples"),
          QStringLiteral(".samples.csv"),
          ExportWords::tr("Every reading that was taken at the places."),
          ExportWords::tr("Recording and report"),
          nullptr,
          [&workbench](const ExportChoices&) -> ExportWriting {
            return [samples = workbench.samples()](const std::string& path, const RunControl&) {
              return said(writeSampleTable(std::filesystem::path(path), samples));
            };
          }};
}

ExportTarget reportTarget(const Workbench& workbench) {
  return {
      QStringLiteral("report"),
      ExportWords::tr("Report"),
      QStringLiteral(".html"),
      ExportWords::tr("One page with pictures, the method table, the verdict and where it all came from; any browser."),
      ExportWords::tr("Recording and report"),
      nullptr,
      [&workbench](const ExportChoices&) -> ExportWriting {
        return [input = reportInput(workbench)](const std::string& path, const RunControl&) {
          return said(writeHtmlReport(input, path));
        };
      }};
}

}  // namespace

std::vector<ExportTarget> exportTargets(const Workbench& workbench) {
  std::vector<ExportTarget> targets;
  for (const exporters::Exporter& exporter : exporters::exporters())
    targets.push_back({QString::fromStdString(exporter.id), QString::fromStdString(exporter.label),
                       QString::fromStdString(exporter.extension),
                       ExportWords::tr("For %1. In the file: %2.")
                           .arg(QString::fromStdString(exporter.reads_it), QString::fromStdString(exporter.in_words)),
                       sectionOf(exporter.purpose), &exporter, [&workbench, &exporter](const ExportChoices& choices) {
                         return calibrationWriter(workbench, exporter, choices);
                       }});
  targets.push_back(nodesTarget(workbench));
  targets.push_back(samplesTarget(workbench));
  targets.push_back(reportTarget(workbench));
  return targets;
}

}  // namespace fieldtrue::widgets
