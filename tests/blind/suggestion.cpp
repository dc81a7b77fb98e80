#include "tests/blind/suggestion.h"

#include <algorithm>
#include <regex>

namespace blind {
namespace {

constexpr double kFirstAfter_s = 60, kBetween_s = 15;
constexpr double kNearestToTransmitter_m = 0.4;

int columnOfLetters(const std::string& letters) {
  int column = 0;
  for (const char letter : letters) column = 26 * column + (letter - 'A' + 1);
  return column - 1;
}

/// A row of each place that a list names, in the list's order.
std::vector<Row> rowsNamedIn(const std::string& list, const Setup& setup) {
  static const std::regex kName("([A-Z]+)([0-9]+), pipe ([0-9]+)|P([0-9]+)");
  std::vector<Row> rows;
  for (std::sregex_iterator name(list.begin(), list.end(), kName), end; name != end; ++name) {
    const auto is_named = [&](const Row& row) {
      if ((*name)[4].matched) return row.node == std::stoi((*name)[4]);
      return row.i == columnOfLetters((*name)[1]) && row.j == std::stoi((*name)[2]) - 1 &&
             row.k == std::stoi((*name)[3]) - 1;
    };
    const auto found = std::find_if(setup.rows.begin(), setup.rows.end(), is_named);
    if (found != setup.rows.end()) rows.push_back(*found);
  }
  return rows;
}

/// Puts rows one after another behind the session.
void comeLater(const Setup& setup, std::vector<Row>& rows) {
  double start_s = setup.latest_s + kFirstAfter_s;
  for (Row& row : rows) {
    row.start_s = start_s;
    row.end_s = start_s + (setup.samples - 1) / setup.rate_hz;
    start_s = row.end_s + kBetween_s;
  }
}

void countVisits(const Setup& setup, std::vector<Row>& rows) {
  for (Row& row : rows)
    row.visit = static_cast<int>(
        std::count_if(setup.rows.begin(), setup.rows.end(), [&](const Row& other) { return other.node == row.node; }));
}

void numberAsNew(const Setup& setup, std::vector<Row>& rows) {
  int next = 0;
  for (const Row& row : setup.rows) next = std::max(next, row.node + 1);
  for (Row& row : rows) row.node = next++, row.visit = 0;
}

}  // namespace

Suggestion suggestionIn(const std::string& text, const Setup& setup) {
  static const std::regex kTurned("turn the sensor by 90 degrees about the rig's ([xyz]) axis and measure (.*) again");
  static const std::regex kOuter(
      "measure [0-9]+ more places one step \\(([0-9.]+) m\\) beyond (.*), towards ([-+])([xyz])");
  static const std::regex kLater("measure the first places again, now at the end: (.*)");
  std::smatch part;
  Suggestion suggestion;
  if (std::regex_search(text, part, kTurned)) {
    suggestion = {"turned", rowsNamedIn(part[2], setup)};
    const Vector3d axis = Vector3d::Unit(part.str(1)[0] - 'x');
    for (Row& row : suggestion.rows) row.attitude = turned(0.5 * kPi * axis, row.attitude);
    countVisits(setup, suggestion.rows);
  } else if (std::regex_search(text, part, kOuter)) {
    suggestion = {"outer", rowsNamedIn(part[2], setup)};
    const double step_m = (part.str(3) == "-" ? -1 : 1) * std::stod(part[1]);
    for (Row& row : suggestion.rows) row.place_m[part.str(4)[0] - 'x'] += step_m;
    numberAsNew(setup, suggestion.rows);
  } else if (std::regex_search(text, part, kLater)) {
    suggestion = {"later", rowsNamedIn(part[1], setup)};
    countVisits(setup, suggestion.rows);
  }
  if (suggestion.rows.empty()) return {};
  comeLater(setup, suggestion.rows);
  return suggestion;
}

std::vector<Row> randomRows(const Setup& setup, const std::vector<Row>& after, Random& random) {
  Eigen::AlignedBox3d box;
  for (const Row& row : setup.rows) box.extend(row.place_m);
  const Vector3d step_m = Vector3d::Constant(setup.pitch_m);
  box = Eigen::AlignedBox3d(box.min() - step_m, box.max() + step_m);
  std::vector<Row> rows;
  while (rows.size() < after.size()) {
    Vector3d place_m;
    for (int axis = 0; axis < 3; ++axis) place_m[axis] = uniform(random, box.min()[axis], box.max()[axis]);
    const auto distance_m = [&](const Row& row) { return (row.place_m - place_m).norm(); };
    // Of the layer of the nearest place, as the rig goes on.
    Row row = *std::min_element(setup.rows.begin(), setup.rows.end(),
                                [&](const Row& a, const Row& b) { return distance_m(a) < distance_m(b); });
    row.place_m = place_m;
    row.attitude =
        setup.rows[static_cast<std::size_t>(uniformInt(random, 0, static_cast<int>(setup.rows.size()) - 1))].attitude;
    if (setup.expected(row).position_m.norm() >= kNearestToTransmitter_m) rows.push_back(row);
  }
  comeLater(setup, rows);
  numberAsNew(setup, rows);
  return rows;
}

}  // namespace blind
