#include "proto/keyframe/ingest_messages.h"

#include <algorithm>

#include "proto/base/crc32c.h"
#include "proto/base/refuse.h"

namespace relmap {

std::uint32_t part_checksum(const KeyframePart& part) {
  ByteWriter header;
  header.put_array(part.session.bytes.data(), part.session.bytes.size());
  for (const std::uint32_t field :
       {part.sequence, part.part, part.parts, part.total_bytes, part.offset, part.payload_crc})
    header.put(field);
  return crc32c(part.data, crc32c(header.bytes()));
}

Status check_part(const KeyframePart& part) {
  if (part.part_crc != part_checksum(part))
    return refuse(Reason::CORRUPT, "part ", part.part, " of keyframe ", part.sequence, " fails its checksum");
  if (part.total_bytes == 0 || part.total_bytes > kMaxKeyframeBytes)
    return refuse(Reason::BAD_SIZE, "keyframe of ", part.total_bytes, " bytes; must be 1..", kMaxKeyframeBytes);
  if (part.parts == 0 || part.parts > kMaxParts || part.part >= part.parts)
    return refuse(Reason::BAD_SIZE, "part ", part.part, " of ", part.parts, "; at most ", kMaxParts);
  if (part.data.size() > kMaxPartBytes)
    return refuse(Reason::BAD_SIZE, "part of ", part.data.size(), " bytes; at most ", kMaxPartBytes);
  // All parts but the last have the same size; the last one has the rest, which is at most as large.
  const std::uint64_t size = part.data.size();
  const std::uint64_t end = part.offset + size;
  const bool last = part.part + 1 == part.parts;
  const std::uint64_t regular = regular_part_bytes(part);
  if (size == 0 || end > part.total_bytes || (last && end != part.total_bytes))
    return refuse(Reason::TRUNCATED, "part ", part.part, " of ", part.parts, " has bytes ", part.offset, "..", end,
                  " of ", part.total_bytes);
  if (regular == 0 || part.offset != part.part * regular || size > regular ||
      (part.total_bytes + regular - 1) / regular != part.parts)
    return refuse(Reason::BAD_SIZE, "part ", part.part, " of ", part.parts, " at byte ", part.offset, " with ", size,
                  " bytes is no equal division of ", part.total_bytes);
  return {};
}

std::uint32_t regular_part_bytes(const KeyframePart& part) {
  if (part.part + 1 < part.parts) return static_cast<std::uint32_t>(part.data.size());
  return part.part == 0 ? part.total_bytes : part.offset / part.part;
}

std::uint32_t count_parts(std::size_t payload_bytes, std::uint32_t part_bytes) {
  return static_cast<std::uint32_t>((payload_bytes + part_bytes - 1) / part_bytes);
}

KeyframePart cut_part(const SessionUuid& session, std::uint32_t sequence, ByteSpan payload, std::uint32_t payload_crc,
                      std::uint32_t part_bytes, std::uint32_t index) {
  KeyframePart part;
  part.session = session;
  part.sequence = sequence;
  part.part = index;
  part.parts = count_parts(payload.size(), part_bytes);
  part.total_bytes = static_cast<std::uint32_t>(payload.size());
  part.offset = index * part_bytes;
  part.payload_crc = payload_crc;
  const ByteSpan bytes = payload.subspan(part.offset, std::min<std::size_t>(part_bytes, payload.size() - part.offset));
  part.data.assign(bytes.begin(), bytes.end());
  part.part_crc = part_checksum(part);
  return part;
}

}  // namespace relmap
