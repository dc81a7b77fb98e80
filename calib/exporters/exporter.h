#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/exporters/export_subject.h"
#include "calib/exporters/lattice_field.h"

namespace fieldtrue::exporters {

/// For what a file is wanted: the cards of the window.
enum class Purpose { kFieldtrue, kSlicer, kParaView, kVrui, kNumbers, kProgram, kPeriod, kRigid };

/// How a written file compares with the calibration at 10,000 points of the region, read back from the disk.
struct Deviation {
  double worst_m = 0.0;
  double p99_m = 0.0;
  std::size_t n_points = 0;
};

/// What is to be said of a file that was written.
struct Written {
  std::optional<Deviation> deviation;
  std::vector<std::string> notes;
};

/// One row of the exporter registry.
struct Exporter {
  std::string id;
  std::string label;
  std::string extension;  ///< ".csv"
  std::string reads_it;   ///< Which programs read the file, for menus.
  std::string in_words;   ///< Unit, frame and direction of the file, for menus.
  Purpose purpose = Purpose::kFieldtrue;
  bool may_be_inverse = false;  ///< Can be written true to measured.
  bool knows_pose = false;      ///< Keeps what depends on how the sensor is turned, or on which sensor it is.
  bool tells_error = true;      ///< States how far the calibration errs on places that its fits did not see.
  bool has_free_pitch = false;  ///< A lattice whose pitch is chosen for the deviation that is allowed.
  bool is_folder = false;       ///< Writes a folder of files.
  Result<Written> (*write)(const ExportSubject&, const ExportOptions&, const std::filesystem::path&,
                           const RunControl&) = nullptr;
  /// @error kUnsupported where such a file cannot hold this calibration, whatever the options; null = it holds any
  Result<void> (*check)(const calibration::Corrector&) = nullptr;
  /// What stands in such a file, in metres and the frames of the calibration; null where the file is no lattice.
  Result<LatticeField> (*read)(const std::filesystem::path&) = nullptr;
};

}  // namespace fieldtrue::exporters
