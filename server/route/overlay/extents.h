// Allocates parts of a file and reuses those that are given back.
#pragma once

#include <cstdint>
#include <iterator>
#include <map>
#include <set>
#include <utility>

namespace relmap::route {

class Extents {
 public:
  static constexpr std::uint64_t kGrain = 512;  // parts begin and end at multiples of it
  static std::uint64_t round_up(std::uint64_t bytes) { return (bytes + kGrain - 1) / kGrain * kGrain; }

  // Takes bytes from the smallest free part that is large enough, or else at the end of the file. Returns their offset.
  std::uint64_t take(std::uint64_t bytes) {
    bytes = round_up(bytes);
    in_use_ += bytes;
    const auto best = by_size_.lower_bound({bytes, 0});
    if (best == by_size_.end()) return std::exchange(end_, end_ + bytes);
    const auto [size, offset] = *best;
    remove(free_.find(offset));
    if (size > bytes) add(offset + bytes, size - bytes);
    return offset;
  }

  // Takes a part that was taken in an earlier run. It must be free (is_free()).
  void retake(std::uint64_t offset, std::uint64_t bytes) {
    bytes = round_up(bytes);
    in_use_ += bytes;
    if (offset >= end_) {
      if (offset > end_) add(end_, offset - end_);
      end_ = offset + bytes;
      return;
    }
    const auto around = std::prev(free_.upper_bound(offset));
    const auto [begin, size] = *around;
    remove(around);
    if (begin < offset) add(begin, offset - begin);
    if (offset + bytes < begin + size) add(offset + bytes, begin + size - offset - bytes);
  }
  bool is_free(std::uint64_t offset, std::uint64_t bytes) const {
    if (offset % kGrain != 0) return false;
    if (offset >= end_) return true;
    auto around = free_.upper_bound(offset);
    if (around == free_.begin()) return false;
    around = std::prev(around);
    return offset + round_up(bytes) <= around->first + around->second;
  }

  // Frees a part; offset and size must be those with which it was taken.
  void give_back(std::uint64_t offset, std::uint64_t bytes) {
    bytes = round_up(bytes);
    in_use_ -= bytes;
    if (const auto after = free_.find(offset + bytes); after != free_.end()) {
      bytes += after->second;
      remove(after);
    }
    if (auto before = free_.lower_bound(offset); before != free_.begin()) {
      before = std::prev(before);
      if (before->first + before->second == offset) {
        offset = before->first;
        bytes += before->second;
        remove(before);
      }
    }
    if (offset + bytes == end_)
      end_ = offset;
    else
      add(offset, bytes);
  }

  std::uint64_t end() const { return end_; }  // offset behind the last part in use
  std::uint64_t in_use() const { return in_use_; }

 private:
  using Free = std::map<std::uint64_t, std::uint64_t>;  // size by offset; adjacent parts are merged
  void add(std::uint64_t offset, std::uint64_t bytes) {
    free_.emplace(offset, bytes);
    by_size_.emplace(bytes, offset);
  }
  void remove(Free::iterator at) {
    by_size_.erase({at->second, at->first});
    free_.erase(at);
  }

  Free free_;
  std::set<std::pair<std::uint64_t, std::uint64_t>> by_size_;
  std::uint64_t end_ = 0, in_use_ = 0;
};

}  // namespace relmap::route
