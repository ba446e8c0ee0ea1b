#include "server/place/block_scores.h"

#include <algorithm>

namespace relmap::place {
namespace {

constexpr std::size_t kAhead = 6;

void prefetch(const std::uint8_t* begin, const std::uint8_t* end) {
  for (; begin < end; begin += 64) __builtin_prefetch(begin);
}

void add_slots(const std::uint8_t* at, const std::uint8_t* end, LogLikelihood increment, LogLikelihood* scores) {
  for (; end - at >= 8; at += 8) {
    const auto four = PlaceBlock::load<std::uint64_t>(at);
    scores[four & 0xffff] += increment;
    scores[four >> 16 & 0xffff] += increment;
    scores[four >> 32 & 0xffff] += increment;
    scores[four >> 48] += increment;
  }
  for (; at != end; at += 2) scores[PlaceBlock::load<std::uint16_t>(at)] += increment;
}

}  // namespace

BlockScores::BlockScores(const FabMapModel& model)
    : model_(model), increments_(model.size()), padded_(kPlacesPerBlock) {}

void BlockScores::ask(std::span<const std::uint32_t> query, Counts counts) {
  for (const Increment& t : touched_) increments_[t.word] = 0;
  touched_.clear();
  const std::vector<TouchedWord> touched = model_.touched_by(query);
  empty_place_ = model_.empty_place(touched);
  for (const TouchedWord& t : touched) {
    if (counts == Counts::kShown && t.seen == WordCase::kOnlyParent) continue;
    touched_.push_back({t.word, model_.increment(t)});
    increments_[t.word] = touched_.back().value;
  }
  std::sort(touched_.begin(), touched_.end(), [](const Increment& x, const Increment& y) { return x.word < y.word; });
}

void BlockScores::of_block(const PlaceBlock& block, LogLikelihood* scores) {
  bitmaps_.clear();
  slots_.clear();
  std::size_t in_group = kBitmapWords;
  for (const Increment& t : touched_) {
    const PlaceBlock::List list = block.list(t.word);
    if (!list.bitmap) {
      slots_.push_back({list.bytes, list.bytes + list.size, t.value});
      continue;
    }
    if (in_group == kBitmapWords) {
      bitmaps_.emplace_back();
      bitmaps_.back().bitmaps.fill(list.bytes);
      bitmaps_.back().increments.fill(0);
      in_group = 0;
    }
    bitmaps_.back().bitmaps[in_group] = list.bytes;
    bitmaps_.back().increments[in_group++] = t.value;
  }

  const bool padded = block.places() % kBitmapPlaces != 0;
  LogLikelihood* const sums = padded ? padded_.data() : scores;
  for (std::uint32_t slot = 0; slot < block.places(); ++slot) sums[slot] = empty_place_ + block.constant(slot);
  for (const BitmapWords& words : bitmaps_) add_bitmaps(words, block.bitmap_bytes(), sums);
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    if (i + kAhead < slots_.size()) prefetch(slots_[i + kAhead].begin, slots_[i + kAhead].end);
    add_slots(slots_[i].begin, slots_[i].end, slots_[i].increment, sums);
  }
  if (padded) std::copy(sums, sums + block.places(), scores);
}

LogLikelihood BlockScores::of_words(LogLikelihood constant, std::span<const std::uint32_t> words) const {
  LogLikelihood sum = empty_place_ + constant;
  for (const std::uint32_t word : words) sum += increments_[word];
  return sum;
}

std::size_t BlockScores::memory_bytes() const {
  // Counts what a query needs that touches all words, since another thread may ask while a query runs.
  const std::size_t words = increments_.size();
  return (words + padded_.size()) * sizeof(LogLikelihood) + words * (sizeof(Increment) + sizeof(Slots)) +
         (words / kBitmapWords + 1) * sizeof(BitmapWords);
}

}  // namespace relmap::place
