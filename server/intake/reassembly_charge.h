// Bytes charged to the budget for as long as the object lives.
#pragma once

#include <cstddef>
#include <utility>

#include "storage/memory/budget.h"

namespace relmap::intake {

class ReassemblyCharge {
 public:
  ReassemblyCharge() = default;
  // Charges the bytes; the result is empty (false) if the share has no room.
  static ReassemblyCharge take(storage::Budget& budget, std::size_t bytes) {
    ReassemblyCharge charge;
    if (budget.try_charge(storage::Share::kReassembly, bytes)) {
      charge.budget_ = &budget;
      charge.bytes_ = bytes;
    }
    return charge;
  }
  ReassemblyCharge(ReassemblyCharge&& other) noexcept
      : budget_(std::exchange(other.budget_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
  ReassemblyCharge& operator=(ReassemblyCharge&& other) noexcept {
    std::swap(budget_, other.budget_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ReassemblyCharge(const ReassemblyCharge&) = delete;
  ReassemblyCharge& operator=(const ReassemblyCharge&) = delete;
  ~ReassemblyCharge() {
    if (budget_) budget_->release(storage::Share::kReassembly, bytes_);
  }

  explicit operator bool() const { return budget_ != nullptr; }

 private:
  storage::Budget* budget_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace relmap::intake
