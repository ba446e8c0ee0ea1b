// The WorkLimit of a search that a caller asked for: its deadline, and its memory from the budget.
#pragma once

#include <algorithm>

#include "server/route/work_limit.h"
#include "server/rpc/charge.h"
#include "server/rpc/core.h"
#include "server/rpc/deadline.h"

namespace relmap::rpc {

// Must outlive the limit that it gives.
class SearchWork {
 public:
  SearchWork(Core& core, const Deadline& deadline)
      : charge_(core.mapper.budget(), storage::Share::kReplies),
        deadline_(deadline),
        most_(core.limits.max_search_frames) {}

  route::WorkLimit limit() { return limit(most_); }
  route::WorkLimit limit(std::size_t max_frames) {
    return {std::min<std::size_t>(most_, max_frames), [this](std::size_t bytes) -> Status {
              if (Status status = deadline_.check(); !status.ok()) return status;
              return charge_.grow_to(bytes);
            }};
  }

 private:
  Charge charge_;
  const Deadline& deadline_;
  const std::size_t most_;
};

}  // namespace relmap::rpc
