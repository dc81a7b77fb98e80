#include "tests/blind/session_table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <map>
#include <random>
#include <sstream>
#include <stdexcept>

#include "tests/blind/sealed_folder.h"

namespace blind {
namespace {

std::vector<std::string> fieldsOf(const std::string& line) {
  std::vector<std::string> fields(1);
  for (char letter : line) {
    if (letter == ',')
      fields.emplace_back();
    else
      fields.back() += letter;
  }
  return fields;
}

std::string joined(const std::vector<std::string>& fields) {
  std::string line;
  for (std::size_t at = 0; at < fields.size(); ++at) line += (at > 0 ? "," : "") + fields[at];
  return line;
}

void scale(SessionTable& table, const std::string& name, double factor) {
  const std::optional<std::size_t> at = table.column(name);
  if (!at) return;
  for (std::vector<std::string>& row : table.rows)
    if (!row[*at].empty()) row[*at] = exactText(factor * numberIn(row[*at]));
}

}  // namespace

std::optional<std::size_t> SessionTable::column(const std::string& name) const {
  const auto found = std::find(columns.begin(), columns.end(), name);
  if (found == columns.end()) return std::nullopt;
  return static_cast<std::size_t>(found - columns.begin());
}

std::size_t SessionTable::neededColumn(const std::string& name) const {
  if (const std::optional<std::size_t> at = column(name)) return *at;
  throw std::runtime_error("the table has no column " + name);
}

SessionTable readTable(const std::filesystem::path& path) {
  SessionTable table;
  std::istringstream text(textOf(path));
  for (std::string line; std::getline(text, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) continue;
    if (line.front() == '#') {
      table.metadata.push_back(line);
    } else if (table.columns.empty()) {
      table.columns = fieldsOf(line);
    } else {
      table.rows.push_back(fieldsOf(line));
      if (table.rows.back().size() != table.columns.size()) {
        throw std::runtime_error(path.string() + ", row " + std::to_string(table.rows.size()) + ": has " +
                                 std::to_string(table.rows.back().size()) + " fields, the header " +
                                 std::to_string(table.columns.size()));
      }
    }
  }
  if (table.rows.empty()) throw std::runtime_error(path.string() + " needs a header and at least one row");
  return table;
}

void writeTable(const std::filesystem::path& path, const SessionTable& table) {
  std::string text;
  for (const std::string& line : table.metadata) text += line + "\n";
  text += joined(table.columns) + "\n";
  for (const std::vector<std::string>& row : table.rows) text += joined(row) + "\n";
  replaceFile(path, text);
}

std::string exactText(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.17g", value);
  return text.data();
}

double numberIn(const std::string& field) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc() || end != field.data() + field.size())
    throw std::runtime_error("'" + field + "' is no number");
  return value;
}

double statedNumber(const SessionTable& table, const std::string& key, double otherwise) {
  for (const std::string& line : table.metadata)
    if (line.rfind("# " + key + ": ", 0) == 0) return numberIn(line.substr(key.size() + 4));
  return otherwise;
}

void shufflePlaces(SessionTable& nodes, std::uint64_t seed) {
  std::vector<std::size_t> moved;
  for (const char* name : {"x_true_m", "y_true_m", "z_true_m"}) moved.push_back(nodes.neededColumn(name));
  for (const char* name : {"i", "j", "k"})
    if (const std::optional<std::size_t> at = nodes.column(name)) moved.push_back(*at);
  const std::size_t node = nodes.neededColumn("node");
  std::map<std::string, std::vector<std::string>> place_of;
  for (const std::vector<std::string>& row : nodes.rows) {
    std::vector<std::string>& place = place_of[row[node]];
    if (!place.empty()) continue;
    for (std::size_t at : moved) place.push_back(row[at]);
  }
  std::vector<std::string> labels;
  for (const auto& [label, place] : place_of) labels.push_back(label);
  std::vector<std::string> shuffled = labels;
  std::mt19937_64 random(seed);
  for (std::size_t left = shuffled.size(); left > 1; --left) std::swap(shuffled[left - 1], shuffled[random() % left]);
  std::map<std::string, std::string> source_of;
  for (std::size_t at = 0; at < labels.size(); ++at) source_of[labels[at]] = shuffled[at];
  for (std::vector<std::string>& row : nodes.rows) {
    const std::vector<std::string>& place = place_of.at(source_of.at(row[node]));
    for (std::size_t at = 0; at < moved.size(); ++at) row[moved[at]] = place[at];
  }
}

bool scaleJigTolerance(SessionTable& nodes, double factor) {
  bool is_stated = false;
  for (std::string& line : nodes.metadata) {
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos || line.find("jig_tolerance_") > colon) continue;
    std::string value = line.substr(colon + 1);
    value.erase(0, value.find_first_not_of(" \t"));
    value.erase(value.find_last_not_of(" \t") + 1);
    line = line.substr(0, colon) + ": " + exactText(factor * numberIn(value));
    is_stated = true;
  }
  return is_stated;
}

void scaleScatter(SessionTable& nodes, double factor) {
  for (const char* name : {"sd_x_m", "sd_y_m", "sd_z_m", "sd_rot_rad"}) scale(nodes, name, factor);
  for (const char* name : {"cov_xy_m2", "cov_xz_m2", "cov_yz_m2"}) scale(nodes, name, factor * factor);
}

void mirrorTracked(SessionTable& table) {
  table.neededColumn("x_m");
  // M R M turns by the same angle about (x, -y, -z).
  for (const char* name : {"x_m", "qy", "qz", "cov_xy_m2", "cov_xz_m2"}) scale(table, name, -1.0);
}

bool reverseTime(SessionTable& table, double end_s) {
  const std::optional<std::size_t> start = table.column("t_start_s");
  const std::optional<std::size_t> end = table.column("t_end_s");
  const std::optional<std::size_t> time = table.column("t_s");
  if (!time && !(start && end)) return false;
  const auto reversed = [&](const std::string& field) {
    return field.empty() ? field : exactText(end_s - numberIn(field));
  };
  for (std::vector<std::string>& row : table.rows) {
    if (time) row[*time] = reversed(row[*time]);
    if (!start || !end) continue;
    const std::string new_start = reversed(row[*end]);
    row[*end] = reversed(row[*start]);
    row[*start] = new_start;
  }
  std::reverse(table.rows.begin(), table.rows.end());
  return true;
}

double latestTime(const SessionTable& table) {
  double latest = 0.0;
  for (const char* name : {"t_end_s", "t_s"}) {
    const std::optional<std::size_t> at = table.column(name);
    if (!at) continue;
    for (const std::vector<std::string>& row : table.rows)
      if (!row[*at].empty()) latest = std::max(latest, numberIn(row[*at]));
  }
  return latest;
}

}  // namespace blind
