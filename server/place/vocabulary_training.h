// Trains a vocabulary on the descriptors of pictures: words by k-means, their dependence by a Chow-Liu tree with one
// document for each picture, and sample places that stand for the unknown world. Deterministic.
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
  std::size_t words = 2500;          // at most; fewer if fewer descriptors differ
  std::size_t sample_places = 300;   // pictures, taken at even intervals
  std::size_t max_points = 300'000;  // descriptors for k-means, taken at even intervals; at least 10 a word are used
  std::uint64_t seed = 1;
  std::string source;  // what the pictures are, and under which terms; at most 4096 bytes
};

using TrainingProgress = std::function<void(std::string_view stage, double share)>;

// `pictures` holds the descriptors of each picture; their order affects only which ones are taken at even intervals.
// INVALID_ARGUMENT: fewer pictures than sample places, fewer than 10 descriptors a word, a number of words or sample
// places out of range, or too long a source.
Result<VocabularyModel> train_vocabulary(std::span<const std::vector<Descriptor>> pictures,
                                         const TrainingOptions& options, const TrainingProgress& progress = {});

}  // namespace relmap::place
