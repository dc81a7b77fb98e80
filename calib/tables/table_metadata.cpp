#include "calib/tables/table_metadata.h"

#include <algorithm>
#include <array>
#include <cctype>
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

const std::vector<std::string_view>& knownKeys() {
  static const std::vector<std::string_view> keys = [] {
    std::vector<std::string_view> all;
    all.reserve(kNumberKeys.size() + kTextKeys.size() + wordKeys().size());
    for (const NumberKey& row : kNumberKeys) all.push_back(row.key);
    for (const TextKey& row : kTextKeys) all.push_back(row.key);
    for (const WordKey& row : wordKeys()) all.push_back(row.key);
    return all;
  }();
  return keys;
}

/// Letters to insert, remove or replace to make one word of the other (V. I. Levenshtein, 1966).
std::size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row.back();
}

/// Letters only, small: Jig-Tolerance_M and jig_tolerance_m are the same.
std::string letters(std::string_view key) {
  std::string small;
  for (const char c : key)
    if (std::isalpha(static_cast<unsigned char>(c))) small += static_cast<char>(std::tolower(c));
  return small;
}

/// The known key that a key looks like: the same with another unit or none, or with up to two slips of the hand.
std::optional<std::string_view> likelyKey(std::string_view key) {
  std::optional<std::string_view> likely;
  std::size_t fewest = 3;
  for (const std::string_view known : knownKeys()) {
    const std::size_t unit = known.rfind('_');
    const bool is_other_unit =
        unit != std::string_view::npos && letters(key).starts_with(letters(known.substr(0, unit)));
    const std::size_t slips = is_other_unit ? 1 : editDistance(letters(key), letters(known));
    // In four letters two slips make another word.
    if (slips >= fewest || 3 * slips > known.size()) continue;
    fewest = slips;
    likely = known;
  }
  return likely;
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

std::vector<std::string> notesOnMetadata(const CsvReader& reader) {
  std::vector<std::string> notes;
  for (const CsvReader::MetadataLine& line : reader.metadata()) {
    const auto& known = knownKeys();
    if (std::find(known.begin(), known.end(), line.key) != known.end()) continue;
    if (const auto likely = likelyKey(line.key))
      notes.push_back(reader.name() + ", line " + std::to_string(line.line) + ": the metadata " + line.key +
                      " is not known and changes nothing; is " + std::string(*likely) + " meant?");
  }
  return notes;
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
