#include "tools/vocab/tf_idf.h"

#include <cmath>
#include <map>

namespace relmap::vocab {

WeightedWords tf_idf(const place::Vocabulary& vocabulary, std::span<const std::uint32_t> words) {
  std::map<std::uint32_t, double> weights;
  for (const std::uint32_t word : words) weights[word] -= std::log(double{vocabulary.marginal()[word]});
  double squares = 0;
  for (const auto& [word, weight] : weights) squares += weight * weight;
  for (auto& [word, weight] : weights) weight /= std::sqrt(squares);
  return {weights.begin(), weights.end()};
}

double cosine(const WeightedWords& a, const WeightedWords& b) {
  double sum = 0;
  for (auto x = a.begin(), y = b.begin(); x != a.end() && y != b.end();) {
    if (x->first == y->first)
      sum += (x++)->second * (y++)->second;
    else if (x->first < y->first)
      ++x;
    else
      ++y;
  }
  return sum;
}

}  // namespace relmap::vocab
