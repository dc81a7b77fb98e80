#include "acquisition/protocols/openigtlink_parser.h"

#include <algorithm>
#include <array>

namespace fieldtrue::acquisition {
namespace {

bool isKept(const IgtlHeader& header) {
  constexpr std::array<std::string_view, 7> kKept = {"STATUS",     "STT_TDATA",  "STP_TDATA", "RTS_TDATA",
                                                     "STT_QTDATA", "STP_QTDATA", "RTS_QTDATA"};
  return igtlPoseType(header.type) || std::find(kKept.begin(), kKept.end(), header.type) != kKept.end();
}

/// Whether what follows can be another message, as far as it has come.
bool canFollow(std::string_view rest) { return rest.size() < kIgtlHeaderBytes || decodeIgtlHeader(rest).has_value(); }

}  // namespace

IgtlParser::Match IgtlParser::match(std::string_view rest, IgtlHeader& header) {
  if (rest.size() < kIgtlHeaderBytes) return Match::kMore;
  const auto found = decodeIgtlHeader(rest);
  if (!found) return Match::kNone;
  header = *found;
  if (!isKept(header)) return Match::kPassedOver;
  if (!igtlLengthFits(header)) return Match::kNone;
  const std::size_t whole = kIgtlHeaderBytes + header.body_bytes;
  if (rest.size() < whole) return Match::kMore;
  if (header.crc != 0 || header.body_bytes == 0) {
    const bool fits = igtlCrc(rest.substr(kIgtlHeaderBytes, header.body_bytes)) == header.crc;
    wrong_crcs_ += fits ? 0 : 1;
    return fits ? Match::kMessage : Match::kNone;
  }
  if (!canFollow(rest.substr(whole))) return Match::kNone;
  return rest.size() < whole + kIgtlHeaderBytes ? Match::kMore : Match::kMessage;
}

std::size_t IgtlParser::consume(std::string_view bytes, std::vector<IgtlMessage>& out) {
  std::size_t at = 0;
  while (at < bytes.size()) {
    if (to_skip_ > 0) {
      const std::size_t skipped = std::min<std::uint64_t>(to_skip_, bytes.size() - at);
      to_skip_ -= skipped;
      at += skipped;
      continue;
    }
    IgtlHeader header;
    const std::string_view rest = bytes.substr(at);
    switch (match(rest, header)) {
      case Match::kMore:
        return at;
      case Match::kNone:
        ++dropped_bytes_;
        ++at;
        break;
      case Match::kPassedOver:
        ++passed_over_[header.type];
        to_skip_ = header.body_bytes;
        at += kIgtlHeaderBytes;
        break;
      case Match::kMessage:
        ++messages_;
        at += kIgtlHeaderBytes + header.body_bytes;
        out.push_back({header, std::string(rest.substr(kIgtlHeaderBytes, header.body_bytes))});
    }
  }
  return at;
}

void IgtlParser::add(std::string_view bytes, std::vector<IgtlMessage>& out) {
  bytes_ += bytes.size();
  if (buffer_.empty()) {
    buffer_.assign(bytes.substr(consume(bytes, out)));
    return;
  }
  buffer_.append(bytes);
  buffer_.erase(0, consume(buffer_, out));
}

}  // namespace fieldtrue::acquisition
