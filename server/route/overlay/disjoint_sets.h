// Disjoint sets (union-find, Tarjan 1975) of the numbers 0 .. n - 1.
#pragma once

#include <cstdint>
#include <numeric>
#include <vector>

namespace relmap::route {

class DisjointSets {
 public:
  explicit DisjointSets(std::uint32_t n = 0) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t size() const { return static_cast<std::uint32_t>(parent_.size()); }
  // Adds n numbers, each in a set of its own. Returns the first of them.
  std::uint32_t add(std::size_t n) {
    const std::uint32_t first = size();
    parent_.resize(first + n);
    std::iota(parent_.begin() + first, parent_.end(), first);
    return first;
  }
  std::uint32_t find(std::uint32_t x) {
    while (parent_[x] != x) x = parent_[x] = parent_[parent_[x]];
    return x;
  }
  // Unites the sets of x and y. False if they were one set already.
  bool join(std::uint32_t x, std::uint32_t y) {
    x = find(x);
    y = find(y);
    parent_[x] = y;
    return x != y;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace relmap::route
