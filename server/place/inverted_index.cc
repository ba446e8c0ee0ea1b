#include "server/place/inverted_index.h"

#include <algorithm>
#include <cassert>

namespace relmap {
namespace {

constexpr std::size_t kBlockBytes = 16;  // of the allocator, for each list

}  // namespace

std::uint32_t InvertedIndex::add(std::span<const std::uint32_t> words) {
  const std::uint32_t place = size();
  double constant = 0;
  for (const std::uint32_t word : words) {
    assert(word < lists_.size());
    auto& list = lists_[word];
    // A quarter at a time: doubling would leave half of a large index unused.
    if (list.size() == list.capacity()) {
      const std::size_t before = list.capacity();
      list.reserve(list.size() + std::max<std::size_t>(4, list.size() / 4));
      growing_bytes_ += (list.capacity() - before) * sizeof(std::uint32_t) + (before == 0 ? kBlockBytes : 0);
    }
    list.push_back(place);
    constant += model_->place_term(word);
  }
  if (constants_.size() == constants_.capacity())
    constants_.reserve(constants_.size() + std::max<std::size_t>(1024, constants_.size() / 8));
  constants_.push_back(constant);
  return place;
}

// A place stands in one segment only, so its terms are added in the order of `touched` wherever its lists are: the sum
// is the same bit for bit.
std::vector<double> InvertedIndex::log_likelihoods(std::span<const TouchedWord> touched) const {
  std::vector<double> result = constants_;
  for (const auto& segment : segments_) {
    PostingSegment::Reader reader(*segment);
    for (const TouchedWord& t : touched) {
      const double increment = model_->increment(t);
      for (const std::uint32_t place : reader.list(t.word)) result[place] += increment;
    }
  }
  for (const TouchedWord& t : touched) {
    const double increment = model_->increment(t);
    for (const std::uint32_t place : lists_[t.word]) result[place] += increment;
  }
  const double empty = model_->empty_place(touched);
  for (double& value : result) value += empty;
  return result;
}

Result<InvertedIndex::Segments> InvertedIndex::freeze(const std::string& folder) const {
  const std::uint32_t first = segments_.empty() ? 0 : segments_.back()->first() + segments_.back()->places();
  auto newest = PostingSegment::write(
      folder, model_->size(), first, size() - first,
      [&](std::uint32_t word) -> Result<std::span<const std::uint32_t>> { return std::span(lists_[word]); });
  if (!newest.ok()) return newest.status();
  Segments segments = segments_;
  segments.push_back(std::move(newest).value());
  while (segments.size() > 1) {
    const auto& older = segments[segments.size() - 2];
    if (older->places() >= 2 * std::uint64_t{segments.back()->places()}) break;
    auto merged = PostingSegment::merge(folder, *older, *segments.back());
    if (!merged.ok()) break;  // two do as well as one, and the next freeze() tries again
    segments.pop_back();
    segments.back() = std::move(merged).value();
  }
  return segments;
}

void InvertedIndex::adopt(Segments segments) {
  segments_ = std::move(segments);
  for (auto& list : lists_) std::vector<std::uint32_t>().swap(list);
  growing_bytes_ = 0;
}

std::size_t InvertedIndex::memory_bytes() const {
  return lists_.capacity() * sizeof(lists_[0]) + constants_.capacity() * sizeof(double) + growing_bytes_;
}

std::vector<std::uint32_t> sorted_unique(std::span<const std::uint32_t> words) {
  std::vector<std::uint32_t> result(words.begin(), words.end());
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

}  // namespace relmap
