#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace blind {

/// A node or sample table as text: metadata lines, named columns, rows. What is not touched is written back as it was.
struct SessionTable {
  std::vector<std::string> metadata;  ///< Whole lines, `# key: value`.
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;

  std::optional<std::size_t> column(const std::string& name) const;
  /// @error std::runtime_error when the column is missing
  std::size_t neededColumn(const std::string& name) const;
};

/// @error std::runtime_error when the file cannot be read, has no header, or a row has another number of fields
SessionTable readTable(const std::filesystem::path& path);
void writeTable(const std::filesystem::path& path, const SessionTable& table);

/// Seventeen digits: a number read back is the same number.
std::string exactText(double value);
/// @error std::runtime_error when the field is no number
double numberIn(const std::string& field);

/// What a metadata line `# key: number` states.
double statedNumber(const SessionTable& table, const std::string& key, double otherwise);

/// Puts the places' true positions and grid indices in another order; orientations and what was tracked stay.
void shufflePlaces(SessionTable& nodes, std::uint64_t seed);
/// Multiplies the stated jig tolerances.
/// @return false when none is stated
bool scaleJigTolerance(SessionTable& nodes, double factor);
/// Multiplies the stated scatter of the readings: SDs by the factor, covariances by its square.
void scaleScatter(SessionTable& nodes, double factor);
/// Reflects what was tracked in the plane x = 0: p -> M p, R -> M R M with M = diag(-1, 1, 1).
void mirrorTracked(SessionTable& table);
/// Replaces every time t by `end_s` - t, start and end of a node exchanged, and puts the rows in reverse order.
/// @return false when the table has no times
bool reverseTime(SessionTable& table, double end_s);
/// Latest time in the table; 0 when it has none.
double latestTime(const SessionTable& table);

}  // namespace blind
