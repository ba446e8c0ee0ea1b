#include "server/place/likeness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "server/place/descriptor.h"

namespace relmap::place {
namespace {

constexpr double kSigma = 170;  // of the distance between two descriptors of one point; their length is 512
// log_likelihood_ratio(): its value at likeness 0, and its slope over the square root of the likeness.
constexpr double kUnlike = -0.4, kPerRoot = 2.6;

// Finds the features of a word: a hash table with chains, made once for many places.
class FeaturesByWord {
 public:
  explicit FeaturesByWord(std::span<const std::uint32_t> words) : words_(words), next_(words.size(), -1) {
    first_.fill(-1);
    for (std::size_t f = words.size(); f-- > 0;)
      next_[f] = std::exchange(first_[words[f] % kChains], static_cast<std::int32_t>(f));
  }

  // Calls visit(feature) in ascending order.
  template <typename Visit>
  void of(std::uint32_t word, const Visit& visit) const {
    for (std::int32_t f = first_[word % kChains]; f >= 0; f = next_[f])
      if (words_[f] == word) visit(static_cast<std::uint32_t>(f));
  }

 private:
  static constexpr std::size_t kChains = 1024;

  std::span<const std::uint32_t> words_;
  std::array<std::int32_t, kChains> first_;
  std::vector<std::int32_t> next_;
};

struct Pair {
  std::uint32_t distance, feature, of_place;
  bool operator<(const Pair& other) const {
    return std::tie(distance, feature, of_place) < std::tie(other.distance, other.feature, other.of_place);
  }
};

// Pairs each feature of the query with the place's nearest feature of the same word.
std::vector<Pair> nearest_of_word(const DescribedWords& query, const FeaturesByWord& by_word,
                                  const DescribedWords& place) {
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::vector<Pair> nearest(query.words.size(), Pair{kNone, 0, 0});
  for (std::uint32_t other = 0; other < place.words.size(); ++other)
    by_word.of(place.words[other], [&](std::uint32_t feature) {
      const std::uint32_t distance =
          squared_distance(query.features[feature].descriptor, place.features[other].descriptor);
      nearest[feature] = std::min(nearest[feature], {distance, feature, other});
    });
  std::erase_if(nearest, [](const Pair& pair) { return pair.distance == kNone; });
  return nearest;
}

// How well the place agrees with each feature of the query, 0 .. 1.
std::vector<double> agreement(const DescribedWords& query, const FeaturesByWord& by_word, const DescribedWords& place) {
  std::vector<double> agrees(query.words.size());
  std::vector<bool> taken(place.words.size());
  std::vector<Pair> pairs = nearest_of_word(query, by_word, place);
  std::sort(pairs.begin(), pairs.end());
  for (const Pair& pair : pairs) {
    if (taken[pair.of_place]) continue;
    taken[pair.of_place] = true;
    agrees[pair.feature] = std::exp(-static_cast<double>(pair.distance) / (2 * kSigma * kSigma));
  }
  return agrees;
}

// Subtracts from each sum the mean of the best sums of all other groups.
std::vector<double> above_other_groups(std::vector<double> sums, std::span<const std::uint32_t> groups,
                                       std::size_t group_count) {
  if (group_count < 2) return std::vector<double>(sums.size());
  std::vector<double> best(group_count);
  for (std::size_t i = 0; i < sums.size(); ++i) best[groups[i]] = std::max(best[groups[i]], sums[i]);
  const double all = std::accumulate(best.begin(), best.end(), 0.0);
  for (std::size_t i = 0; i < sums.size(); ++i)
    sums[i] -= (all - best[groups[i]]) / static_cast<double>(group_count - 1);
  return sums;
}

}  // namespace

std::vector<double> likeness(const DescribedWords& query, std::span<const DescribedWords> places,
                             std::span<const std::uint32_t> groups) {
  const FeaturesByWord by_word(query.words);
  std::vector<std::vector<double>> agrees;
  for (const DescribedWords& place : places) agrees.push_back(agreement(query, by_word, place));

  const std::size_t group_count = groups.empty() ? 0 : *std::max_element(groups.begin(), groups.end()) + std::size_t{1};
  std::vector<double> sums(places.size()), of_group(group_count);
  for (std::size_t feature = 0; feature < query.words.size(); ++feature) {
    std::fill(of_group.begin(), of_group.end(), 0.0);
    for (std::size_t i = 0; i < places.size(); ++i)
      of_group[groups[i]] = std::max(of_group[groups[i]], agrees[i][feature]);
    const double shown = std::accumulate(of_group.begin(), of_group.end(), 0.0);
    if (shown == 0) continue;
    const double weight = std::log((static_cast<double>(group_count) + 1) / (shown + 1));
    for (std::size_t i = 0; i < places.size(); ++i) sums[i] += agrees[i][feature] * weight;
  }
  return above_other_groups(std::move(sums), groups, group_count);
}

double log_likelihood_ratio(double likeness) { return kUnlike + kPerRoot * std::sqrt(std::max(0.0, likeness)); }

}  // namespace relmap::place
