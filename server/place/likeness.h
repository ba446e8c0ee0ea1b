// How much a picture looks like each of a few places, by the descriptors behind the words that they share: what a word
// says at 4 bits a feature, its descriptor says at 1,024. Features of one word are compared by the distance of their
// descriptors, as Hamming embedding does with signatures (Jegou, Douze and Schmid, ECCV 2008), and what many of the
// places show counts little, as a word that is common: which of a few places it is, only what differs can tell.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "proto/keyframe/keyframe.h"

namespace relmap::place {

// Features with their words, one each.
struct DescribedWords {
  std::span<const AppearanceFeature> features;
  std::span<const std::uint32_t> words;
};

// Of each of `places`. A feature of the query takes the nearest of the place with its word, and each of the place's is
// taken once, by the nearest. The two agree by exp(-d^2 / 2 s^2); that counts log (N + 1) / (n + 1), where N groups of
// places were asked, of which n agree as well. Of the sum over features the mean of the other groups' best is taken:
// what a picture has in common with any place says nothing, and may leave less than 0. `groups`: of each place,
// 0 .. N - 1, all of them there; of one group nothing can be told. The order of places matters to nothing but the last
// bits.
std::vector<double> likeness(const DescribedWords& query, std::span<const DescribedWords> places,
                             std::span<const std::uint32_t> groups);

// log p(likeness | the query shows the place) / p(likeness | it does not). Fitted (docs/decisions/recognition.md).
double log_likelihood_ratio(double likeness);

}  // namespace relmap::place
