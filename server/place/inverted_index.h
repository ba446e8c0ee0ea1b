// Places by the words seen there: for each word a flat list of place numbers, for each place its constant. The lists
// grow in memory; freeze() puts them on disk, from where queries read those that they need.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/place/fabmap_model.h"
#include "server/place/posting_segment.h"

namespace relmap {

// Not thread-safe, but for what is const.
class InvertedIndex {
 public:
  explicit InvertedIndex(const FabMapModel& model) : model_(&model), lists_(model.size()) {}

  // Numbers count from 0. `words` is sorted and unique, all below model.size().
  std::uint32_t add(std::span<const std::uint32_t> words);
  std::uint32_t size() const { return static_cast<std::uint32_t>(constants_.size()); }

  // Log-likelihood of the query at each place. Throws StatusError where lists on disk cannot be read.
  std::vector<double> log_likelihoods(std::span<const TouchedWord> touched) const;

  // In two steps, so that only the second keeps queries waiting: the segments that the index would have if all that
  // grows in memory were frozen, and taking them on, with no add() between. Few and large: each is merged with the one
  // before it until that is at least twice as large. IO_ERROR: nothing has changed.
  using Segments = std::vector<std::shared_ptr<const PostingSegment>>;
  Result<Segments> freeze(const std::string& folder) const;
  void adopt(Segments segments);

  std::size_t memory_bytes() const;
  std::size_t growing_bytes() const { return growing_bytes_; }  // of them, what freezing would free
  std::size_t segments() const { return segments_.size(); }

 private:
  const FabMapModel* model_;
  Segments segments_;                              // places 0, 1, ... in order
  std::vector<std::vector<std::uint32_t>> lists_;  // of the places after those
  std::size_t growing_bytes_ = 0;
  std::vector<double> constants_;
};

// `words` sorted, each once.
std::vector<std::uint32_t> sorted_unique(std::span<const std::uint32_t> words);

}  // namespace relmap
