// The words that most places show: for them a bit a place costs less than lists (place_block.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/place/vocabulary.h"

namespace relmap {

// By their marginals, so a function of the vocabulary. Immutable and thread-safe.
class CommonWords {
 public:
  static constexpr std::uint32_t kMost = 256;  // a multiple of 64
  static constexpr std::uint32_t kRare = ~std::uint32_t{0};

  explicit CommonWords(const Vocabulary& vocabulary);

  // Its bit among those of a place; kRare if it has none.
  std::uint32_t bit(std::uint32_t word) const { return bit_[word]; }
  std::uint32_t columns() const { return columns_; }  // of 64 bits
  std::uint32_t vocabulary_size() const { return static_cast<std::uint32_t>(bit_.size()); }
  std::size_t memory_bytes() const { return bit_.capacity() * sizeof(bit_[0]); }

 private:
  std::vector<std::uint32_t> bit_;
  std::uint32_t columns_ = 0;
};

}  // namespace relmap
