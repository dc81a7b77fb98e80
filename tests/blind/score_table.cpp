#include "tests/blind/score_table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace blind {
namespace {

using TableRow = std::vector<std::string>;

std::string number(double value, const std::string& unit) {
  char text[48];
  const int decimals = unit == "cm" ? 1 : unit == "s" ? 2 : 3;
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

std::string targetText(const Figure& figure) {
  if (!figure.target) return "";
  const std::string value = number(figure.target->value, figure.unit);
  switch (figure.target->kind) {
    case Target::Kind::kAtLeast:
      return "at least " + value;
    case Target::Kind::kBetween:
      return value + " to " + number(figure.target->upper, figure.unit);
    case Target::Kind::kSurelyAtMost:
      return "at most " + value + ", interval up to " + number(figure.target->upper, figure.unit);
    case Target::Kind::kAtMost:
    case Target::Kind::kValueAtMost:
      break;
  }
  return "at most " + value;
}

std::string outcomeText(const Figure& figure) {
  const std::optional<double> missed = missedBy(figure);
  if (!missed) return "";
  return *missed > 0.0 ? "missed by " + number(*missed, figure.unit) : "met";
}

TableRow rowOf(const Figure& figure) {
  return {figure.name,
          figure.group,
          number(figure.interval.value, figure.unit) +
              (figure.unit.empty() || figure.unit == "share" ? "" : " " + figure.unit),
          number(figure.interval.low, figure.unit) + " to " + number(figure.interval.high, figure.unit),
          std::to_string(figure.interval.count),
          targetText(figure),
          outcomeText(figure)};
}

const TableRow kHeader = {"figure", "sessions", "value", "95 % interval", "n", "target", "outcome"};

std::vector<TableRow> confusionRows(const ConfusionMatrix& matrix) {
  std::vector<TableRow> rows(1, TableRow{"truth"});
  for (const std::string& column : matrix.columns) rows[0].push_back(column);
  for (const std::string& row : matrix.rows) {
    TableRow cells = {row};
    for (const std::string& column : matrix.columns) {
      const auto& counts = matrix.counts.at(row);
      const auto found = counts.find(column);
      cells.push_back(found == counts.end() ? "." : std::to_string(found->second));
    }
    rows.push_back(std::move(cells));
  }
  return rows;
}

std::string aligned(const std::vector<TableRow>& rows) {
  std::vector<std::size_t> widths;
  for (const TableRow& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t at = 0; at < row.size(); ++at) widths[at] = std::max(widths[at], row[at].size());
  }
  std::string text;
  for (const TableRow& row : rows) {
    std::string line = " ";
    for (std::size_t at = 0; at < row.size(); ++at)
      line += " " + row[at] + std::string(widths[at] - row[at].size() + 1, ' ');
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string piped(const std::vector<TableRow>& rows) {
  std::string text;
  for (std::size_t at = 0; at < rows.size(); ++at) {
    text += "|";
    for (const std::string& cell : rows[at]) text += " " + cell + " |";
    text += "\n";
    if (at > 0) continue;
    text += "|";
    for (std::size_t column = 0; column < rows[0].size(); ++column) text += "---|";
    text += "\n";
  }
  return text;
}

template <typename Table>
std::string sections(const Scoreboard& board, const std::string& mark, const Table& table) {
  std::string text = mark + std::to_string(board.sessions) + " sessions, " + std::to_string(board.unanswered.size()) +
                     " without an answer (counted as wrong)\n\n";
  for (const std::string& unanswered : board.unanswered) text += "- " + unanswered + "\n";
  if (!board.unanswered.empty()) text += "\n";
  for (std::size_t at = 0; at < board.figures.size();) {
    const std::string& title = board.figures[at].section;
    std::vector<TableRow> rows = {kHeader};
    for (; at < board.figures.size() && board.figures[at].section == title; ++at)
      rows.push_back(rowOf(board.figures[at]));
    text += mark + title + "\n\n" + table(rows) + "\n";
  }
  if (board.confusion.rows.empty()) return text;
  return text + mark +
         "Confusion: truth in rows, named first in columns; a name of the truth's class counts as it\n\n" +
         table(confusionRows(board.confusion));
}

nlohmann::json orNull(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

}  // namespace

std::string plainText(const Scoreboard& board) { return sections(board, "", aligned); }

std::string markdown(const Scoreboard& board) { return sections(board, "### ", piped); }

nlohmann::json toJson(const Scoreboard& board) {
  nlohmann::json figures = nlohmann::json::array();
  for (const Figure& figure : board.figures) {
    const std::optional<double> missed = missedBy(figure);
    figures.push_back({{"section", figure.section},
                       {"figure", figure.name},
                       {"sessions", figure.group},
                       {"unit", figure.unit},
                       {"value", orNull(figure.interval.value)},
                       {"low95", orNull(figure.interval.low)},
                       {"high95", orNull(figure.interval.high)},
                       {"n", figure.interval.count},
                       {"target", figure.target ? nlohmann::json(targetText(figure)) : nlohmann::json()},
                       {"missed_by", missed ? nlohmann::json(*missed) : nlohmann::json()}});
  }
  return {{"schema", "fieldtrue.blind-score/1"},
          {"sessions", board.sessions},
          {"unanswered", board.unanswered},
          {"figures", figures},
          {"confusion", board.confusion.counts}};
}

}  // namespace blind
