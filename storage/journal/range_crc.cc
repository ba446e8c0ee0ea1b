#include "storage/journal/range_crc.h"

#include <algorithm>
#include <array>

#include "proto/base/crc32c.h"

namespace relmap::storage {

namespace {

constexpr std::size_t kStep = 64;

// Polynomials over GF(2) modulo that of CRC32C, as checksums have them: the coefficient of x^0 in the highest bit.
constexpr std::uint32_t kModulus = 0x82f63b78;
constexpr std::uint32_t kOne = 0x80000000;

constexpr std::uint32_t times_x(std::uint32_t a) { return (a & 1) != 0 ? (a >> 1) ^ kModulus : a >> 1; }

constexpr std::uint32_t product(std::uint32_t a, std::uint32_t b) {
  std::uint32_t sum = 0;
  for (std::uint32_t bit = kOne; bit != 0; bit >>= 1, b = times_x(b))
    if ((a & bit) != 0) sum ^= b;
  return sum;
}

// x^(8 * 2^k): what 2^k bytes multiply a checksum by.
constexpr std::array<std::uint32_t, 40> kPowers = [] {
  std::array<std::uint32_t, 40> powers{};
  std::uint32_t power = kOne;
  for (int bit = 0; bit < 8; ++bit) power = times_x(power);
  for (std::uint32_t& entry : powers) {
    entry = power;
    power = product(power, power);
  }
  return powers;
}();

// The checksum of `size` zero bytes behind bytes with this checksum, but for the constant that crc32c() adds. With it,
// crc32c(ab) == shifted(crc32c(a), size of b) ^ crc32c(b).
std::uint32_t shifted(std::uint32_t crc, std::size_t size) {
  for (std::size_t k = 0; size != 0; size >>= 1, ++k)
    if ((size & 1) != 0) crc = product(crc, kPowers[k]);
  return crc;
}

}  // namespace

RangeCrc::RangeCrc(ByteSpan bytes) : bytes_(bytes) {
  marks_.reserve(bytes.size() / kStep + 1);
  std::uint32_t crc = 0;
  for (std::size_t at = 0;; at += kStep) {
    marks_.push_back(crc);
    if (at + kStep > bytes.size()) break;
    crc = crc32c(bytes.subspan(at, kStep), crc);
  }
}

std::uint32_t RangeCrc::before(std::size_t end) const {
  const std::size_t mark = end / kStep;
  return crc32c(bytes_.subspan(mark * kStep, end % kStep), marks_[mark]);
}

std::uint32_t RangeCrc::of(std::size_t from, std::size_t size, std::uint32_t crc) const {
  return before(from + size) ^ shifted(before(from) ^ crc, size);
}

}  // namespace relmap::storage
