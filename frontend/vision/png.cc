#include "frontend/vision/png.h"

#include <zlib.h>

#include <string>

namespace relmap::vision {

namespace {

constexpr std::size_t kSignature = 8, kFrame = 12;  // length, type and CRC of a chunk

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
    if (crc32_z(0, &file[at + 4], 4 + length) != big_endian(file, at + 8 + length))
      return {Reason::PICTURE_DAMAGED,
              "PNG is damaged in the chunk of " + std::to_string(length) + " bytes at byte " + std::to_string(at)};
    if (type == "IEND") return {};
    at += kFrame + length;
  }
  return {Reason::PICTURE_DAMAGED, "PNG is cut short"};
}

}  // namespace relmap::vision
