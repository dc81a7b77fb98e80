#pragma once

#include <array>
#include <deque>
#include <functional>
#include <istream>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/pose.h"
#include "calib/tables/line_reader.h"

namespace fieldtrue {

/// Follows the line in messages.
inline constexpr std::string_view kNotUtf8 = "this is not UTF-8 text; save the table as comma-separated UTF-8";

/// Where a table's columns have their names.
enum class CsvHeader {
  kRow,       ///< In the first row.
  kLooseRow,  ///< There too; a column that has none is called column1, column2, ... by where it stands.
  kComment,   ///< In the comment line `# columns = a,b,c`, as 3D Slicer writes it.
  kNone,      ///< Nowhere: they are called column1, column2, ...
};

/// Streams a comma-separated table with a header row: columns by name, `#` lines of metadata above it, errors that
/// name file, line and column. Accepts a byte-order mark, CRLF, blank lines and quoted fields within a line.
///
/// The field functions return a harmless value on failure and keep the first failure: look at error() once a row.
class CsvReader {
 public:
  /// Called with each line that is no row: comments, metadata and blank lines, from the first line on.
  using PassedOver = std::function<void(std::string_view line)>;

  struct MetadataLine {
    std::string key;
    std::string value;
    int line = 0;
  };

  /// Reads up to the header row.
  /// @param name stands in messages
  /// @param separator a blank also separates by runs of blanks
  /// @error kBadInput when there is no header, a column has no name or a name comes twice; kIo
  static Result<CsvReader> open(std::istream& in, std::string name, char separator = ',',
                                CsvHeader header = CsvHeader::kRow, PassedOver passed_over = {});
  /// From here on numbers may be written with a comma for the point.
  void allowDecimalComma() { decimal_comma_ = true; }

  const std::string& name() const { return lines_.name(); }
  const std::vector<std::string>& columns() const { return columns_; }
  /// What stands above the header row.
  const std::vector<MetadataLine>& metadata() const { return metadata_; }
  /// Once the rows are read: that lines below the header row look like metadata but are comments; none when none do.
  std::optional<std::string> noteOnLateMetadata() const;
  /// Once the rows are read: that the last line may be cut off; none when it has its line end.
  std::optional<std::string> noteOnLastLine() const;
  std::optional<std::size_t> find(std::string_view column) const;
  /// @error kBadInput naming the columns that are missing
  Result<std::vector<std::size_t>> require(std::span<const std::string_view> columns) const;
  /// Columns that only make sense together: all of them, or none.
  /// @error kBadInput when some are missing
  Result<std::optional<std::vector<std::size_t>>> group(std::span<const std::string_view> columns) const;
  /// Header names that are not among the known ones.
  std::vector<std::string> unknown(std::span<const std::string_view> known) const;

  /// Steps to the next row. @return false at the end
  /// @error kBadInput when a row has too few or too many fields or an open quote; kIo
  Result<bool> next();
  int line() const { return lines_.number(); }
  bool lineHasNewline() const { return lines_.hasNewline(); }
  /// The header or row read last, as it stands in the file.
  const std::string& text() const { return line_; }

  std::string_view field(std::size_t column) const { return fields_[column]; }
  bool isBlank(std::size_t column) const { return fields_[column].empty(); }
  double number(std::size_t column);  ///< Finite.
  int integer(std::size_t column);
  std::optional<double> optionalNumber(std::optional<std::size_t> column);  ///< None where absent or blank.
  std::optional<int> optionalInteger(std::optional<std::size_t> column);
  /// A unit quaternion w x y z with w >= 0; none where the columns are absent or all blank.
  std::optional<Eigen::Quaterniond> quaternion(const std::optional<std::vector<std::size_t>>& columns);

  void failAt(std::size_t column, const std::string& what);
  void failInLine(const std::string& what);
  const std::optional<Error>& error() const { return error_; }
  /// For rows that may hold anything.
  void forgetError() { error_.reset(); }

 private:
  CsvReader(std::istream& in, std::string name, char separator) : lines_(in, std::move(name)), separator_(separator) {}
  Result<void> readHeader(CsvHeader header);
  std::optional<double> finite(std::string_view text) const;
  void passOver() const;
  std::optional<MetadataLine> metadataLine(char mark) const;
  std::vector<std::string_view> lookalikes(const std::vector<std::string_view>& missing) const;
  std::string remarkOnMissing(const std::vector<std::string_view>& missing) const;
  bool splitLine();
  std::string_view takeQuoted(std::size_t& at);
  Result<void> checkColumns() const;
  std::string where() const;

  LineReader lines_;
  char separator_;
  bool decimal_comma_ = false;
  bool first_row_waits_ = false;  ///< It was read to count the columns of a table without names.
  std::vector<std::string> columns_;
  std::vector<MetadataLine> metadata_;
  std::optional<MetadataLine> late_metadata_;  ///< The first below the header row.
  int n_late_metadata_ = 0;
  std::string line_;
  std::vector<std::string_view> fields_;
  PassedOver passed_over_;
  std::deque<std::string> unquoted_;  ///< Fields of this line that held doubled quotes.
  std::optional<Error> error_;
};

/// A finite number without anything around it but blanks; none otherwise.
std::optional<double> parseFinite(std::string_view text);

}  // namespace fieldtrue
