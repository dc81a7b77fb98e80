#include "calib/exporters/bytes.h"

#include <zlib.h>

#include <array>
#include <bit>
#include <cstring>

namespace fieldtrue::exporters {
namespace {

constexpr int kGzip = 16;        ///< Added to the window's bits: gzip in place of zlib's wrapping.
constexpr int kEitherKind = 32;  ///< The same when reading: whichever it is.
constexpr int kMemoryLevel = 8;
constexpr std::size_t kBlock = std::size_t{1} << 20;

template <class Bits>
void appendBits(std::string& bytes, Bits bits) {
  for (std::size_t byte = 0; byte < sizeof(Bits); ++byte)
    bytes.push_back(static_cast<char>(static_cast<unsigned char>(bits >> (8 * byte))));
}

template <class Bits>
Bits bitsAt(std::string_view bytes, std::size_t at) {
  FT_CHECK(at + sizeof(Bits) <= bytes.size());
  Bits bits = 0;
  for (std::size_t byte = 0; byte < sizeof(Bits); ++byte)
    bits |= static_cast<Bits>(static_cast<Bits>(static_cast<unsigned char>(bytes[at + byte])) << (8 * byte));
  return bits;
}

/// Feeds a string to a stream of zlib and gathers what comes out.
template <class Step>
int pumped(z_stream& stream, std::string_view in, std::string& out, Step step) {
  std::vector<char> block(kBlock);
  std::size_t taken = 0;
  int status = Z_OK;
  do {
    const std::size_t some = std::min(kBlock, in.size() - taken);
    std::string input(in.substr(taken, some));
    taken += some;
    stream.next_in = reinterpret_cast<Bytef*>(input.data());
    stream.avail_in = static_cast<uInt>(some);
    do {
      stream.next_out = reinterpret_cast<Bytef*>(block.data());
      stream.avail_out = static_cast<uInt>(block.size());
      status = step(stream, taken == in.size() ? Z_FINISH : Z_NO_FLUSH);
      out.append(block.data(), block.size() - stream.avail_out);
    } while ((status == Z_OK || status == Z_BUF_ERROR) && stream.avail_out == 0);
  } while ((status == Z_OK || status == Z_BUF_ERROR) && taken < in.size());
  return status;
}

}  // namespace

void appendDouble(std::string& bytes, double value) { appendBits(bytes, std::bit_cast<std::uint64_t>(value)); }
void appendFloat(std::string& bytes, float value) { appendBits(bytes, std::bit_cast<std::uint32_t>(value)); }
void appendInt32(std::string& bytes, std::int32_t value) { appendBits(bytes, std::bit_cast<std::uint32_t>(value)); }
double doubleAt(std::string_view bytes, std::size_t at) {
  return std::bit_cast<double>(bitsAt<std::uint64_t>(bytes, at));
}
float floatAt(std::string_view bytes, std::size_t at) { return std::bit_cast<float>(bitsAt<std::uint32_t>(bytes, at)); }
std::int32_t int32At(std::string_view bytes, std::size_t at) {
  return std::bit_cast<std::int32_t>(bitsAt<std::uint32_t>(bytes, at));
}

std::string gzipped(const std::string& bytes) {
  z_stream stream{};
  FT_CHECK(deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, MAX_WBITS + kGzip, kMemoryLevel,
                        Z_DEFAULT_STRATEGY) == Z_OK);
  std::string out;
  const int status = pumped(stream, bytes, out, [](z_stream& one, int flush) { return deflate(&one, flush); });
  deflateEnd(&stream);
  FT_CHECK(status == Z_STREAM_END);
  return out;
}

Result<std::string> inflated(std::string_view bytes) {
  z_stream stream{};
  FT_CHECK(inflateInit2(&stream, MAX_WBITS + kEitherKind) == Z_OK);
  std::string out;
  const int status = pumped(stream, bytes, out, [](z_stream& one, int) { return inflate(&one, Z_NO_FLUSH); });
  inflateEnd(&stream);
  if (status != Z_STREAM_END) return fail(ErrorCode::kBadInput, "the compressed data is damaged or cut off");
  return out;
}

}  // namespace fieldtrue::exporters
