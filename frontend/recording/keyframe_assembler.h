// Recorded parts to payloads, within a bound: beyond it, what is not whole is given up from the lowest sequence on.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <tuple>

#include "proto/keyframe/part_assembly.h"

namespace relmap::recording {

// The message of RELMAP_KEYFRAME: decode_lcm_part() and check_part().
Result<KeyframePart> read_part(ByteSpan message);

// Versions of a keyframe with different checksums are put together apart.
class KeyframeAssembler {
 public:
  // The payload when this was its last part; nothing while others are missing. The part has passed check_part().
  // CORRUPT: the payload is whole and fails its checksum; it is dropped.
  Result<std::optional<Bytes>> add(const KeyframePart& part);

  static constexpr std::size_t kMaxBytes = std::size_t{64} << 20;
  std::size_t bytes() const { return bytes_; }

 private:
  using Key = std::tuple<std::uint32_t, SessionUuid, std::uint32_t>;  // sequence, session, checksum
  using Assemblies = std::map<Key, PartAssembly>;
  void drop(Assemblies::iterator it);

  Assemblies assemblies_;
  std::size_t bytes_ = 0;
};

}  // namespace relmap::recording
