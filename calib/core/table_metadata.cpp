#include "calib/core/table_metadata.h"

#include <algorithm>
#include <array>
#include <set>

#include "calib/core/file_io.h"

namespace fieldtrue {

namespace {

struct NumberKey {
  std::string_view key;
  std::optional<double> TableMetadata::*value;
};
constexpr std::array<NumberKey, 7> kNumberKeys{{{"carrier_hz", &TableMetadata::carrier_hz},
                                                {"rate_hz", &TableMetadata::rate_hz},
                                                {"quantum_m", &TableMetadata::quantum_m},
                                                {"jig_tolerance_m", &TableMetadata::jig_tolerance_m},
                                                {"jig_tolerance_rad", &TableMetadata::jig_tolerance_rad},
                                                {"alignment_tolerance_m", &TableMetadata::alignment_tolerance_m},
                                                {"alignment_tolerance_rad", &TableMetadata::alignment_tolerance_rad}}};

struct TextKey {
  std::string_view key;
  std::optional<std::string> TableMetadata::*value;
};
constexpr std::array<TextKey, 4> kTextKeys{{{"tracker", &TableMetadata::tracker},
                                            {"rig", &TableMetadata::rig},
                                            {"date", &TableMetadata::date},
                                            {"excitation", &TableMetadata::excitation}}};

/// Keys whose value must be one of a few words.
struct WordKey {
  std::string_view key;
  std::vector<std::string_view> words;
};
const std::array<WordKey, 3>& wordKeys() {
  static const std::array<WordKey, 3> keys{{{"frame", {"tracker", "jig", "room"}},
                                            {"excitation", {"ac", "pulsed_dc"}},
                                            {"alignment", {"known", "unknown"}}}};
  return keys;
}

/// What is wrong with the value, empty when nothing.
std::string checkWord(const std::string& key, const std::string& value) {
  for (const WordKey& row : wordKeys()) {
    if (row.key != key || std::find(row.words.begin(), row.words.end(), value) != row.words.end()) continue;
    std::string words;
    for (const std::string_view word : row.words) words += (words.empty() ? "" : ", ") + std::string(word);
    return "'" + value + "' is not one of " + words;
  }
  return {};
}

/// Stores a value under a known key. @return what is wrong with it, empty when nothing
std::string store(TableMetadata& metadata, const std::string& key, const std::string& value) {
  if (const std::string wrong = checkWord(key, value); !wrong.empty()) return wrong;
  for (const NumberKey& row : kNumberKeys) {
    if (row.key != key) continue;
    const std::optional<double> number = parseFinite(value);
    if (!number || *number < 0.0) return "'" + value + "' is not a number of 0 or more";
    metadata.*row.value = *number;
    return {};
  }
  for (const TextKey& row : kTextKeys) {
    if (row.key != key) continue;
    metadata.*row.value = value;
    return {};
  }
  if (key == "frame") {
    metadata.frame = value;
  } else if (key == "alignment") {
    metadata.alignment_known = value == "known";
  } else {
    std::string& kept = metadata.other[key];
    kept += (kept.empty() ? "" : "; ") + value;
  }
  return {};
}

std::string oneLine(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

}  // namespace

Result<TableMetadata> parseMetadata(const CsvReader& reader) {
  TableMetadata metadata;
  std::set<std::string> seen;
  for (const CsvReader::MetadataLine& line : reader.metadata()) {
    const bool is_repeated = !seen.insert(line.key).second && !metadata.other.contains(line.key);
    const std::string wrong = is_repeated ? "it is given twice" : store(metadata, line.key, line.value);
    if (!wrong.empty()) {
      return fail(ErrorCode::kBadInput,
                  reader.name() + ", line " + std::to_string(line.line) + ", metadata " + line.key + ": " + wrong);
    }
  }
  return metadata;
}

void writeMetadata(std::ostream& out, const TableMetadata& metadata) {
  const auto line = [&](std::string_view key, const std::string& value) {
    out << "# " << key << ": " << oneLine(value) << '\n';
  };
  line("frame", metadata.frame);
  for (const TextKey& row : kTextKeys) {
    if (metadata.*row.value) line(row.key, *(metadata.*row.value));
  }
  for (const NumberKey& row : kNumberKeys) {
    if (metadata.*row.value) line(row.key, formatNumber(*(metadata.*row.value)));
  }
  if (metadata.alignment_known) line("alignment", "known");
  for (const auto& [key, value] : metadata.other) line(key, value);
}

}  // namespace fieldtrue
