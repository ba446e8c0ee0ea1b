// From the descriptors of training pictures to a vocabulary: words by k-means, their dependence by a Chow-Liu tree over
// one document a picture, and places that stand for the unknown world. Deterministic.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/base/status.h"
#include "server/place/vocabulary_format.h"

namespace relmap::place {

struct TrainingOptions {
  std::size_t words = 2500;          // at most; fewer where the descriptors are few
  std::size_t sample_places = 300;   // taken evenly from the pictures
  std::size_t max_points = 300'000;  // descriptors that k-means sees, taken evenly
  std::uint64_t seed = 1;
  std::string source;  // what the pictures are, and under which terms; at most 4096 bytes
};

using TrainingProgress = std::function<void(std::string_view stage, double share)>;

// `pictures`: the descriptors of each, in an order that may matter to the even choice but to nothing else.
// INVALID_ARGUMENT: fewer pictures than sample places, fewer than 10 descriptors a word, no words, or a long source.
Result<VocabularyModel> train_vocabulary(std::span<const std::vector<Descriptor>> pictures,
                                         const TrainingOptions& options, const TrainingProgress& progress = {});

}  // namespace relmap::place
