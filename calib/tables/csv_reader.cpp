#include "calib/tables/csv_reader.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/core/file_io.h"
#include "calib/core/trimmed.h"
#include "calib/tables/small_letters.h"

namespace fieldtrue {

namespace {

/// Unit to within this is left as it is, so that what was written reads back to the same bits.
constexpr double kUnit = 1e-12;
constexpr double kLargestNormError = 0.05;

constexpr std::string_view kNumbersInHead = "; it holds numbers where the names of the columns must stand";

std::string inQuotes(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  return "'" + std::string(text.substr(0, kLongest)) + (text.size() > kLongest ? "..." : "") + "'";
}

std::string joined(const std::vector<std::string_view>& words) {
  std::string text;
  for (const std::string_view word : words) text += (text.empty() ? "" : ", ") + std::string(word);
  return text;
}

constexpr std::array<std::string_view, 13> kUnitWords{"",   "m", "mm", "cm",  "um",  "in",    "inch",
                                                      "ft", "s", "ms", "deg", "rad", "metres"};

/// Whether a column of a head means what a required one does, but for the unit, brackets around it or capitals.
bool looksLike(std::string_view column, std::string_view required) {
  const std::string_view stem = required.substr(0, required.rfind('_'));
  if (column.size() < stem.size()) return false;
  const auto isSame = [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
  };
  if (!std::equal(stem.begin(), stem.end(), column.begin(), isSame)) return false;
  const std::string_view rest = column.substr(stem.size());
  if (!rest.empty() && std::isalnum(static_cast<unsigned char>(rest.front()))) return false;
  return std::find(kUnitWords.begin(), kUnitWords.end(), smallLetters(rest)) != kUnitWords.end();
}

std::string fieldCount(std::size_t count) { return std::to_string(count) + (count == 1 ? " field" : " fields"); }

}  // namespace

std::optional<double> parseFinite(std::string_view text) {
  std::string_view digits = trimmed(text);
  if (digits.size() > 1 && digits.front() == '+' && digits[1] != '-') digits.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

Result<CsvReader> CsvReader::open(std::istream& in, std::string name, char separator, CsvHeader header,
                                  PassedOver passed_over) {
  CsvReader reader(in, std::move(name), separator);
  reader.passed_over_ = std::move(passed_over);
  FT_TRY_VOID(reader.readHeader(header));
  return reader;
}

std::string CsvReader::where() const { return name() + ", line " + std::to_string(line()); }

void CsvReader::failAt(std::size_t column, const std::string& what) {
  if (!error_) error_ = Error{ErrorCode::kBadInput, where() + ", column " + columns_[column] + ": " + what};
}

void CsvReader::failInLine(const std::string& what) {
  if (!error_) error_ = Error{ErrorCode::kBadInput, where() + ": " + what};
}

void CsvReader::passOver() const {
  if (passed_over_) passed_over_(line_);
}

/// The `# key: value` of a comment; none when it holds no mark or no key.
std::optional<CsvReader::MetadataLine> CsvReader::metadataLine(char mark) const {
  const std::string_view text = std::string_view(line_).substr(1);
  const std::size_t at = text.find(mark);
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view key = trimmed(text.substr(0, at));
  if (key.empty()) return std::nullopt;
  return MetadataLine{std::string(key), std::string(trimmed(text.substr(at + 1))), line()};
}

Result<void> CsvReader::readHeader(CsvHeader header) {
  const bool is_comment_header = header == CsvHeader::kComment;
  while (true) {
    FT_TRY(const bool more, lines_.next(line_));
    if (!more) {
      return fail(ErrorCode::kBadInput,
                  name() + (line() == 0 ? " is empty" : " has no header row") + "; it needs a row of column names");
    }
    if (line_.find('\0') != std::string::npos) {
      return fail(ErrorCode::kBadInput, where() + ": " + std::string(kNotUtf8));
    }
    if (line_.starts_with('#')) {
      const std::optional<MetadataLine> metadata = metadataLine(is_comment_header ? '=' : ':');
      const bool is_header = is_comment_header && metadata && metadata->key == "columns";
      if (metadata && !is_header) metadata_.push_back(*metadata);
      if (is_header) line_ = metadata->value;
      if (!is_header) {
        passOver();
        continue;
      }
    }
    if (!trimmed(line_).empty()) break;
    passOver();
  }
  if (!splitLine()) return tl::unexpected(*error_);
  if (header == CsvHeader::kNone) {
    first_row_waits_ = true;
    for (std::size_t i = 1; i <= fields_.size(); ++i) columns_.push_back("column" + std::to_string(i));
    return {};
  }
  columns_.assign(fields_.begin(), fields_.end());
  for (std::size_t i = 0; i < columns_.size() && header == CsvHeader::kLooseRow; ++i)
    if (columns_[i].empty()) columns_[i] = "column" + std::to_string(i + 1);
  return checkColumns();
}

Result<void> CsvReader::checkColumns() const {
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (columns_[i].empty()) {
      return fail(ErrorCode::kBadInput, where() + ": column " + std::to_string(i + 1) + " has no name");
    }
    if (std::find(columns_.begin(), columns_.begin() + static_cast<std::ptrdiff_t>(i), columns_[i]) !=
        columns_.begin() + static_cast<std::ptrdiff_t>(i)) {
      const std::string remark = parseFinite(columns_[i]) ? std::string(kNumbersInHead) : "";
      return fail(ErrorCode::kBadInput, where() + ": column " + columns_[i] + " comes twice" + remark);
    }
  }
  return {};
}

/// Takes a quoted field that starts at `at` and steps behind its closing quote. Fails when there is none.
std::string_view CsvReader::takeQuoted(std::size_t& at) {
  const std::string_view text = line_;
  const std::size_t first = at + 1;
  bool has_doubled = false;
  for (std::size_t i = first; i < text.size(); ++i) {
    if (text[i] != '"') continue;
    if (i + 1 < text.size() && text[i + 1] == '"') {
      has_doubled = true;
      ++i;
      continue;
    }
    at = i + 1;
    const std::string_view inside = text.substr(first, i - first);
    if (!has_doubled) return inside;
    std::string plain;
    for (std::size_t k = 0; k < inside.size(); ++k) {
      plain += inside[k];
      if (inside[k] == '"') ++k;
    }
    return unquoted_.emplace_back(std::move(plain));
  }
  failInLine("a quoted field is not closed");
  at = text.size();
  return {};
}

bool CsvReader::splitLine() {
  fields_.clear();
  unquoted_.clear();
  const std::string_view text = line_;
  std::size_t at = 0;
  while (true) {
    while (at < text.size() && text[at] == ' ') ++at;
    if (separator_ == ' ' && at == text.size() && !fields_.empty()) break;
    if (at < text.size() && text[at] == '"') {
      fields_.push_back(takeQuoted(at));
      while (at < text.size() && text[at] == ' ') ++at;
      if (at < text.size() && text[at] != separator_ && separator_ != ' ') failInLine("text follows a closing quote");
      if (error_) return false;
      if (at == text.size()) break;
      at += text[at] == separator_ ? 1 : 0;
      continue;
    }
    const std::size_t end = std::min(text.find(separator_, at), text.size());
    fields_.push_back(trimmed(text.substr(at, end - at)));
    if (end == text.size()) break;
    at = end + 1;
  }
  return true;
}

Result<bool> CsvReader::next() {
  // Split again: the reader may have been moved, and its fields point into its line.
  if (std::exchange(first_row_waits_, false)) return splitLine();
  while (true) {
    const Result<bool> more = lines_.next(line_);
    if (!more || !*more) return more;
    const bool is_comment = line_.starts_with('#');
    if (!is_comment && !trimmed(line_).empty()) break;
    passOver();
    const std::optional<MetadataLine> metadata = is_comment ? metadataLine(':') : std::nullopt;
    // A key is one word; a remark like "moved at 10:30" is none.
    if (!metadata || metadata->key.find(' ') != std::string::npos) continue;
    if (++n_late_metadata_ == 1) late_metadata_ = metadata;
  }
  if (!splitLine()) return tl::unexpected(*error_);
  if (fields_.size() == columns_.size()) return true;
  failInLine("the row has " + fieldCount(fields_.size()) + ", the header has " + std::to_string(columns_.size()) +
             " columns" + (lineHasNewline() ? "" : "; the file ends in the middle of this row"));
  return tl::unexpected(*error_);
}

std::optional<std::size_t> CsvReader::find(std::string_view column) const {
  const auto found = std::find(columns_.begin(), columns_.end(), column);
  if (found == columns_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - columns_.begin());
}

std::vector<std::string_view> CsvReader::lookalikes(const std::vector<std::string_view>& missing) const {
  std::vector<std::string_view> alike;
  for (const std::string& column : columns_) {
    const auto isMeant = [&](std::string_view required) { return looksLike(column, required); };
    if (std::any_of(missing.begin(), missing.end(), isMeant)) alike.push_back(column);
  }
  return alike;
}

/// What may be the reason that required columns are missing; empty when nothing shows.
std::string CsvReader::remarkOnMissing(const std::vector<std::string_view>& missing) const {
  if (columns_.size() == 1 && columns_[0].find_first_of(";\t,| ") != std::string::npos)
    return "; its fields must be separated by commas";
  if (parseFinite(columns_[0])) return std::string(kNumbersInHead);
  const std::vector<std::string_view> alike = lookalikes(missing);
  if (alike.empty()) return {};
  return "; it has " + joined(alike) + ", but a name must be the same to the letter: it fixes the unit";
}

Result<std::vector<std::size_t>> CsvReader::require(std::span<const std::string_view> columns) const {
  std::vector<std::size_t> places;
  std::vector<std::string_view> missing;
  for (const std::string_view column : columns) {
    const std::optional<std::size_t> place = find(column);
    if (place) places.push_back(*place);
    if (!place) missing.push_back(column);
  }
  if (missing.empty()) return places;
  return fail(ErrorCode::kBadInput, where() + ": the header lacks " +
                                        (missing.size() == 1 ? "the required column " : "the required columns ") +
                                        joined(missing) + remarkOnMissing(missing));
}

Result<std::optional<std::vector<std::size_t>>> CsvReader::group(std::span<const std::string_view> columns) const {
  const auto present =
      std::count_if(columns.begin(), columns.end(), [&](auto column) { return find(column).has_value(); });
  if (present == 0) return std::nullopt;
  const Result<std::vector<std::size_t>> places = require(columns);
  if (places) return *places;
  return fail(ErrorCode::kBadInput, places.error().message + " (" + joined({columns.begin(), columns.end()}) +
                                        " belong together: all or none)");
}

std::optional<std::string> CsvReader::noteOnLateMetadata() const {
  if (!late_metadata_) return std::nullopt;
  return name() + ", line " + std::to_string(late_metadata_->line) + ": " +
         inQuotes("# " + late_metadata_->key + ": " + late_metadata_->value) +
         (n_late_metadata_ > 1 ? " and " + std::to_string(n_late_metadata_ - 1) + " more such lines stand"
                               : " stands") +
         " below the row of column names and counts as a comment; metadata belongs above it";
}

std::optional<std::string> CsvReader::noteOnLastLine() const {
  if (lineHasNewline()) return std::nullopt;
  return name() + ": the last line has no line end; it was taken as whole";
}

std::vector<std::string> CsvReader::unknown(std::span<const std::string_view> known) const {
  std::vector<std::string> others;
  for (const std::string& column : columns_) {
    if (std::find(known.begin(), known.end(), column) == known.end()) others.push_back(column);
  }
  return others;
}

std::optional<double> CsvReader::finite(std::string_view text) const {
  if (!decimal_comma_) return parseFinite(text);
  std::string pointed(text);
  std::replace(pointed.begin(), pointed.end(), ',', '.');
  return parseFinite(pointed);
}

double CsvReader::number(std::size_t column) {
  const std::string_view text = field(column);
  if (const std::optional<double> value = finite(text)) return *value;
  failAt(column, text.empty() ? "the field is blank, a number is needed" : inQuotes(text) + " is not a finite number");
  return 0.0;
}

int CsvReader::integer(std::size_t column) {
  const std::string_view text = field(column);
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc() && end == text.data() + text.size() && !text.empty()) return value;
  // Spreadsheets write the whole numbers of a column with blanks as 3.0.
  const std::optional<double> decimal = finite(text);
  const bool is_whole = decimal && *decimal == std::floor(*decimal) && std::abs(*decimal) < 2147483648.0;
  if (is_whole) return static_cast<int>(*decimal);
  failAt(column,
         text.empty() ? "the field is blank, a whole number is needed" : inQuotes(text) + " is not a whole number");
  return 0;
}

std::optional<double> CsvReader::optionalNumber(std::optional<std::size_t> column) {
  if (!column || isBlank(*column)) return std::nullopt;
  return number(*column);
}

std::optional<int> CsvReader::optionalInteger(std::optional<std::size_t> column) {
  if (!column || isBlank(*column)) return std::nullopt;
  return integer(*column);
}

std::optional<Eigen::Quaterniond> CsvReader::quaternion(const std::optional<std::vector<std::size_t>>& columns) {
  if (!columns) return std::nullopt;
  if (std::all_of(columns->begin(), columns->end(), [&](std::size_t c) { return isBlank(c); })) return std::nullopt;
  const std::vector<std::size_t>& c = *columns;
  Eigen::Quaterniond q(number(c[0]), number(c[1]), number(c[2]), number(c[3]));
  if (error_) return Eigen::Quaterniond::Identity();
  const double norm = q.norm();
  if (!(norm > 1e-6)) {
    failAt(c[0], "the quaternion is zero, a rotation has length 1");
  } else if (std::abs(norm - 1.0) > kLargestNormError) {
    failAt(c[0], "the quaternion has length " + formatNumber(norm) + ", a rotation has length 1");
  }
  if (error_) return Eigen::Quaterniond::Identity();
  if (std::abs(norm - 1.0) > kUnit) q.coeffs() /= norm;
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  return q;
}

}  // namespace fieldtrue
