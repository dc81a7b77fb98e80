#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/protocols/fastrak.h"
#include "acquisition/protocols/stream_parser.h"

/// The protocol of the Polhemus 3SPACE Isotrak II (manual OPM01PI021, 2001 edition; VRPN's driver) as pure functions.
/// Commands and ASCII records are a Fastrak's, but for one output list for both stations and a shorter status record.
/// Its binary records hold words of 16 bits, sent seven bits to a byte, so that only a record's first byte has bit 7.
namespace fieldtrue::acquisition {

inline constexpr int kIsotrakStations = 2;
inline constexpr double kIsotrakRate_hz = 60.0;                      ///< Shared by the active stations.
inline constexpr double kIsotrakReach_m = 1.6632;                    ///< Full scale of a binary position.
inline constexpr double kIsotrakStep_m = kIsotrakReach_m / 32767.0;  ///< Of binary positions.
/// How far the length of a quaternion may be from 1: early units do not normalise it.
inline constexpr double kIsotrakUnitTolerance = 0.1;

/// Bytes as the tracker packs them: of every seven the lower seven bits, then a byte with their highest bits, the first
/// byte's in bit 0. Bit 7 is set in the very first byte only.
std::string isotrakPacked(std::string_view bytes);
/// The inverse; none where bit 7 is elsewhere than in the first byte, or a byte of highest bits has too many.
std::optional<std::string> isotrakUnpacked(std::string_view wire);

/// Bytes of a binary record on the line. @error kBadInput for an item that has no known binary form
Result<std::size_t> isotrakRecordBytes(std::span<const int> items);
/// @return none when the bytes are not what the list asks for
std::optional<FastrakRecord> decodeIsotrakRecord(std::string_view wire, std::span<const int> items);
/// Values beyond full scale are held there.
std::string encodeIsotrakRecord(const FastrakRecord& record, std::span<const int> items);

/// What the tracker says of itself (`S`): 21 bytes. Which of its columns say what only its manual tells: they are kept
/// as they came.
struct IsotrakStatus {
  std::string text;     ///< Between `S` and the end, without blanks around it.
  std::string version;  ///< Its last word, where that has a point in it.
};
std::string encodeIsotrakStatus(int station, unsigned flags, const std::string& version);
std::optional<IsotrakStatus> findIsotrakStatus(std::string_view bytes);
/// Bits of the stations that are switched on, from what `l1` reads back.
std::optional<unsigned> findIsotrakStations(std::string_view bytes);

/// What a sample's status says.
std::string isotrakStatusMeaning(const std::string& status);

/// Turns an Isotrak's records into readings. Binary ones count when bit 7 is in the first byte alone, head and items
/// are right, and the next record begins where this one ends; ASCII ones as a Fastrak's.
class IsotrakParser : public StreamParser {
 public:
  struct Settings {
    FastrakFormat format = FastrakFormat::kBinary;
    FastrakUnit unit = FastrakUnit::kCentimetre;  ///< Of ASCII records; binary ones have a scale of their own.
    std::vector<int> stations;
    std::vector<int> items;  ///< ASCII lists end with item 1.
    bool single = false;     ///< Polled records: each is believed by itself.
  };
  /// @error kBadInput for a list that cannot be, or no station
  static Result<IsotrakParser> make(Settings settings);
  void add(std::string_view bytes, std::vector<Reading>& out) override;

 private:
  IsotrakParser() = default;
  FrameMatch match(std::string_view rest, std::vector<Reading>& out);
  FrameMatch look(std::string_view rest, std::optional<FastrakRecord>& record) const;

  Settings settings_;
  std::size_t record_bytes_ = 0;
  bool locked_ = false;
  FrameFinder finder_;
  std::optional<FastrakParser> text_;  ///< Of ASCII records.
};

/// Whether the bytes are an Isotrak's binary records, whatever output list it was told: six of one length in a row.
bool looksLikeIsotrakStream(std::string_view bytes);

namespace isotrak {
FastrakCommand outputList(std::span<const int> items);  ///< Of both stations.
}  // namespace isotrak

}  // namespace fieldtrue::acquisition
