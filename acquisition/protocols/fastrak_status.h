#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "acquisition/protocols/fastrak_items.h"

namespace fieldtrue::acquisition {

/// What the tracker says of itself (`S` command).
struct FastrakStatus {
  int station = 1;
  FastrakFormat format = FastrakFormat::kAscii;
  FastrakUnit unit = FastrakUnit::kInch;
  bool compensation = false;
  bool continuous = false;
  std::string self_test_error;  ///< Three characters without blanks; empty = none.
  unsigned sensors = 0;         ///< Bit 0 = station 1 has a receiver plugged in, and so on.
  std::string version;
  std::string identity;

  bool plugged(int one_based_station) const { return (sensors >> (one_based_station - 1) & 1u) != 0; }
};

/// The 55 bytes of a status record.
std::string encodeStatus(const FastrakStatus& status);

/// Finds a status record at the end of what came: 55 bytes, or the 54 of an InterSense in Fastrak mode. Bytes before it
/// (garbage, rest of a data record) are passed over.
std::optional<FastrakStatus> findStatus(std::string_view bytes);

/// A command the tracker refused.
struct FastrakRefusal {
  int station = 1;
  std::string command;
  int code = -99;
};
/// `2<station> E*ERROR*<command>*ERROR* EC <code> <meaning>` CR LF.
std::string encodeRefusal(const FastrakRefusal& refusal);
/// The first refusal among the bytes.
std::optional<FastrakRefusal> findRefusal(std::string_view bytes);
/// "not numeric", "out of range" and the like.
std::string refusalMeaning(int code);

/// Meaning in words of the error letter of a data record; empty for a blank (good).
std::string errorMeaning(char letter);
/// Meaning in words of a sample's status: error letters, `missing`, `damaged`, `flipped`.
std::string fastrakStatusMeaning(const std::string& status);

/// A reading-back reply (`2`, station, letter, text), e.g. for `I1`: its text without blanks at the ends.
std::optional<std::string> findReadBack(std::string_view bytes, char letter, int station);

}  // namespace fieldtrue::acquisition
