// The bytes that one call charges to the budget until it ends.
#pragma once

#include <string>

#include "proto/base/status.h"
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

}  // namespace relmap::rpc
