#include "calib/importers/column_guess.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "calib/core/file_io.h"
#include "calib/core/number_text.h"
#include "calib/core/statistics.h"
#include "calib/core/trimmed.h"
#include "calib/importers/column_names.h"
#include "calib/importers/registry.h"
#include "calib/importers/text_table.h"
#include "calib/tables/line_reader.h"

namespace fieldtrue::importers {
namespace {

constexpr std::size_t kRowsLookedAt = 2000;
constexpr std::size_t kRowsThatMustFit = 20;
constexpr std::size_t kFewestColumns = 3;
/// Rows a place from which they are taken for samples, not for visits.
constexpr double kSamplesAtLeast = 5.0;
/// Widest and narrowest space that an electromagnetic tracker is calibrated in.
constexpr double kWidest_m = 8.0;
constexpr double kNarrowest_m = 0.1;
/// Angles beyond are no radians.
constexpr double kLargest_rad = 6.5;
/// Numbers beyond are dates, or of another unit.
constexpr double kLongestSession_s = 1e8;

/// A group of columns that belong together.
struct FoundGroup {
  std::string stem;
  bool is_true = false;
  bool is_reading = false;
  std::vector<std::string> columns;
  std::set<std::string> units;
};

/// Complete groups in the order of the table.
std::vector<FoundGroup> groupsOf(const std::vector<std::string>& columns, const std::vector<ColumnName>& names,
                                 const std::vector<std::string>& parts) {
  std::vector<FoundGroup> groups;
  std::vector<std::string> stems;
  for (const ColumnName& name : names)
    if (std::find(parts.begin(), parts.end(), name.part) != parts.end() &&
        std::find(stems.begin(), stems.end(), name.stem) == stems.end())
      stems.push_back(name.stem);
  for (const std::string& stem : stems) {
    FoundGroup group{stem, false, false, {}, {}};
    for (const std::string& part : parts)
      for (std::size_t i = 0; i < names.size(); ++i) {
        if (names[i].part != part || names[i].stem != stem || group.columns.size() == parts.size()) continue;
        group.columns.push_back(columns[i]);
        group.is_true = names[i].is_true;
        group.is_reading = names[i].is_reading;
        if (!names[i].unit.empty()) group.units.insert(names[i].unit);
        break;
      }
    if (group.columns.size() == parts.size()) groups.push_back(group);
  }
  return groups;
}

std::string listed(const std::vector<std::string>& columns) {
  std::string text;
  for (const std::string& column : columns) (text += text.empty() ? "" : ", ") += column;
  return text;
}

/// One guess in work: the table and what was found in it.
struct Guess {
  TextPreview table;
  std::vector<ColumnName> names;
  ColumnGuess result;
  std::optional<std::string> tracked_owner, true_owner;  ///< Whose positions were taken.

  void set(const std::string& key, const std::string& value) { result.settings[key] = value; }
  void say(std::string reason) { result.reasons.push_back(std::move(reason)); }
  std::optional<std::size_t> columnOf(const std::string& key) const {
    const std::string& name = choiceSetting(result.settings, key);
    const auto found = std::find(table.columns.begin(), table.columns.end(), name);
    if (name.empty() || found == table.columns.end()) return std::nullopt;
    return static_cast<std::size_t>(found - table.columns.begin());
  }
  double number(const std::string& text) const {
    std::string pointed = text;
    if (choiceSetting(result.settings, "decimal") == "comma") std::replace(pointed.begin(), pointed.end(), ',', '.');
    return parseFinite(pointed).value_or(std::nan(""));
  }

  void assign(const std::vector<std::string>& keys, const FoundGroup& group) {
    for (std::size_t i = 0; i < keys.size(); ++i) set(keys[i], group.columns[i]);
  }

  /// The one group of a kind that there is, or null: which of several is meant nobody can tell.
  template <class Is>
  const FoundGroup* theOne(const std::vector<FoundGroup>& groups, Is is) {
    const auto n = std::count_if(groups.begin(), groups.end(), is);
    return n == 1 ? &*std::find_if(groups.begin(), groups.end(), is) : nullptr;
  }

  bool takePosition(const FoundGroup& group, bool is_truth) {
    const std::string what = is_truth ? "true position: " : "tracked position: ";
    if (group.units.size() > 1) {
      say(what + listed(group.columns) + " are in different units, which cannot be read; choose others");
      return false;
    }
    assign(is_truth ? std::vector<std::string>{"x_true", "y_true", "z_true"} : std::vector<std::string>{"x", "y", "z"},
           group);
    (is_truth ? true_owner : tracked_owner) = ownerOf(group.stem);
    say(what + listed(group.columns) + ", by their names");
    return true;
  }

  void takePositions(std::set<std::string>& tracked_units, std::set<std::string>& true_units) {
    const std::vector<FoundGroup> groups = groupsOf(table.columns, names, {"x", "y", "z"});
    const auto is_truth = [](const FoundGroup& group) { return group.is_true && !group.is_reading; };
    const auto is_reading = [](const FoundGroup& group) { return group.is_reading && !group.is_true; };
    const FoundGroup* truth = theOne(groups, is_truth);
    const FoundGroup* reading = theOne(groups, is_reading);
    const bool is_plain = std::none_of(groups.begin(), groups.end(), is_reading);
    if (is_plain) reading = theOne(groups, [&](const FoundGroup& group) { return !is_truth(group); });
    if (truth != nullptr && takePosition(*truth, true)) true_units = truth->units;
    if (reading != nullptr && takePosition(*reading, false)) tracked_units = reading->units;
    if (groups.empty()) say("no three columns are named like the coordinates of a position; choose them");
    for (const FoundGroup& group : groups)
      if (&group != truth && &group != reading)
        say("the columns " + listed(group.columns) +
            " are a position too; whether the tracker's or the true one could not be told");
    if (!groups.empty() && reading == nullptr)
      say("which columns the tracker's readings are could not be told; choose them");
  }

  /// Whether angles may be read, and in which unit: told by their names, or by numbers that no radians are.
  bool takeAngleUnit(const FoundGroup& group) {
    if (group.units.size() == 1) {
      set("angle_unit", *group.units.begin() == "rad" ? "rad" : "deg");
      return true;
    }
    double largest = 0.0;
    for (std::size_t i = 0; i < table.columns.size(); ++i) {
      if (std::find(group.columns.begin(), group.columns.end(), table.columns[i]) == group.columns.end()) continue;
      for (const auto& row : table.rows)
        if (const double value = number(row[i]); std::isfinite(value)) largest = std::max(largest, std::abs(value));
    }
    return largest > kLargest_rad;
  }

  void takeRotations(const std::vector<std::string>& parts) {
    const bool are_angles = parts.size() == 3;
    for (const FoundGroup& group : groupsOf(table.columns, names, parts)) {
      const std::string own = ownerOf(group.stem);
      const bool is_truth = true_owner && !own.empty() && own == *true_owner;
      if (!is_truth && !(tracked_owner && (own.empty() || own == *tracked_owner))) {
        say("whose orientation " + listed(group.columns) + " are could not be told, and they are left out");
        continue;
      }
      std::vector<std::string> keys = parts;
      if (is_truth)
        for (std::string& key : keys) key += "_true";
      if (!choiceSetting(result.settings, keys.front()).empty()) continue;
      if (are_angles && !takeAngleUnit(group)) {
        say("the angles " + listed(group.columns) +
            " may be degrees or radians, and are left out; choose them and their unit");
        continue;
      }
      assign(keys, group);
      std::string how = ", by their names";
      if (are_angles) how += "; " + choiceSetting(result.settings, "angle_unit") + ", Rz(az) Ry(el) Rx(roll)";
      if (group.columns.front().ends_with('0')) how += "; 0 is taken for w, 1 to 3 for x, y, z";
      say(std::string(is_truth ? "true" : "tracked") + " orientation: " + listed(group.columns) + how);
    }
  }

  /// Why a column that is named like a time cannot be one in seconds; empty where it can.
  std::string whyNoTime(std::size_t column) const {
    if (!names[column].unit.empty() && names[column].unit != "s") return " is in " + names[column].unit;
    const bool is_date = std::any_of(table.rows.begin(), table.rows.end(), [&](const auto& row) {
      return std::abs(number(row[column])) > kLongestSession_s;
    });
    return is_date ? " holds no seconds of a session" : std::string();
  }

  void takeSingles() {
    for (const char* key : {"node", "sensor", "visit", "time", "status"}) {
      const auto found =
          std::find_if(names.begin(), names.end(), [&](const ColumnName& name) { return name.part == key; });
      if (found == names.end()) continue;
      const auto column = static_cast<std::size_t>(found - names.begin());
      const std::string is = std::string(key) + ": " + table.columns[column];
      const bool counts = std::string_view(key) != "time" && std::string_view(key) != "status";
      const bool is_whole = std::all_of(table.rows.begin(), table.rows.end(), [&](const auto& row) {
        return row[column].empty() || number(row[column]) == std::floor(number(row[column]));
      });
      if (counts && !is_whole) {
        say(is + " holds no whole numbers and is left out");
        continue;
      }
      const bool is_blank =
          std::any_of(table.rows.begin(), table.rows.end(), [&](const auto& row) { return row[column].empty(); });
      if (std::string_view(key) == "status" && !is_blank) {
        say(is + " is set in every row, so that it would count as an error mark of every row, and is left out");
        continue;
      }
      if (const std::string why = whyNoTime(column); std::string_view(key) == "time" && !why.empty()) {
        say(is + why + ", and is left out: time counts in seconds");
        continue;
      }
      set(key, table.columns[column]);
      say(is + ", by its name");
    }
  }

  /// @param comment the line above the first row, which may hold the names
  void takeFirstColumns(const std::string& comment) {
    if (table.columns.size() == kFewestColumns) {
      for (std::size_t i = 0; i < 3; ++i) set(std::string(1, "xyz"[i]), table.columns[i]);
      say("no names: the three columns are taken as the tracked position");
      return;
    }
    say(comment.empty()
            ? "no names: choose the columns"
            : "no names: choose the columns, or take the # off the line '" + comment + "' if these are their names");
  }

  void tellUnused() {
    std::vector<std::string> unused;
    for (const std::string& column : table.columns)
      if (std::none_of(result.settings.begin(), result.settings.end(), [&](const auto& setting) {
            const std::string* text = std::get_if<std::string>(&setting.second);
            return text != nullptr && *text == column;
          }))
        unused.push_back(column);
    if (!unused.empty()) say("not used: " + listed(unused));
  }

  /// Diagonal of the box around the tracked positions, in the table's unit.
  std::optional<double> span() const {
    double squares = 0.0;
    for (const char* axis : {"x", "y", "z"}) {
      const auto column = columnOf(axis);
      if (!column) return std::nullopt;
      std::vector<double> values;
      for (const auto& row : table.rows) {
        const double value = number(row[*column]);
        if (std::isfinite(value) && !isMissingMark(value)) values.push_back(value);
      }
      if (values.empty()) return std::nullopt;
      // A few wild readings say nothing about the unit.
      const double extent = quantile(values, 0.98) - quantile(values, 0.02);
      squares += extent * extent;
    }
    return std::sqrt(squares);
  }

  void takeUnits(const std::set<std::string>& tracked_units, const std::set<std::string>& true_units) {
    if (tracked_units.size() == 1) {
      result.has_unit = true;
      set("unit", *tracked_units.begin());
      say("unit: " + *tracked_units.begin() + ", as the columns' names say");
      if (true_units.size() == 1 && true_units != tracked_units) set("unit_true", *true_units.begin());
      return;
    }
    const std::optional<double> extent = span();
    if (!extent || *extent <= 0.0) {
      say("the unit could not be told; choose it");
      return;
    }
    std::vector<std::string> possible;
    for (const char* unit : {"mm", "m", "in", "cm", "ft"})
      if (*extent * lengthUnit_m(unit) >= kNarrowest_m && *extent * lengthUnit_m(unit) <= kWidest_m)
        possible.emplace_back(unit);
    const std::string spans = "the positions span " + significantText(*extent, 3);
    // Millimetres and metres cannot both be possible. Centimetres and feet are rare beside them, but a small bench in
    // millimetres and a room in inches, as older trackers tell it, are the same numbers.
    const auto may_be = [&](const char* unit) {
      return std::find(possible.begin(), possible.end(), unit) != possible.end();
    };
    const bool is_plain = may_be("m") || (may_be("mm") && !may_be("in"));
    if (!is_plain) {
      say(spans + ": the unit could not be told" +
          (possible.empty() ? std::string() : ", it may be " + listed(possible)) + "; choose it");
      return;
    }
    result.has_unit = true;
    set("unit", possible.front());
    const std::string spans_m = significantText(*extent * lengthUnit_m(possible.front()), 3);
    possible.erase(possible.begin());
    say("unit: " + choiceSetting(result.settings, "unit") + ", because " + spans + ", which is " + spans_m + " m" +
        (possible.empty() ? std::string() : "; " + listed(possible) + " would be possible too"));
  }

  void takeAveraging() {
    const auto node = columnOf("node");
    if (!node) return;
    // Samples of a place follow one another; visits of it do not.
    std::size_t runs = 1;
    for (std::size_t i = 1; i < table.rows.size(); ++i)
      if (table.rows[i][*node] != table.rows[i - 1][*node]) ++runs;
    const double rows = static_cast<double>(table.rows.size()) / static_cast<double>(runs);
    if (rows < kSamplesAtLeast) return;
    result.settings["average"] = true;
    say("samples: " + significantText(rows, 3) + " rows a place, so they are averaged");
  }
};

bool isNumeric(const std::string& text) {
  std::string pointed = text;
  std::replace(pointed.begin(), pointed.end(), ',', '.');
  return text.empty() || parseFinite(pointed).has_value();
}

bool hasDecimalComma(const TextPreview& table) {
  return std::any_of(table.rows.begin(), table.rows.end(), [](const auto& row) {
    return std::any_of(row.begin(), row.end(), [](const std::string& field) {
      return field.find(',') != std::string::npos && !parseFinite(field) && isNumeric(field);
    });
  });
}

/// The line of comment right above the first row, without its mark; empty where there is none.
Result<std::string> lastComment(const std::filesystem::path& path) {
  FT_TRY(std::ifstream in, openForReading(path));
  LineReader lines(in, path.filename().string());
  std::string comment, line;
  while (true) {
    FT_TRY(const bool more, lines.next(line));
    if (!more || !(line.empty() || line.starts_with('#'))) return comment;
    comment = line.empty() ? "" : std::string(trimmed(std::string_view(line).substr(1)));
  }
}

/// The settings that say how the file is written.
Result<Settings> guessWriting(const std::filesystem::path& path, Settings settings) {
  settings["header"] = false;
  std::optional<Error> first_error;
  for (const std::string& name : separatorNames()) {
    settings["separator"] = name;
    const Result<TextPreview> table = previewText(path, settings, kRowsThatMustFit);
    if (!table && !first_error) first_error = table.error();
    if (!table || table->columns.size() < kFewestColumns) continue;
    const std::vector<std::string>& first = table->rows.front();
    settings["header"] = !std::all_of(first.begin(), first.end(), isNumeric);
    if (hasDecimalComma(*table)) settings["decimal"] = std::string("comma");
    return settings;
  }
  return fail(ErrorCode::kBadInput, path.filename().string() +
                                        " is no table of text: no separator of tabs, semicolons, commas or blanks "
                                        "gives the same three columns or more in every row" +
                                        (first_error ? " (" + first_error->message + ")" : std::string()));
}

}  // namespace

Result<ColumnGuess> guessColumns(const std::filesystem::path& path) {
  FT_TRY_VOID(openForReading(path));
  const Importer& columns = *findImporter("columns").value();
  Guess guess;
  FT_TRY(guess.result.settings, resolveSettings(columns.id, columns.settings, {}));
  FT_TRY(guess.result.settings, guessWriting(path, guess.result.settings));
  FT_TRY(guess.table, previewText(path, guess.result.settings, kRowsLookedAt));
  for (const std::string& column : guess.table.columns) guess.names.push_back(readColumnName(column));
  for (const char* axis : {"x", "y", "z"}) guess.set(axis, "");
  std::set<std::string> tracked_units, true_units;
  if (boolSetting(guess.result.settings, "header")) {
    guess.takePositions(tracked_units, true_units);
    guess.takeRotations({"qw", "qx", "qy", "qz"});
    guess.takeRotations({"azimuth", "elevation", "roll"});
    guess.takeSingles();
  } else {
    FT_TRY(const std::string comment, lastComment(path));
    guess.takeFirstColumns(comment);
  }
  guess.takeUnits(tracked_units, true_units);
  guess.takeAveraging();
  guess.tellUnused();
  return guess.result;
}

std::string formatText(const Settings& settings) {
  const Importer& columns = *findImporter("columns").value();
  std::string text = columns.id;
  char mark = ':';
  for (const Setting& setting : columns.settings) {
    const SettingValue& value = settings.at(setting.key);
    if (value == setting.default_value) continue;
    text.append(1, mark).append(setting.key).append("=").append(textOf(value));
    mark = ',';
  }
  return text;
}

}  // namespace fieldtrue::importers
