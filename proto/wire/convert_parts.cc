#include <algorithm>
#include <cassert>
#include <limits>
#include <string>

#include "proto/crc32c.h"
#include "proto/wire/channels.h"
#include "proto/wire/convert.h"

namespace relmap {

std::size_t count_parts(std::size_t payload_bytes, std::size_t part_bytes) {
  return (payload_bytes + part_bytes - 1) / part_bytes;
}

relmap_lcm::keyframe_part_t make_part(const SessionUuid& session, std::uint32_t sequence, ByteSpan payload,
                                      std::uint32_t payload_crc, std::size_t part_bytes, std::size_t part) {
  const std::size_t parts = count_parts(payload.size(), part_bytes);
  assert(part < parts && payload.size() <= kMaxKeyframeBytes);
  const std::size_t offset = part * part_bytes;
  const ByteSpan data = payload.subspan(offset, std::min(part_bytes, payload.size() - offset));
  relmap_lcm::keyframe_part_t message;
  message.protocol_major = kProtocolMajor;
  message.protocol_minor = kProtocolMinor;
  uuid_to_lcm(session, message.session_uuid);
  message.sequence = sequence;
  message.part = static_cast<std::int32_t>(part);
  message.parts = static_cast<std::int32_t>(parts);
  message.total_size = static_cast<std::int32_t>(payload.size());
  message.offset = static_cast<std::int32_t>(offset);
  message.payload_crc32c = payload_crc;
  message.part_crc32c = crc32c(data);
  message.size = static_cast<std::int32_t>(data.size());
  message.data.assign(data.begin(), data.end());
  return message;
}

Status check_part(const relmap_lcm::keyframe_part_t& p) {
  constexpr std::int64_t kMaxU32 = std::numeric_limits<std::uint32_t>::max();
  const auto is_u32 = [&](std::int64_t value) { return value >= 0 && value <= kMaxU32; };
  if (p.protocol_major != kProtocolMajor)
    return {Reason::UNKNOWN_PROTOCOL_VERSION,
            "protocol " + std::to_string(p.protocol_major) + "; known: " + std::to_string(kProtocolMajor)};
  if (!is_u32(p.sequence) || !is_u32(p.payload_crc32c) || !is_u32(p.part_crc32c))
    return {Reason::CORRUPT, "sequence or checksum out of range"};
  if (p.total_size <= 0 || static_cast<std::size_t>(p.total_size) > kMaxKeyframeBytes)
    return {Reason::BAD_SIZE,
            "keyframe of " + std::to_string(p.total_size) + " bytes; at most " + std::to_string(kMaxKeyframeBytes)};
  if (p.size <= 0 || static_cast<std::size_t>(p.size) != p.data.size() || p.offset < 0 ||
      std::int64_t{p.offset} + p.size > p.total_size || p.part < 0 || p.part >= p.parts || p.parts > p.total_size)
    return {Reason::BAD_SIZE, "part " + std::to_string(p.part) + " of " + std::to_string(p.parts) + ", bytes " +
                                  std::to_string(p.offset) + " + " + std::to_string(p.size) + " of " +
                                  std::to_string(p.total_size)};
  if (crc32c(p.data) != static_cast<std::uint32_t>(p.part_crc32c))
    return {Reason::CORRUPT,
            "part " + std::to_string(p.part) + " of " + std::to_string(p.parts) + " does not match its checksum"};
  return {};
}

}  // namespace relmap
