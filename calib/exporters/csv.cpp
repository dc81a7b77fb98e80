#include <sstream>

#include "calib/calibration/alignment.h"
#include "calib/core/file_io.h"
#include "calib/correctors/base/method_text.h"
#include "calib/exporters/rows.h"
#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"

namespace fieldtrue::exporters {
namespace csv {
namespace {

constexpr const char* kAddedColumns =
    ",x_corrected_m,y_corrected_m,z_corrected_m,qw_corrected,qx_corrected,qy_corrected,qz_corrected,"
    "error_before_m,error_after_m,error_before_rad,error_after_rad,uncertainty_m,covered";

/// The table that was fitted, with what a reader must know about this file among its metadata.
CalibrationTable describedTable(const calibration::Corrector& corrector) {
  CalibrationTable table = corrector.table();
  const calibration::CorrectorChoice& choice = corrector.choice();
  const bool aligned = corrector.align() == calibration::AlignMode::kRigid;
  std::map<std::string, std::string>& other = table.metadata.other;
  other["unit"] = "metres, radians, seconds; quaternions w x y z";
  other["handedness"] = "right-handed";
  other["direction"] = "measured (x_m, tracker frame) to true (x_true_m, frame stated here)";
  other["fit_position"] = correctors::methodText(choice.position_id, choice.position_settings);
  other["fit_orientation"] = correctors::methodText(choice.orientation_id, choice.orientation_settings);
  other["fit_alignment"] = aligned ? "rigid, fitted to these rows" : "none";
  other["fit_rows"] = std::to_string(corrector.report().n_nodes);
  other["errors"] = aligned ? "in-sample; before = after the rigid alignment alone, after = with the correction"
                            : "in-sample; before = as tracked, after = with the correction";
  other["software"] = "Fieldtrue " FIELDTRUE_VERSION;
  return table;
}

std::string addedFields(const calibration::Corrector& corrector, const Node& node) {
  const calibration::Alignment& alignment = corrector.alignment();
  const Pose& tracked = node.tracker_from_sensor;
  const Pose corrected = corrector.correct(tracked, node.sensor);
  const Pose& truth = node.reference_from_sensor;
  const Eigen::Vector3d p_before_m = alignment.reference_from_tracker * tracked.position_m;
  const Eigen::Quaterniond q_before =
      alignment.reference_from_tracker.orientation * tracked.orientation * alignment.mountOf(node.sensor);
  const Eigen::Quaterniond q_after = canonical(corrected.orientation);
  const auto field = [](double value) { return "," + formatNumber(value); };

  std::string text;
  for (const double coordinate_m : corrected.position_m) text += field(coordinate_m);
  for (const double part : {q_after.w(), q_after.x(), q_after.y(), q_after.z()})
    text += node.has_orientation ? field(part) : ",";
  text += field((p_before_m - truth.position_m).norm()) + field((corrected.position_m - truth.position_m).norm());
  text += node.has_orientation ? field(angleBetween_rad(q_before, truth.orientation)) +
                                     field(angleBetween_rad(corrected.orientation, truth.orientation))
                               : ",,";
  const std::optional<double> uncertainty_m = node.has_orientation
                                                  ? corrector.uncertaintyAt_m(tracked, node.sensor)
                                                  : corrector.uncertainty_m(tracked.position_m, node.sensor);
  text += uncertainty_m ? field(*uncertainty_m) : ",";
  return text + (corrector.covers(tracked.position_m, node.sensor) ? ",1" : ",0");
}

/// A node table that any reader of node tables takes, with columns added at the end of each line.
std::string csvText(const calibration::Corrector& corrector) {
  const CalibrationTable table = describedTable(corrector);
  std::stringstream lines;
  writeNodeTable(lines, table);
  std::string text;
  std::string line;
  bool is_head_written = false;
  std::size_t row = 0;
  while (std::getline(lines, line)) {
    text += line;
    if (!line.starts_with('#')) {
      text += is_head_written ? addedFields(corrector, table.nodes[row++]) : kAddedColumns;
      is_head_written = true;
    }
    text += '\n';
  }
  return text;
}

Result<Written> write(const ExportSubject& subject, const ExportOptions&, const std::filesystem::path& path,
                      const RunControl&) {
  const std::string text = csvText(subject.corrector());
  FT_TRY_VOID(writeFileAtomically(path, [&](std::ostream& out) { out << text; }));
  return Written{};
}

}  // namespace
}  // namespace csv

Exporter csvExporter() {
  using namespace csv;
  return {.id = "csv",
          .label = "Node table (CSV)",
          .extension = ".csv",
          .reads_it = "spreadsheets, MATLAB, Python, R, and Fieldtrue itself",
          .in_words = "metres; the places, measured, true and corrected, with their errors",
          .purpose = Purpose::kNumbers,
          .knows_pose = true,
          .tells_error = false,
          .write = write};
}

}  // namespace fieldtrue::exporters
