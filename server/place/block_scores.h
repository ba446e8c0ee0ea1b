// Computes the log-likelihood of a query at all places of a block. Words that are stored as bitmaps are added 32 at a
// time, words that are stored as lists of slots one by one.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/place/bitmap_sums.h"
#include "server/place/fabmap_model.h"
#include "server/place/place_block.h"

namespace relmap::place {

// Not thread-safe. An object is reused from query to query, which saves allocations.
class BlockScores {
 public:
  explicit BlockScores(const FabMapModel& model);

  // Which words of a place count: all that the query touches (FabMapModel::touched_by()), or only those that it shows.
  // The others, of which it shows only the parent, are as many, and each tells a tenth as much: without them, which is
  // enough to rank places, a query takes half of the time.
  enum class Counts : std::uint8_t { kTouched, kShown };
  // Sets the query: words, sorted and unique.
  void ask(std::span<const std::uint32_t> query, Counts counts = Counts::kTouched);

  // Writes the score of each place of the block.
  void of_block(const PlaceBlock& block, LogLikelihood* scores);
  // The score of a place that is in no block yet; `constant` is FabMapModel::place() of its words.
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
  std::vector<Increment> touched_;         // sorted by word
  std::vector<LogLikelihood> increments_;  // by word; 0 for words that the query does not touch
  // Scratch memory of of_block():
  std::vector<BitmapWords> bitmaps_;
  std::vector<Slots> slots_;
  std::vector<LogLikelihood> padded_;  // scores where the number of places is not a multiple of kBitmapPlaces
};

}  // namespace relmap::place
