// A checksum over what is known about a recording's files without reading them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "proto/base/bytes.h"

namespace relmap::capture {

// It depends on the order in which things are added.
class ContentsChecksum {
 public:
  void add(ByteSpan bytes);
  void add(std::string_view text);
  void add(std::int64_t number);
  void add(double number);
  // Adds the name of a file (without its folders) and its size. A missing file is also part of the checksum.
  void add_file(const std::filesystem::path& file);
  std::uint32_t value() const { return crc_; }

 private:
  std::uint32_t crc_ = 0;
};

}  // namespace relmap::capture
