#include "tests/blind/sha256.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

namespace blind {
namespace {

// The first 32 bits of the fractional parts of the square (order 2) or cube (order 3) roots of the first primes,
// FIPS 180-4 sections 4.2.2 and 5.3.3: floor(prime^(1/order) * 2^32) modulo 2^32, found by bisection on integers.
std::uint32_t rootFraction(std::uint64_t prime, int order) {
  using Wide = __uint128_t;
  const Wide target = static_cast<Wide>(prime) << (order == 2 ? 64 : 96);
  std::uint64_t low = 0, high = std::uint64_t{1} << 37;
  while (high - low > 1) {
    const std::uint64_t middle = low + (high - low) / 2;
    const Wide square = static_cast<Wide>(middle) * middle;
    const bool below = order == 2 ? square <= target : square <= target / middle;
    (below ? low : high) = middle;
  }
  return static_cast<std::uint32_t>(low);
}

std::array<std::uint64_t, 64> firstPrimes() {
  std::array<std::uint64_t, 64> primes{};
  std::size_t found = 0;
  for (std::uint64_t candidate = 2; found < primes.size(); ++candidate) {
    bool prime = true;
    for (std::size_t k = 0; k < found; ++k) prime = prime && candidate % primes[k] != 0;
    if (prime) primes[found++] = candidate;
  }
  return primes;
}

struct Constants {
  std::array<std::uint32_t, 64> round{};
  std::array<std::uint32_t, 8> start{};
};

Constants makeConstants() {
  Constants constants;
  const auto primes = firstPrimes();
  for (std::size_t t = 0; t < 64; ++t) constants.round[t] = rootFraction(primes[t], 3);
  for (std::size_t t = 0; t < 8; ++t) constants.start[t] = rootFraction(primes[t], 2);
  return constants;
}

std::string padded(std::string_view bytes) {
  std::string message(bytes);
  message.push_back(static_cast<char>(0x80));
  while (message.size() % 64 != 56) message.push_back('\0');
  const std::uint64_t bits = static_cast<std::uint64_t>(bytes.size()) * 8;
  for (int shift = 56; shift >= 0; shift -= 8) message.push_back(static_cast<char>((bits >> shift) & 0xff));
  return message;
}

void absorb(std::array<std::uint32_t, 8>& hash, const char* block, const Constants& constants) {
  std::array<std::uint32_t, 64> w{};
  for (std::size_t t = 0; t < 16; ++t)
    for (std::size_t b = 0; b < 4; ++b) w[t] = (w[t] << 8) | static_cast<unsigned char>(block[4 * t + b]);
  for (std::size_t t = 16; t < 64; ++t) {
    const std::uint32_t s0 = std::rotr(w[t - 15], 7) ^ std::rotr(w[t - 15], 18) ^ (w[t - 15] >> 3);
    const std::uint32_t s1 = std::rotr(w[t - 2], 17) ^ std::rotr(w[t - 2], 19) ^ (w[t - 2] >> 10);
    w[t] = w[t - 16] + s0 + w[t - 7] + s1;
  }
  auto [a, b, c, d, e, f, g, h] = hash;
  for (std::size_t t = 0; t < 64; ++t) {
    const std::uint32_t sum1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
    const std::uint32_t t1 = h + sum1 + ((e & f) ^ (~e & g)) + constants.round[t] + w[t];
    const std::uint32_t sum0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
    const std::uint32_t t2 = sum0 + ((a & b) ^ (a & c) ^ (b & c));
    h = g, g = f, f = e, e = d + t1, d = c, c = b, b = a, a = t1 + t2;
  }
  const std::array<std::uint32_t, 8> added{a, b, c, d, e, f, g, h};
  for (std::size_t k = 0; k < 8; ++k) hash[k] += added[k];
}

}  // namespace

std::string sha256Hex(std::string_view bytes) {
  static const Constants constants = makeConstants();
  std::array<std::uint32_t, 8> hash = constants.start;
  const std::string message = padded(bytes);
  for (std::size_t at = 0; at < message.size(); at += 64) absorb(hash, message.data() + at, constants);
  std::string text;
  for (std::uint32_t word : hash)
    for (int shift = 28; shift >= 0; shift -= 4) text.push_back("0123456789abcdef"[(word >> shift) & 0xf]);
  return text;
}

}  // namespace blind
