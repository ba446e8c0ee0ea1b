// CRC-32C (Castagnoli), RFC 3720 B.4: the checksum of every payload, part and record.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace relmap {

// Continues from `crc`, the checksum of the bytes before: crc32c(ab) == crc32c(b, crc32c(a)).
std::uint32_t crc32c(std::span<const std::uint8_t> bytes, std::uint32_t crc = 0);

namespace detail {
// The same, byte by byte from a table, as on machines without the instruction.
std::uint32_t crc32c_by_table(std::span<const std::uint8_t> bytes, std::uint32_t crc = 0);
}  // namespace detail

}  // namespace relmap
