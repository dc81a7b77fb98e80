#include "acquisition/protocols/fastrak_parser.h"

namespace fieldtrue::acquisition {
namespace {

bool isErrorLetter(char c) { return c == ' ' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

}  // namespace

Result<FastrakParser> FastrakParser::make(const FastrakStreamSettings& settings) {
  FT_CHECK(settings.records_to_lock >= 1);
  FastrakParser parser;
  parser.unit_ = settings.unit;
  parser.records_to_lock_ = settings.records_to_lock;
  parser.stylus_in_status_ = settings.stylus_in_status;
  bool any = false;
  for (std::size_t i = 0; i < settings.items.size(); ++i) {
    if (settings.items[i].empty()) continue;
    FT_TRY(auto layout, fastrakLayout(settings.items[i], settings.format));
    parser.layouts_[i] = std::move(layout);
    parser.active_[i] = any = true;
  }
  if (!any) return fail(ErrorCode::kBadInput, "No Fastrak station is switched on; at least one of 1 to 4 is needed");
  return parser;
}

FastrakParser::Match FastrakParser::match(std::string_view bytes, FastrakRecord& record, std::size_t& length) const {
  if (bytes.empty()) return Match::kMore;
  if (bytes[0] != '0') return Match::kNo;
  if (bytes.size() < 2) return Match::kMore;
  const auto station = static_cast<std::size_t>(static_cast<unsigned char>(bytes[1])) - std::size_t{'1'};
  if (station >= active_.size() || !active_[station]) return Match::kNo;
  if (bytes.size() < 3) return Match::kMore;
  const bool is_stylus = stylus_in_status_ && (bytes[2] == '@' || bytes[2] == '*');
  if (!is_stylus && !isErrorLetter(bytes[2])) return Match::kNo;
  const FastrakLayout& layout = layouts_[station];
  length = layout.bytes;
  if (bytes.size() < length) return Match::kMore;
  return decodeRecord(bytes.substr(0, length), layout, unit_, record) ? Match::kYes : Match::kNo;
}

FastrakParser::Match FastrakParser::matchRow(std::string_view bytes) const {
  for (int i = 0; i < records_to_lock_; ++i) {
    FastrakRecord record;
    std::size_t length = 0;
    const Match result = match(bytes, record, length);
    if (result != Match::kYes) return result;
    bytes.remove_prefix(length);
  }
  return Match::kYes;
}

FastrakParser::Match FastrakParser::take(std::string_view bytes, std::size_t& length,
                                         std::vector<FastrakRecord>& out) const {
  const Match result = match(bytes, out.emplace_back(), length);
  if (result != Match::kYes) out.pop_back();
  return result;
}

std::size_t FastrakParser::consume(std::string_view bytes, std::vector<FastrakRecord>& out) {
  std::size_t at = 0;
  while (at < bytes.size()) {
    const std::string_view rest = bytes.substr(at);
    std::size_t length = 0;
    const Match result = locked_ ? take(rest, length, out) : matchRow(rest);
    if (result == Match::kMore) break;
    if (result == Match::kNo) {
      losses_of_lock_ += locked_ ? 1 : 0;
      locked_ = false;
      ++dropped_bytes_;
      ++at;
    } else if (locked_) {
      ++records_;
      at += length;
    } else {
      locked_ = true;
    }
  }
  return at;
}

bool looksLikeFastrakStream(std::string_view bytes) {
  constexpr std::size_t kHeads = 6, kShortest = 4, kLongest = 254;
  const auto is_head = [bytes](std::size_t at) {
    return bytes[at] == '0' && bytes[at + 1] >= '1' && bytes[at + 1] <= '4' && isErrorLetter(bytes[at + 2]);
  };
  for (std::size_t first = 0; first <= kLongest; ++first) {
    for (std::size_t length = kShortest; length <= kLongest; ++length) {
      if (first + kHeads * length > bytes.size()) break;
      std::size_t heads = 0;
      while (heads < kHeads && is_head(first + heads * length)) ++heads;
      if (heads == kHeads) return true;
    }
  }
  return false;
}

void FastrakParser::add(std::string_view bytes, std::vector<FastrakRecord>& out) {
  bytes_ += bytes.size();
  if (buffer_.empty()) {
    buffer_.assign(bytes.substr(consume(bytes, out)));
    return;
  }
  buffer_.append(bytes);
  buffer_.erase(0, consume(buffer_, out));
}

}  // namespace fieldtrue::acquisition
