// What one call may cost: the bytes that it charges to the budget until it ends, and the limit of its search.
#pragma once

#include <cstddef>
#include <string>

#include "proto/base/status.h"
#include "server/route/work_limit.h"
#include "server/rpc/deadline.h"
#include "storage/memory/budget.h"

namespace relmap::rpc {

class Charge {
 public:
  Charge(storage::Budget& budget, storage::Share share) : budget_(&budget), share_(share) {}
  Charge(const Charge&) = delete;
  Charge& operator=(const Charge&) = delete;
  ~Charge() { budget_->release(share_, bytes_); }

  // Raises the charge to `bytes`; BUDGET_EXCEEDED if the share or the whole budget does not allow it.
  Status grow_to(std::size_t bytes) {
    if (bytes <= bytes_) return {};
    if (!budget_->try_charge(share_, bytes - bytes_))
      return {Reason::BUDGET_EXCEEDED, "the answer needs more than the " + std::to_string(budget_->allowance(share_)) +
                                           " bytes that the memory budget leaves for " +
                                           std::string(storage::share_name(share_))};
    bytes_ = bytes;
    return {};
  }

 private:
  storage::Budget* budget_;
  const storage::Share share_;
  std::size_t bytes_ = 0;
};

// The WorkLimit of a search: the deadline of its call, and memory from the budget. Must outlive the limits that it
// returns.
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
