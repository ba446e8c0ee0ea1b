#include "server/place/inverted_index.h"

#include <algorithm>
#include <cassert>

namespace relmap {

std::uint32_t InvertedIndex::add(std::span<const std::uint32_t> words) {
  const std::uint32_t place = size();
  double constant = 0;
  for (const std::uint32_t word : words) {
    assert(word < lists_.size());
    auto& list = lists_[word];
    // A quarter at a time: doubling would leave half of a large index unused.
    if (list.size() == list.capacity()) list.reserve(list.size() + std::max<std::size_t>(4, list.size() / 4));
    list.push_back(place);
    constant += model_->place_term(word);
  }
  constants_.push_back(constant);
  return place;
}

std::vector<double> InvertedIndex::log_likelihoods(std::span<const TouchedWord> touched) const {
  std::vector<double> result = constants_;
  for (const TouchedWord& t : touched) {
    const double increment = model_->increment(t);
    for (const std::uint32_t place : lists_[t.word]) result[place] += increment;
  }
  const double empty = model_->empty_place(touched);
  for (double& value : result) value += empty;
  return result;
}

std::size_t InvertedIndex::memory_bytes() const {
  std::size_t bytes = lists_.capacity() * sizeof(lists_[0]) + constants_.capacity() * sizeof(double);
  for (const auto& list : lists_) bytes += list.capacity() * sizeof(std::uint32_t);
  return bytes;
}

std::vector<std::uint32_t> sorted_unique(std::span<const std::uint32_t> words) {
  std::vector<std::uint32_t> result(words.begin(), words.end());
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

}  // namespace relmap
