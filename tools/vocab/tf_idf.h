// Bags of visual words compared by the cosine of their tf-idf weights (Sivic and Zisserman, ICCV 2003), the reference
// that FAB-MAP is measured against.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/place/vocabulary.h"

namespace relmap::vocab {

// Sorted by word; of unit length, except for a picture without words.
using WeightedWords = std::vector<std::pair<std::uint32_t, double>>;

// `words` may contain a word several times; it counts as often. The documents are the pictures that the vocabulary was
// trained on: log(N / df) is -log p(z = 1).
WeightedWords tf_idf(const place::Vocabulary& vocabulary, std::span<const std::uint32_t> words);

double cosine(const WeightedWords& a, const WeightedWords& b);

}  // namespace relmap::vocab
