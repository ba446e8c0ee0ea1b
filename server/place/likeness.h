// Measures how much a picture looks like each of a few places by comparing the descriptors of features that share a
// word: a word carries about 4 bits a feature, a descriptor 1,024. Descriptors are compared by their distance, as
// Hamming embedding does with signatures (Jegou, Douze and Schmid, ECCV 2008). Features that many of the places show
// count little, like a common word, since only what differs can tell the places apart.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "proto/keyframe/keyframe.h"

namespace relmap::place {

// Features, and the word of each.
struct DescribedWords {
  std::span<const AppearanceFeature> features;
  std::span<const std::uint32_t> words;
};

// Returns the likeness of the query to each of `places`. `groups` holds the group of each place; each of the groups
// 0 .. N - 1 has a place.
//
// Each feature of the query is matched to the place's nearest feature with the same word, and each feature of the place
// is matched at most once, to the nearest. A match at distance d agrees by exp(-d^2 / 2 s^2), and this is weighted by
// log (N + 1) / (n + 1), where n is the number of groups that agree with the feature. The sum over features is reduced
// by the mean of the other groups' best sums, since what a picture has in common with every place says nothing; it may
// be negative. With a single group all are 0. The order of places changes only the last bits.
std::vector<double> likeness(const DescribedWords& query, std::span<const DescribedWords> places,
                             std::span<const std::uint32_t> groups);

// log p(likeness | the query shows the place) / p(likeness | it does not), a fitted function
// (docs/decisions/recognition.md).
double log_likelihood_ratio(double likeness);

}  // namespace relmap::place
