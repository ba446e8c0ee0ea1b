// Places by the words seen there: for each word a flat list of place numbers, for each place its constant.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/place/fabmap_model.h"

namespace relmap {

// Not thread-safe.
class InvertedIndex {
 public:
  explicit InvertedIndex(const FabMapModel& model) : model_(&model), lists_(model.size()) {}

  // Numbers count from 0. `words` is sorted and unique, all below model.size().
  std::uint32_t add(std::span<const std::uint32_t> words);
  std::uint32_t size() const { return static_cast<std::uint32_t>(constants_.size()); }

  // Log-likelihood of the query at each place.
  std::vector<double> log_likelihoods(std::span<const TouchedWord> touched) const;

  std::size_t memory_bytes() const;

 private:
  const FabMapModel* model_;
  std::vector<std::vector<std::uint32_t>> lists_;
  std::vector<double> constants_;
};

// `words` sorted, each once.
std::vector<std::uint32_t> sorted_unique(std::span<const std::uint32_t> words);

}  // namespace relmap
