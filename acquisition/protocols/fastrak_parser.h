#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/protocols/fastrak_items.h"

namespace fieldtrue::acquisition {

/// What the tracker was told to send, so that its records can be told from noise.
struct FastrakStreamSettings {
  FastrakFormat format = FastrakFormat::kBinary;
  FastrakUnit unit = FastrakUnit::kCentimetre;
  std::array<std::vector<int>, kFastrakStations> items;  ///< Output list of each station; empty = station off.
  int records_to_lock = 2;        ///< Good records in a row before any is believed. 1 for single polled records.
  bool stylus_in_status = false;  ///< `@` and `*`, a stylus' button, may stand in place of the error letter.
};

/// Turns the tracker's bytes, cut anywhere, into records. Bytes that do not fit are dropped one at a time until
/// `records_to_lock` records in a row fit; end every output list with item 1 or 0, or binary records cannot be told
/// apart.
class FastrakParser {
 public:
  /// @error kBadInput for a bad output list or when no station is on
  static Result<FastrakParser> make(const FastrakStreamSettings& settings);

  /// Appends the records completed by these bytes.
  void add(std::string_view bytes, std::vector<FastrakRecord>& out);

  bool locked() const { return locked_; }
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t records() const { return records_; }
  std::uint64_t dropped_bytes() const { return dropped_bytes_; }
  std::uint64_t losses_of_lock() const { return losses_of_lock_; }

 private:
  enum class Match { kYes, kNo, kMore };
  FastrakParser() = default;
  Match match(std::string_view bytes, FastrakRecord& record, std::size_t& length) const;
  Match matchRow(std::string_view bytes) const;
  Match take(std::string_view bytes, std::size_t& length, std::vector<FastrakRecord>& out) const;
  std::size_t consume(std::string_view bytes, std::vector<FastrakRecord>& out);

  FastrakUnit unit_ = FastrakUnit::kCentimetre;
  int records_to_lock_ = 2;
  bool stylus_in_status_ = false;
  std::array<FastrakLayout, kFastrakStations> layouts_;
  std::array<bool, kFastrakStations> active_{};
  std::string buffer_;
  bool locked_ = false;
  std::uint64_t bytes_ = 0, records_ = 0, dropped_bytes_ = 0, losses_of_lock_ = 0;
};

/// Whether the bytes are a Fastrak's records, whatever output list it was told: six heads at equal distances.
bool looksLikeFastrakStream(std::string_view bytes);

}  // namespace fieldtrue::acquisition
