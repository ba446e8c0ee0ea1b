#include "server/ingest/mapper_sink.h"

#include <algorithm>

namespace relmap::ingest {

std::size_t MapperSink::free_bytes() const {
  const storage::Budget& budget = mapper_.budget();
  const std::size_t allowed = budget.allowance(storage::Share::kQueues);
  return allowed - std::min(allowed, budget.used(storage::Share::kQueues));
}

}  // namespace relmap::ingest
