// For fuzzers: changes to a sound file, so that a small input reaches what lies far behind its beginning.
#pragma once

#include <algorithm>
#include <cstdint>

#include "proto/base/bytes.h"

namespace relmap::storage {

// Each change is a byte that chooses it, a u24 for its place, modulo the size, and what it needs besides.
inline void patch(Bytes& file, ByteReader& in) {
  const auto kind = in.get<std::uint8_t>();
  const std::uint32_t low = in.get<std::uint16_t>(), high = in.get<std::uint8_t>();
  if (!in.ok() || file.empty()) return;
  const std::size_t at = (low + 65536 * high) % file.size();
  const auto overwrite = [&](auto value) {
    std::memcpy(file.data() + at, &value, std::min(sizeof value, file.size() - at));
  };
  switch (kind % 5) {
    case 0:
      file[at] ^= in.get<std::uint8_t>();
      break;
    case 1:
      overwrite(in.get<std::uint32_t>());
      break;
    case 2:
      overwrite(in.get<std::uint64_t>());
      break;
    case 3:
      file.resize(at);
      break;
    default: {
      const ByteSpan more = in.get_bytes(std::min<std::size_t>(in.get<std::uint8_t>(), in.remaining()));
      file.insert(file.begin() + static_cast<std::ptrdiff_t>(at), more.begin(), more.end());
    }
  }
}

}  // namespace relmap::storage
