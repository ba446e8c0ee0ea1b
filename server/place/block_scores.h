// The log-likelihoods of one query at all places of a block: words with bitmaps 32 at a time, those with lists of slots
// one by one.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/place/bitmap_sums.h"
#include "server/place/fabmap_model.h"
#include "server/place/place_block.h"

namespace relmap::place {

// One thread at a time; kept from query to query for its memory.
class BlockScores {
 public:
  explicit BlockScores(const FabMapModel& model);

  // `query` sorted and unique.
  void ask(std::span<const std::uint32_t> query);

  // For each place of the block.
  void of_block(const PlaceBlock& block, LogLikelihood* scores);
  // Of a place that stands in no block yet; `constant` of FabMapModel::place().
  LogLikelihood of_words(LogLikelihood constant, std::span<const std::uint32_t> words) const;

  std::size_t memory_bytes() const;

 private:
  struct Increment {
    std::uint32_t word;
    LogLikelihood value;
  };
  struct Slots {
    const std::uint8_t *begin, *end;
    LogLikelihood increment;
  };

  const FabMapModel& model_;
  LogLikelihood empty_place_ = 0;
  std::vector<Increment> touched_;         // by word
  std::vector<LogLikelihood> increments_;  // of every word; 0 but for those touched
  // Of a block:
  std::vector<BitmapWords> bitmaps_;
  std::vector<Slots> slots_;
  std::vector<LogLikelihood> padded_;  // scores, where the places are no multiple of kBitmapPlaces
};

}  // namespace relmap::place
