#include "calib/tables/line_reader.h"

#include <string_view>

namespace fieldtrue {

namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
/// Holds the longest line, its CR, a byte-order mark and the terminating null.
constexpr std::size_t kBuffer = kLongestLine + 5;

}  // namespace

LineReader::LineReader(std::istream& in, std::string name)
    : in_(&in), name_(std::move(name)), buffer_(new char[kBuffer]) {}

Result<bool> LineReader::next(std::string& line) {
  in_->getline(buffer_.get(), static_cast<std::streamsize>(kBuffer));
  if (in_->bad()) return fail(ErrorCode::kIo, "Cannot read " + name_ + ": the reading failed in the middle");
  if (in_->fail() && in_->gcount() == 0) return false;
  const bool overflows = in_->fail();
  has_newline_ = !in_->eof() && !overflows;
  std::string_view text(buffer_.get(), static_cast<std::size_t>(in_->gcount()) - (has_newline_ ? 1 : 0));
  if (++number_ == 1 && text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  if (text.ends_with('\r')) text.remove_suffix(1);
  if (overflows || text.size() > kLongestLine) {
    return fail(ErrorCode::kBadInput,
                name_ + ", line " + std::to_string(number_) + ": the line is longer than " +
                    std::to_string(kLongestLine) +
                    " characters; a row of a table is far shorter, so look for missing line ends");
  }
  line.assign(text);
  return true;
}

}  // namespace fieldtrue
