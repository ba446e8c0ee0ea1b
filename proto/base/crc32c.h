// CRC-32C (Castagnoli, RFC 3720 B.4), the checksum of every payload, part and record.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace relmap {

// The checksum of `bytes`, continuing from `crc`, that of the bytes before them: crc32c(ab) == crc32c(b, crc32c(a)).
std::uint32_t crc32c(std::span<const std::uint8_t> bytes, std::uint32_t crc = 0);

namespace detail {
// The same from a table, byte by byte, for machines without the SSE 4.2 instruction.
std::uint32_t crc32c_by_table(std::span<const std::uint8_t> bytes, std::uint32_t crc = 0);
}  // namespace detail

}  // namespace relmap
