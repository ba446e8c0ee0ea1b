#include "frontend/capture/contents_checksum.h"

#include <cstring>
#include <string>

#include "proto/base/crc32c.h"

namespace relmap::capture {

void ContentsChecksum::add(ByteSpan bytes) { crc_ = crc32c(bytes, crc_); }

// Text is added with its length, so that "ab" and "c" differ from "a" and "bc".
void ContentsChecksum::add(std::string_view text) {
  add(static_cast<std::int64_t>(text.size()));
  add(as_bytes(text));
}

void ContentsChecksum::add(std::int64_t number) {
  std::uint8_t bytes[sizeof number];
  std::memcpy(bytes, &number, sizeof number);
  add(ByteSpan(bytes));
}

void ContentsChecksum::add(double number) {
  std::int64_t bits;
  std::memcpy(&bits, &number, sizeof bits);
  add(bits);
}

void ContentsChecksum::add_file(const std::filesystem::path& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  add(std::string_view(file.filename().string()));
  add(error ? std::int64_t{-1} : static_cast<std::int64_t>(size));
}

}  // namespace relmap::capture
