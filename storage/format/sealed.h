// A sealed record: version, kind and length before a body, and a CRC32C behind it. Sessions, the map's state and
// journal records are sealed records.
#pragma once

#include <cstdint>

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::storage {

Bytes seal(std::uint8_t kind, std::uint16_t version, ByteSpan body);

struct Sealed {
  std::uint16_t version = 0;
  std::uint8_t kind = 0;
  ByteSpan body;
};
// TRUNCATED, CORRUPT, or UNKNOWN_FORMAT_VERSION if the version is not one of `oldest` to `newest`.
Result<Sealed> unseal(ByteSpan bytes, std::uint16_t oldest, std::uint16_t newest);

}  // namespace relmap::storage
