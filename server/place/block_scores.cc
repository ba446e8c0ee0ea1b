#include "server/place/block_scores.h"

#include <bit>

namespace relmap {
namespace {

// Sums of the increments of eight words, for every choice among them.
template <typename Table>
void fill(Table& table, const LogLikelihood* increments) {
  table[0] = 0;
  for (std::size_t choice = 1; choice < table.size(); ++choice)
    table[choice] = table[choice & (choice - 1)] + increments[std::countr_zero(choice)];
}

constexpr std::size_t kAhead = 6;

void add_wide(const PlaceBlock::List& list, LogLikelihood increment, LogLikelihood* scores) {
  const std::uint8_t* at = list.bytes;
  const std::uint8_t* const end = at + list.size;
  for (; end - at >= 8; at += 8) {
    const auto four = PlaceBlock::load<std::uint64_t>(at);
    scores[four & 0xffff] += increment;
    scores[four >> 16 & 0xffff] += increment;
    scores[four >> 32 & 0xffff] += increment;
    scores[four >> 48] += increment;
  }
  for (; at != end; at += 2) scores[PlaceBlock::load<std::uint16_t>(at)] += increment;
}

void add_narrow(const PlaceBlock::List& list, LogLikelihood increment, LogLikelihood* scores) {
  const std::uint8_t* at = list.bytes;
  const std::uint8_t* const end = at + list.size;
  for (; end - at >= 4; at += 4) {
    scores[at[0]] += increment;
    scores[at[0] + at[1]] += increment;
    scores[at[0] + at[1] + at[2]] += increment;
    scores += at[0] + at[1] + at[2] + at[3];
    *scores += increment;
  }
  for (; at != end; ++at) *(scores += *at) += increment;
}

}  // namespace

BlockScores::BlockScores(const FabMapModel& model, const CommonWords& common)
    : model_(model), common_(common), increments_(model.size()), tables_(common.columns()) {}

void BlockScores::ask(std::span<const std::uint32_t> query) {
  for (const TouchedWord& t : touched_) increments_[t.word] = 0;
  touched_ = model_.touched_by(query);
  empty_place_ = model_.empty_place(touched_);
  rare_.clear();
  std::array<LogLikelihood, CommonWords::kMost> of_common{};
  for (const TouchedWord& t : touched_) {
    const LogLikelihood increment = increments_[t.word] = model_.increment(t);
    const std::uint32_t bit = common_.bit(t.word);
    if (bit == CommonWords::kRare)
      rare_.push_back({t.word, increment});
    else
      of_common[bit] = increment;
  }
  lists_.resize(rare_.size());
  for (std::size_t column = 0; column < tables_.size(); ++column)
    for (std::size_t byte = 0; byte < 8; ++byte) fill(tables_[column][byte], of_common.data() + 64 * column + 8 * byte);
}

void BlockScores::of_block(const PlaceBlock& block, LogLikelihood* scores) {
  for (std::size_t i = 0; i < rare_.size(); ++i) lists_[i] = block.list(rare_[i].word);
  for (std::uint32_t slot = 0; slot < block.places(); ++slot) scores[slot] = empty_place_ + block.constant(slot);
  for (std::uint32_t column = 0; column < tables_.size(); ++column) {
    const auto& t = tables_[column];
    for (std::uint32_t slot = 0; slot < block.places(); ++slot) {
      const std::uint64_t bits = block.bits(column, slot);
      scores[slot] += ((t[0][bits & 255] + t[1][bits >> 8 & 255]) + (t[2][bits >> 16 & 255] + t[3][bits >> 24 & 255])) +
                      ((t[4][bits >> 32 & 255] + t[5][bits >> 40 & 255]) + (t[6][bits >> 48 & 255] + t[7][bits >> 56]));
    }
  }
  for (std::size_t i = 0; i < rare_.size(); ++i) {
    if (i + kAhead < rare_.size()) {
      const PlaceBlock::List& soon = lists_[i + kAhead];
      for (std::uint32_t at = 0; at < soon.size; at += 64) __builtin_prefetch(soon.bytes + at);
    }
    if (lists_[i].wide)
      add_wide(lists_[i], rare_[i].increment, scores);
    else
      add_narrow(lists_[i], rare_[i].increment, scores);
  }
}

LogLikelihood BlockScores::of_words(std::span<const std::uint32_t> words) const {
  LogLikelihood sum = empty_place_;
  for (const std::uint32_t word : words) sum += model_.place_term(word) + increments_[word];
  return sum;
}

std::size_t BlockScores::memory_bytes() const {
  return increments_.capacity() * sizeof(LogLikelihood) + tables_.capacity() * sizeof(tables_[0]);
}

}  // namespace relmap
