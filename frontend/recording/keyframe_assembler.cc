#include "frontend/recording/keyframe_assembler.h"

#include <string>
#include <utility>

#include "proto/base/crc32c.h"
#include "proto/wire/lcm_messages.h"

namespace relmap::recording {

namespace {
constexpr std::size_t kAssemblyOverhead = 512;  // approximate memory of an assembly besides its bytes
}

Result<KeyframePart> read_part(ByteSpan message) {
  auto part = decode_lcm_part(message);
  if (!part.ok()) return part;
  if (Status status = check_part(*part); !status.ok()) return status;
  return part;
}

void KeyframeAssembler::drop(Assemblies::iterator it) {
  bytes_ -= it->second.bytes().size() + kAssemblyOverhead;
  assemblies_.erase(it);
}

Result<std::optional<Bytes>> KeyframeAssembler::add(const KeyframePart& part) {
  const Key key{part.sequence, part.session, part.payload_crc};
  auto it = assemblies_.find(key);
  if (it != assemblies_.end() && !it->second.fits(part)) {
    drop(it);
    it = assemblies_.end();
  }
  if (it == assemblies_.end()) {
    while (bytes_ + part.total_bytes + kAssemblyOverhead > kMaxBytes) drop(assemblies_.begin());
    it = assemblies_.emplace(key, part).first;
    bytes_ += part.total_bytes + kAssemblyOverhead;
  }
  if (!it->second.add(part)) return std::optional<Bytes>();
  const auto node = assemblies_.extract(it);
  Bytes payload = std::move(node.mapped().bytes());
  bytes_ -= payload.size() + kAssemblyOverhead;
  if (crc32c(payload) != part.payload_crc)
    return {Reason::CORRUPT, "keyframe " + std::to_string(part.sequence) + " fails its checksum"};
  return std::optional(std::move(payload));
}

}  // namespace relmap::recording
