// Bags of visual words, compared by the cosine of their tf-idf weights (Sivic and Zisserman, ICCV 2003): what FAB-MAP
// is measured against.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/place/vocabulary.h"

namespace relmap::vocab {

// Sorted by word; of length one, but for a picture without words.
using WeightedWords = std::vector<std::pair<std::uint32_t, double>>;

// `words` as they come: a word counts as often as it is seen. Documents are those that the vocabulary was trained on:
// log(N / df) is -log p(z = 1).
WeightedWords tf_idf(const place::Vocabulary& vocabulary, std::span<const std::uint32_t> words);

double cosine(const WeightedWords& a, const WeightedWords& b);

}  // namespace relmap::vocab
