#include "frontend/vision/png.h"

#include <array>
#include <cstring>
#include <string>

namespace relmap::vision {

namespace {

constexpr std::size_t kSignature = 8, kFrame = 12;  // length, type and CRC of a chunk

// ISO/IEC 15948, annex D. Table k is for a byte that k others follow, so that eight are taken at once.
using Tables = std::array<std::array<std::uint32_t, 256>, 8>;
constexpr Tables make_tables() {
  Tables tables{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = (c >> 1) ^ ((c & 1) ? 0xedb88320u : 0u);
    tables[0][i] = c;
  }
  for (std::size_t k = 1; k < tables.size(); ++k)
    for (std::size_t i = 0; i < 256; ++i) tables[k][i] = (tables[k - 1][i] >> 8) ^ tables[0][tables[k - 1][i] & 0xff];
  return tables;
}
constexpr Tables kTables = make_tables();

std::uint32_t crc32(ByteSpan bytes) {
  std::uint32_t state = ~0u;
  const std::uint8_t* p = bytes.data();
  std::size_t n = bytes.size();
  for (; n >= 8; p += 8, n -= 8) {
    std::uint32_t low = 0;  // relmap runs on little-endian machines
    std::memcpy(&low, p, 4);
    low ^= state;
    state = kTables[7][low & 0xff] ^ kTables[6][(low >> 8) & 0xff] ^ kTables[5][(low >> 16) & 0xff] ^
            kTables[4][low >> 24] ^ kTables[3][p[4]] ^ kTables[2][p[5]] ^ kTables[1][p[6]] ^ kTables[0][p[7]];
  }
  for (; n > 0; ++p, --n) state = (state >> 8) ^ kTables[0][(state ^ *p) & 0xff];
  return ~state;
}

std::uint32_t big_endian(ByteSpan bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = (value << 8) | bytes[at + i];
  return value;
}

}  // namespace

Status check_png(ByteSpan file) {
  for (std::size_t at = kSignature; at + kFrame <= file.size();) {
    const std::size_t length = big_endian(file, at);
    if (length > file.size() - at - kFrame) break;
    const std::string type(file.begin() + static_cast<std::ptrdiff_t>(at) + 4,
                           file.begin() + static_cast<std::ptrdiff_t>(at) + 8);
    if (crc32(file.subspan(at + 4, 4 + length)) != big_endian(file, at + 8 + length))
      return {Reason::PICTURE_DAMAGED,
              "PNG is damaged in the chunk of " + std::to_string(length) + " bytes at byte " + std::to_string(at)};
    if (type == "IEND") return {};
    at += kFrame + length;
  }
  return {Reason::PICTURE_DAMAGED, "PNG is cut short"};
}

}  // namespace relmap::vision
