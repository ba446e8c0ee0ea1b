// The log-likelihoods of one query at all places of a block: bits of common words by tables of 256 sums, eight words a
// look-up; the lists of the other words one by one.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/place/common_words.h"
#include "server/place/fabmap_model.h"
#include "server/place/place_block.h"

namespace relmap {

// One thread at a time; kept from query to query for its memory.
class BlockScores {
 public:
  BlockScores(const FabMapModel& model, const CommonWords& common);

  // `query` sorted and unique.
  void ask(std::span<const std::uint32_t> query);

  // For each place of the block.
  void of_block(const PlaceBlock& block, LogLikelihood* scores);
  // Of a place that stands in no block yet.
  LogLikelihood of_words(std::span<const std::uint32_t> words) const;

  std::size_t memory_bytes() const;

 private:
  struct Rare {
    std::uint32_t word;
    LogLikelihood increment;
  };
  using Table = std::array<LogLikelihood, 256>;  // by eight bits

  const FabMapModel& model_;
  const CommonWords& common_;
  LogLikelihood empty_place_ = 0;
  std::vector<TouchedWord> touched_;
  std::vector<LogLikelihood> increments_;  // of every word; 0 but for those touched
  std::vector<Rare> rare_;
  std::vector<PlaceBlock::List> lists_;       // of those
  std::vector<std::array<Table, 8>> tables_;  // by column
};

}  // namespace relmap
