// The WorkLimit of a call's search: its deadline, and its memory from the budget.
#pragma once

#include <cstddef>

#include "server/route/work_limit.h"
#include "server/rpc/charge.h"
#include "server/rpc/deadline.h"

namespace relmap::rpc {

// Must outlive the limits that it returns.
class SearchWork {
 public:
  SearchWork(storage::Budget& budget, std::size_t max_frames, const Deadline& deadline)
      : charge_(budget, storage::Share::kReplies), deadline_(deadline), max_frames_(max_frames) {}

  route::WorkLimit limit() {
    return {max_frames_, [this](std::size_t bytes) -> Status {
              if (Status status = deadline_.check(); !status.ok()) return status;
              return charge_.grow_to(bytes);
            }};
  }

 private:
  Charge charge_;
  const Deadline& deadline_;
  const std::size_t max_frames_;
};

}  // namespace relmap::rpc
