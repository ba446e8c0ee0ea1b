// A checksum over what there is to know of a recording's files without reading them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "proto/base/bytes.h"

namespace relmap::capture {

// In the order in which they are added.
class ContentsChecksum {
 public:
  void add(ByteSpan bytes);
  void add(std::string_view text);
  void add(std::int64_t number);
  void add(double number);
  // Its name without its folders, and its size; one that is not there counts as such.
  void add_file(const std::filesystem::path& file);
  std::uint32_t value() const { return crc_; }

 private:
  std::uint32_t crc_ = 0;
};

}  // namespace relmap::capture
