// Maps frame ids to small numbers: an open-addressing hash table that is cleared at no cost and keeps its memory.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/base/ids.h"

namespace relmap::storage {

class FrameIndex {
 public:
  FrameIndex() : slots_(1024) {}

  void clear() {
    ++round_;
    size_ = 0;
  }

  // Null if the id is not in the table. Valid until the next insert().
  const std::int32_t* find(FrameId id) const {
    for (std::size_t k = home(id);; k = next(k)) {
      if (slots_[k].round != round_) return nullptr;
      if (slots_[k].id == id) return &slots_[k].value;
    }
  }

  // `id` must not be in the table.
  void insert(FrameId id, std::int32_t value) {
    if (2 * ++size_ > slots_.size()) grow();
    place({id, value, round_});
  }

 private:
  struct Slot {
    FrameId id;
    std::int32_t value = 0;
    std::uint64_t round = 0;  // the slot is in use if it is that of the table
  };

  std::size_t home(FrameId id) const { return std::hash<FrameId>()(id) & (slots_.size() - 1); }
  std::size_t next(std::size_t k) const { return (k + 1) & (slots_.size() - 1); }
  void place(const Slot& slot) {
    std::size_t k = home(slot.id);
    while (slots_[k].round == round_) k = next(k);
    slots_[k] = slot;
  }
  void grow() {
    std::vector<Slot> old(2 * slots_.size());
    old.swap(slots_);
    for (const Slot& slot : old)
      if (slot.round == round_) place(slot);
  }

  std::vector<Slot> slots_;  // a power of two in number, at most half of them in use
  std::uint64_t round_ = 1;
  std::size_t size_ = 0;
};

}  // namespace relmap::storage
