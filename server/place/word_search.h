// Finds the nearest word of a descriptor in two levels: words are sorted by branch, and only those of the nearest
// branches are searched.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/place/descriptor.h"
#include "server/place/descriptor_table.h"

namespace relmap::place {

// With so many branches, 99.6 % of the answers are those of an exhaustive search (docs/decisions/recognition.md).
inline constexpr std::size_t kBranchesSearched = 8;

// Immutable and thread-safe. `branch_begin` must outlive it.
class WordSearch {
 public:
  WordSearch(std::span<const Descriptor> branches, std::span<const std::uint32_t> branch_begin,
             std::span<const Descriptor> centroids);

  // The nearest word; of equally near ones, the lowest of the nearest branch.
  std::uint32_t nearest(const Descriptor& descriptor) const;

 private:
  DescriptorTable branches_;
  std::span<const std::uint32_t> branch_begin_;
  std::vector<DescriptorTable> words_;  // by branch
  std::size_t most_ = 0;                // descriptors in one table
};

}  // namespace relmap::place
