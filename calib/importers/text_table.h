#pragma once

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/settings.h"
#include "calib/tables/csv_reader.h"

/// Tables of text of any program, read as the settings of format `columns` say.
namespace fieldtrue::importers {

/// The unit of the truth where it is that of the readings.
inline constexpr const char* kSameUnit = "same";

std::vector<std::string> lengthUnits();  ///< "mm", "cm", "in", "ft", "m"
double lengthUnit_m(std::string_view unit);
std::vector<std::string> separatorNames();

/// A file that is being read as the settings `separator`, `decimal` and `header` say.
class TextTable {
 public:
  /// @error kIo; as CsvReader::open
  static Result<TextTable> open(const std::filesystem::path& path, const Settings& settings);
  CsvReader& reader() { return *reader_; }

 private:
  std::unique_ptr<std::ifstream> in_;  ///< The reader holds on to it.
  std::unique_ptr<CsvReader> reader_;
};

/// The first rows as they stand in the file.
struct TextPreview {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;
};
/// @error as TextTable::open, and for a row that does not fit the header
Result<TextPreview> previewText(const std::filesystem::path& path, const Settings& settings, std::size_t most_rows);

}  // namespace fieldtrue::importers
