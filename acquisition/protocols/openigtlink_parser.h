#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/protocols/openigtlink_messages.h"

namespace fieldtrue::acquisition {

struct IgtlMessage {
  IgtlHeader header;
  std::string body;
};

/// Turns a stream, cut anywhere, into messages. Bytes that are no message are dropped one at a time. A message is
/// believed when its CRC fits; one that states none (0) when another message follows it, so that it comes one message
/// late. Bodies of types that are of no use here, such as images, are counted and passed over without being kept.
class IgtlParser {
 public:
  /// Appends the messages completed by these bytes: poses, STATUS, and what is said to start and stop them.
  void add(std::string_view bytes, std::vector<IgtlMessage>& out);

  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t messages() const { return messages_; }
  std::uint64_t wrong_crcs() const { return wrong_crcs_; }
  std::uint64_t dropped_bytes() const { return dropped_bytes_; }
  /// Types passed over, with how many came.
  const std::map<std::string, std::uint64_t>& passedOver() const { return passed_over_; }

 private:
  enum class Match { kMessage, kPassedOver, kMore, kNone };
  Match match(std::string_view rest, IgtlHeader& header);
  std::size_t consume(std::string_view bytes, std::vector<IgtlMessage>& out);

  std::string buffer_;
  std::uint64_t to_skip_ = 0;  ///< Bytes still to come of a body that is passed over.
  std::uint64_t bytes_ = 0, messages_ = 0, wrong_crcs_ = 0, dropped_bytes_ = 0;
  std::map<std::string, std::uint64_t> passed_over_;
};

}  // namespace fieldtrue::acquisition
