#include "server/place/common_words.h"

#include <algorithm>
#include <numeric>

namespace relmap {

CommonWords::CommonWords(const Vocabulary& vocabulary) : bit_(vocabulary.size(), kRare) {
  std::vector<std::uint32_t> words(vocabulary.size());
  std::iota(words.begin(), words.end(), 0u);
  const auto common = std::min<std::size_t>(words.size(), kMost);
  const auto marginal = vocabulary.marginal();
  std::partial_sort(
      words.begin(), words.begin() + static_cast<std::ptrdiff_t>(common), words.end(),
      [&](std::uint32_t x, std::uint32_t y) { return marginal[x] != marginal[y] ? marginal[x] > marginal[y] : x < y; });
  for (std::uint32_t i = 0; i < common; ++i) bit_[words[i]] = i;
  columns_ = static_cast<std::uint32_t>((common + 63) / 64);
}

}  // namespace relmap
