// Objects that have been replaced and may still be read by others. They are kept until nobody reads them, and are then
// filled anew in the memory that they have.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "proto/base/ids.h"

namespace relmap::storage {

// Whether nobody else holds the object. Nobody else must be able to get hold of it meanwhile.
template <typename T>
bool only_ours(const std::shared_ptr<T>& object) {
  if (object.use_count() != 1) return false;
  // use_count() alone orders nothing. Copying the pointer changes the count, so that what others did before they let go
  // has happened before this.
  const std::shared_ptr<T> after_them = object;
  return true;
}

template <typename T>
class Spares {
 public:
  explicit Spares(std::size_t max_objects) : max_objects_(max_objects) { spares_.reserve(max_objects); }

  // `of` is the frame that the object was a version of; the frame's next version fits into it best. The oldest object
  // is dropped if there are max_objects already.
  void put(std::shared_ptr<T> object, std::size_t bytes = 0, FrameId of = {}) {
    if (spares_.size() == max_objects_) drop(0);
    bytes_ += bytes;
    spares_.push_back({std::move(object), bytes, of});
  }

  // Takes a free object that was a version of `of`. If there is none and the store is full, takes the free one
  // that was put in longest ago. Null if there is neither.
  std::shared_ptr<T> take(FrameId of = {}) {
    const auto free = [](const Spare& spare) { return only_ours(spare.object); };
    auto found = std::find_if(spares_.begin(), spares_.end(), [&](const Spare& s) { return s.of == of && free(s); });
    if (found == spares_.end() && spares_.size() == max_objects_)
      found = std::find_if(spares_.begin(), spares_.end(), free);
    if (found == spares_.end()) return nullptr;
    std::shared_ptr<T> object = std::move(found->object);
    drop(static_cast<std::size_t>(found - spares_.begin()));
    return object;
  }

  // Visits the objects that nobody else holds.
  template <typename Visit>
  void for_each_free(Visit visit) {
    for (const Spare& spare : spares_)
      if (only_ours(spare.object)) visit(*spare.object);
  }

  void clear() {
    spares_.clear();
    bytes_ = 0;
  }

  std::size_t bytes() const { return bytes_; }

 private:
  struct Spare {
    std::shared_ptr<T> object;
    std::size_t bytes = 0;
    FrameId of;
  };
  void drop(std::size_t k) {
    bytes_ -= spares_[k].bytes;
    spares_.erase(spares_.begin() + static_cast<std::ptrdiff_t>(k));
  }

  const std::size_t max_objects_;
  std::vector<Spare> spares_;  // oldest first
  std::size_t bytes_ = 0;
};

}  // namespace relmap::storage
