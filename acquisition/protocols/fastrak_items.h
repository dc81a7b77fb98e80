#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/protocols/pose_numbers.h"
#include "calib/core/calibration_table.h"
#include "calib/core/error.h"

namespace fieldtrue::acquisition {

enum class FastrakFormat { kAscii, kBinary };
enum class FastrakUnit { kInch, kCentimetre };

inline constexpr int kFastrakStations = 4;
inline constexpr double kFastrakRate_hz = 120.0;  ///< Shared by the active stations.

/// Metres in one of the unit's lengths.
double metresPer(FastrakUnit unit);

/// What one data record carried. Quantities that are not in the output list are empty.
struct FastrakRecord : PoseNumbers {
  int station = 1;                            ///< 1..4.
  char error = ' ';                           ///< Blank = good.
  std::optional<Eigen::Vector3d> relative_m;  ///< Since the last record.
  std::optional<bool> stylus_pressed;
};

/// One row of the table of output items ("O" command).
struct FastrakItem {
  int id = 0;
  const char* name = "";
  std::string_view literal;   ///< Bytes that always stand there; empty for values.
  int values = 0;             ///< Numbers in the item.
  int decimals = 0;           ///< Of the plain ASCII form, which is 7 columns wide.
  bool extended = false;      ///< ASCII `Sx.xxxxxESxx` and a blank: 13 columns.
  double packed_scale = 0.0;  ///< Full scale of the two-byte form [m, deg, 1]; 0 = not a two-byte item.
  /// Takes the numbers over. @param scale metres per length unit
  void (*store)(FastrakRecord& record, const double* values, double scale) = nullptr;
  /// Gives the numbers. @param scale metres per length unit
  void (*load)(const FastrakRecord& record, double* values, double scale) = nullptr;
};

/// Every item of the output list, with what it holds: 0-7, 11, 16, 18-20, and 50-57, 61, 66 in extended precision.
std::span<const FastrakItem> fastrakItems();
/// The item of that number, or null.
const FastrakItem* findFastrakItem(int id);
/// Bytes the item takes in a record; none where the item does not exist in that format.
std::optional<std::size_t> itemWidth(const FastrakItem& item, FastrakFormat format);

/// Where each item of an output list stands in a record.
struct FastrakLayout {
  struct Field {
    const FastrakItem* item = nullptr;
    std::size_t offset = 0;
    std::size_t width = 0;
  };
  FastrakFormat format = FastrakFormat::kAscii;
  std::vector<Field> fields;
  std::size_t bytes = 3;  ///< Whole record with its three header bytes.
};

/// @error kBadInput for an unknown item, more than 32 items, more than 254 bytes, a two-byte item in ASCII
Result<FastrakLayout> fastrakLayout(std::span<const int> items, FastrakFormat format);

/// Reads one record.
/// @param bytes exactly layout.bytes long
/// @return none when the header, a fixed byte or a number is not what the layout asks for
std::optional<FastrakRecord> decodeRecord(std::string_view bytes, const FastrakLayout& layout, FastrakUnit unit);

/// The same into a record already there, which must be as new; false where the other gives none.
bool decodeRecord(std::string_view bytes, const FastrakLayout& layout, FastrakUnit unit, FastrakRecord& record);

/// Writes one record; quantities the record lacks are written as zero.
std::string encodeRecord(const FastrakRecord& record, const FastrakLayout& layout, FastrakUnit unit);

/// A record with every form of a pose filled in.
/// @param tracker_from_sensor as the device reports it
FastrakRecord recordOfPose(int station, char error, const Pose& tracker_from_sensor, bool stylus_pressed = false);

/// The record as a sample: sensor = station - 1, orientation from the quaternion, else the cosines, else the angles.
/// The status is the error letter, `missing` or `damaged`; a sample without a usable pose has the identity pose.
Sample toSample(const FastrakRecord& record, double time_s);

}  // namespace fieldtrue::acquisition
