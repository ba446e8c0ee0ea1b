#include "server/ingest/mapper_sink.h"

#include <algorithm>

namespace relmap {

std::size_t MapperSink::free_bytes() const {
  const Budget& budget = mapper_.budget();
  const std::size_t allowed = budget.allowance(Share::kQueues);
  return allowed - std::min(allowed, budget.used(Share::kQueues));
}

}  // namespace relmap
