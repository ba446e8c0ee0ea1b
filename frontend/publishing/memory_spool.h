// A spool in memory, which ends with its process. It suits sources that give the same keyframes when they are read
// again.
#pragma once

#include <cstdint>
#include <map>

#include "frontend/publishing/spool.h"

namespace relmap::publishing {

class MemorySpool final : public Spool {
 public:
  // A nil uuid becomes a random one.
  explicit MemorySpool(SessionHeader header);

  Status set_map(const MapIdentity& map) override;
  Status append(std::uint32_t sequence, ByteSpan payload, std::uint32_t crc) override;
  Status append_gap(const Gap& gap) override;
  Result<Bytes> read(std::uint32_t sequence) const override;
  Status remove_below(std::uint64_t sequence) override;

 private:
  std::map<std::uint32_t, Bytes> payloads_;
};

}  // namespace relmap::publishing
