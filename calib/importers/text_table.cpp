#include "calib/importers/text_table.h"

#include <algorithm>
#include <array>
#include <utility>

#include "calib/core/file_io.h"
#include "calib/core/units.h"

namespace fieldtrue::importers {
namespace {

constexpr std::array kUnits{std::pair{"mm", 1e-3}, std::pair{"cm", 1e-2}, std::pair{"in", kInch_m},
                            std::pair{"ft", kFoot_m}, std::pair{"m", 1.0}};
constexpr std::array kSeparators{std::pair{"tab", '\t'}, std::pair{"semicolon", ';'}, std::pair{"comma", ','},
                                 std::pair{"space", ' '}};

}  // namespace

std::vector<std::string> lengthUnits() {
  std::vector<std::string> names;
  for (const auto& [name, worth_m] : kUnits) names.emplace_back(name);
  return names;
}

double lengthUnit_m(std::string_view unit) {
  const auto found = std::find_if(kUnits.begin(), kUnits.end(), [&](const auto& one) { return one.first == unit; });
  FT_CHECK(found != kUnits.end());
  return found->second;
}

std::vector<std::string> separatorNames() {
  std::vector<std::string> names;
  for (const auto& [name, mark] : kSeparators) names.emplace_back(name);
  return names;
}

Result<TextTable> TextTable::open(const std::filesystem::path& path, const Settings& settings) {
  TextTable table;
  FT_TRY(std::ifstream in, openForReading(path));
  const bool has_decimal_comma = choiceSetting(settings, "decimal") == "comma";
  if (has_decimal_comma && choiceSetting(settings, "separator") == "comma")
    return fail(ErrorCode::kBadInput,
                "columns: a comma cannot both separate fields and stand in numbers; choose another "
                "separator or decimal=point");
  table.in_ = std::make_unique<std::ifstream>(std::move(in));
  const std::string& name = choiceSetting(settings, "separator");
  const auto separator =
      std::find_if(kSeparators.begin(), kSeparators.end(), [&](const auto& one) { return name == one.first; });
  FT_CHECK(separator != kSeparators.end());
  FT_TRY(CsvReader reader, CsvReader::open(*table.in_, path.filename().string(), separator->second,
                                           boolSetting(settings, "header") ? CsvHeader::kLooseRow : CsvHeader::kNone));
  table.reader_ = std::make_unique<CsvReader>(std::move(reader));
  if (has_decimal_comma) table.reader_->allowDecimalComma();
  return table;
}

Result<TextPreview> previewText(const std::filesystem::path& path, const Settings& settings, std::size_t most_rows) {
  FT_TRY(TextTable text, TextTable::open(path, settings));
  CsvReader& reader = text.reader();
  TextPreview preview;
  preview.columns = reader.columns();
  while (preview.rows.size() < most_rows) {
    FT_TRY(const bool more, reader.next());
    if (!more) break;
    std::vector<std::string>& row = preview.rows.emplace_back();
    for (std::size_t i = 0; i < preview.columns.size(); ++i) row.emplace_back(reader.field(i));
  }
  if (preview.rows.empty()) return fail(ErrorCode::kBadInput, reader.name() + " has a header but no rows");
  return preview;
}

}  // namespace fieldtrue::importers
