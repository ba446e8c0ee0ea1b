#include "frontend/publishing/memory_spool.h"

#include <string>
#include <utility>

namespace relmap::publishing {

MemorySpool::MemorySpool(SessionHeader header) {
  session_ = std::move(header);
  if (session_.uuid.is_nil()) session_.uuid = SessionUuid::random();
}

Status MemorySpool::set_map(const MapIdentity& map) {
  map_ = map;
  return {};
}

Status MemorySpool::append(std::uint32_t sequence, ByteSpan payload, std::uint32_t crc) {
  payloads_[sequence].assign(payload.begin(), payload.end());
  keyframes_[sequence] = {crc, static_cast<std::uint32_t>(payload.size())};
  return {};
}

Status MemorySpool::append_gap(const Gap& gap) {
  gaps_.push_back(gap);
  return {};
}

Result<Bytes> MemorySpool::read(std::uint32_t sequence) const {
  const auto it = payloads_.find(sequence);
  if (it == payloads_.end()) return {Reason::NO_SUCH_FRAME, "no keyframe " + std::to_string(sequence)};
  return it->second;
}

Status MemorySpool::remove_below(std::uint64_t sequence) {
  const auto below = [&](const auto& entry) { return entry.first < sequence; };
  std::erase_if(payloads_, below);
  std::erase_if(keyframes_, below);
  std::erase_if(gaps_, [&](const Gap& gap) { return gap.to < sequence; });
  return {};
}

}  // namespace relmap::publishing
