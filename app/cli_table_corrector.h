#pragma once

#include <array>
#include <cstddef>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/cli_setup_check.h"
#include "calib/calibration/corrector.h"
#include "calib/core/error.h"
#include "calib/core/pose.h"
#include "calib/recording/unit_slip.h"
#include "calib/tables/csv_reader.h"

namespace fieldtrue::cli {

/// How many rows of a table were what.
struct RowCounts {
  std::size_t all = 0;
  std::size_t outside = 0;   ///< Of the calibrated region.
  std::size_t lost = 0;      ///< Without a pose.
  std::size_t unturned = 0;  ///< With a position and no orientation.
  std::size_t other_setup = 0;
  std::size_t other_sensor = 0;  ///< Of a sensor that has no correction of its own, where each has one.
};

/// Corrects the poses of a table of any length, row by row.
class TableCorrector {
 public:
  /// @param stated of the set-up, by a person @param name of the table, for messages
  TableCorrector(const calibration::Corrector& corrector, Setup stated, std::istream& in, std::string name);

  /// Copies the table with the corrected columns appended.
  /// @error kBadInput naming line and column
  Result<void> run(std::ostream& out);

  /// Once the table was run. @error kBadInput when the readings seem to be in another unit
  Result<void> checkUnits() const { return units_.check(); }

  const RowCounts& counts() const { return counts_; }
  /// Once the table was run: what its reader noticed.
  std::vector<std::string> notes() const;
  const std::string& setupDifference() const { return setup_.difference(); }
  bool hasOrientations() const { return columns_ && columns_->orientation; }

 private:
  /// Where the columns that matter stand.
  struct Columns {
    std::vector<std::size_t> position;
    std::optional<std::vector<std::size_t>> orientation;  ///< w x y z.
    std::optional<std::size_t> status;
    std::optional<std::size_t> sensor;
  };
  /// A row waiting for its batch.
  struct PendingRow {
    std::string text;
    std::optional<std::size_t> pose;  ///< Index into the batch's poses; none for a row that holds no reading.
    SetupMatch setup = SetupMatch::kUnknown;
  };
  /// What a row holds.
  struct Reading {
    Pose pose;
    bool is_turned = false;  ///< Its orientation is known.
  };

  Result<void> takeHeader(std::ostream& out);
  /// @return none where the tracker put its mark for a missing reading, or the reader failed
  std::optional<Reading> reading();
  Result<void> takeRow();
  void flush(std::ostream& out);
  void writeCorrected(std::ostream& out, const Reading& reading, const Pose& corrected, std::optional<int> sensor);
  double nearestOrientation_deg(const Pose& tracked) const;

  const calibration::Corrector& corrector_;
  std::vector<Eigen::Quaterniond> orientations_seen_;
  std::istream& in_;
  std::string name_;
  std::optional<CsvReader> reader_;
  recording::ReadingUnits units_;
  SetupCheck setup_;
  std::optional<Columns> columns_;
  std::vector<PendingRow> rows_;
  std::vector<Pose> poses_;
  std::vector<bool> turned_;                 ///< Whether each pose has an orientation.
  std::vector<std::optional<int>> sensors_;  ///< Of each pose.
  RowCounts counts_;
};

}  // namespace fieldtrue::cli
