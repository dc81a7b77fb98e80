#include "calib/tables/table_metadata.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "calib/core/file_io.h"
#include "calib/core/nearest_name.h"
#include "calib/tables/small_letters.h"

namespace fieldtrue {

namespace {

/// Keys whose value must be one of a few words.
struct WordKey {
  std::string_view key;
  std::vector<std::string_view> words;
};
const std::array<WordKey, 4>& wordKeys() {
  static const std::array<WordKey, 4> keys{{{"frame", {"tracker", "jig", "room"}},
                                            {"excitation", {"ac", "pulsed_dc"}},
                                            {"transmitter_model", {"dipole", "planar_coils", "optical", "unknown"}},
                                            {"alignment", {"known", "unknown"}}}};
  return keys;
}

/// What is wrong with the value, empty when nothing.
std::string checkWord(const std::string& key, const std::string& value) {
  for (const WordKey& row : wordKeys()) {
    if (row.key != key || std::find(row.words.begin(), row.words.end(), value) != row.words.end()) continue;
    std::string wrong = "'" + value + "' is not one of ";
    for (const std::string_view word : row.words) {
      if (!wrong.ends_with(' ')) wrong += ", ";
      wrong += word;
    }
    return wrong;
  }
  return {};
}

/// Of metres, radians and hertz alike: what is beyond was never measured, and its square may overflow.
constexpr double kLargest = 1e9;

/// @return what is wrong with the value, empty when nothing
std::string storeIn(std::optional<double>& member, const std::string& value) {
  const std::optional<double> number = parseFinite(value);
  if (!number || *number < 0.0) return "'" + value + "' is not a number of 0 or more";
  if (*number > kLargest) return "'" + value + "' is too large to be measured";
  member = *number;
  return {};
}

std::string storeIn(std::optional<std::string>& member, const std::string& value) {
  member = value;
  return {};
}

/// Stores a value under a known key. @return what is wrong with it, empty when nothing
std::string store(TableMetadata& metadata, const std::string& key, const std::string& value) {
  if (std::string is_no_word = checkWord(key, value); !is_no_word.empty()) return is_no_word;
  bool is_known = false;
  std::string wrong;
  forEachStatement([&](std::string_view name, auto member) {
    if (name != key) return;
    is_known = true;
    wrong = storeIn(metadata.*member, value);
  });
  if (is_known) return wrong;
  if (key == "frame") {
    metadata.frame = value;
  } else if (key == "alignment") {
    metadata.alignment_known = value == "known";
  } else if (!key.starts_with(kSetupPrefix) || !state(metadata.setup, key.substr(kSetupPrefix.size()), value)) {
    std::string& kept = metadata.other[key];
    kept += (kept.empty() ? "" : "; ") + value;
  }
  return {};
}

const std::vector<std::string_view>& knownKeys() {
  static const std::vector<std::string_view> keys = [] {
    std::vector<std::string_view> all;
    forEachStatement([&](std::string_view key, auto) { all.push_back(key); });
    for (const WordKey& row : wordKeys()) all.push_back(row.key);
    for (const SetupFact& fact : setupFacts()) all.push_back(fact.file_key);
    return all;
  }();
  return keys;
}

/// The known key that a key looks like: the same with another unit or none, or with up to two slips of the hand.
std::optional<std::string_view> likelyKey(std::string_view key) {
  std::optional<std::string_view> likely;
  std::size_t fewest = 3;
  for (const std::string_view known : knownKeys()) {
    const std::size_t unit = known.rfind('_');
    const bool is_other_unit =
        unit != std::string_view::npos && smallLetters(key).starts_with(smallLetters(known.substr(0, unit)));
    const std::size_t slips = is_other_unit ? 0 : editDistance(smallLetters(key), smallLetters(known));
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

bool isUtf8(const std::string& text) {
  try {
    return !nlohmann::json(text).dump().empty();
  } catch (const nlohmann::json::type_error&) {
    return false;
  }
}

/// "t.nodes.csv, line 3"
std::string whereOf(const CsvReader& reader, const CsvReader::MetadataLine& line) {
  return reader.name() + ", line " + std::to_string(line.line);
}

std::string valueText(double value) { return formatNumber(value); }
const std::string& valueText(const std::string& value) { return value; }

}  // namespace

Result<TableMetadata> parseMetadata(const CsvReader& reader) {
  TableMetadata metadata;
  std::set<std::string> seen;
  for (const CsvReader::MetadataLine& line : reader.metadata()) {
    if (!isUtf8(line.key) || !isUtf8(line.value))
      return fail(ErrorCode::kBadInput, whereOf(reader, line) + ": " + std::string(kNotUtf8));
    const bool is_repeated = !seen.insert(line.key).second && !metadata.other.contains(line.key);
    const std::string wrong = is_repeated ? "it is given twice" : store(metadata, line.key, line.value);
    if (!wrong.empty())
      return fail(ErrorCode::kBadInput, whereOf(reader, line) + ", metadata " + line.key + ": " + wrong);
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
  forEachStatement([&](std::string_view key, auto member) {
    if (metadata.*member) line(key, valueText(*(metadata.*member)));
  });
  if (metadata.alignment_known) line("alignment", "known");
  for (const SetupFact& fact : setupFacts())
    if (const auto value = factOf(metadata.setup, fact.key)) line(fact.file_key, *value);
  for (const auto& [key, value] : metadata.other) line(key, value);
}

TableMetadata merged(TableMetadata known, const TableMetadata& more) {
  forEachStatement([&](std::string_view, auto member) {
    if (!(known.*member)) known.*member = more.*member;
  });
  known.alignment_known = known.alignment_known || more.alignment_known;
  known.setup.insert(more.setup.begin(), more.setup.end());
  known.other.insert(more.other.begin(), more.other.end());
  return known;
}

}  // namespace fieldtrue
