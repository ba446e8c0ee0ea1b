// Assembles recorded parts to payloads. Memory is bounded: beyond the bound, incomplete payloads are dropped, those
// with the lowest sequences first.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <tuple>

#include "proto/keyframe/part_assembly.h"

namespace relmap::recording {

// Decodes and checks a message of RELMAP_KEYFRAME (decode_lcm_part(), check_part()).
Result<KeyframePart> read_part(ByteSpan message);

// Versions of a keyframe with different checksums are assembled separately.
class KeyframeAssembler {
 public:
  // Adds a part, which must have passed check_part(). Returns the payload if this was its last part; nothing while
  // others are missing. CORRUPT if the complete payload fails its checksum; it is then dropped.
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
