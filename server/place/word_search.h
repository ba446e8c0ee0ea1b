// The nearest word of a descriptor, by two levels: the words lie sorted by branch, and only those of the nearest few
// branches are looked at.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/place/descriptor.h"

namespace relmap::place {

// Of the branches: 99.6 % of the answers are those of an exhaustive search (docs/decisions/recognition.md).
inline constexpr std::size_t kBranchesSearched = 8;

// Immutable and thread-safe. The tables are borrowed.
class WordSearch {
 public:
  WordSearch(std::span<const Descriptor> branches, std::span<const std::uint32_t> branch_begin,
             std::span<const Descriptor> centroids);

  // Of equally near words, the lowest of the nearer branch.
  std::uint32_t nearest(const Descriptor& descriptor) const;

 private:
  // Centres in space with their squared lengths: |d - c|^2 orders them as |c|^2 - 2 d.c does, at half the price.
  struct Centres {
    std::span<const Descriptor> at;
    std::vector<std::int32_t> squared_length;
  };
  Centres branches_, words_;
  std::span<const std::uint32_t> branch_begin_;
};

}  // namespace relmap::place
