// For tests: a valid vocabulary that needs no training pictures.
#pragma once

#include <algorithm>
#include <memory>
#include <random>

#include "server/place/vocabulary.h"
#include "server/place/vocabulary_format.h"

namespace relmap::place {

// Random descriptors, tree and probabilities; `words` and `samples` at least 1.
inline VocabularyModel random_vocabulary_model(std::uint32_t words, std::uint32_t samples, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const auto descriptor = [&] {
    Descriptor d;
    for (std::uint8_t& byte : d) byte = static_cast<std::uint8_t>(random());
    return d;
  };
  VocabularyModel model;
  model.source = "random, for tests";
  const auto per_branch = std::max<std::uint32_t>(1, words / 16);
  for (std::uint32_t w = 0; w < words; ++w) {
    if (w % per_branch == 0) {
      model.branch_begin.push_back(w);
      model.branches.push_back(descriptor());
    }
    Descriptor centroid = model.branches.back();
    for (std::uint8_t& byte : centroid)
      byte = static_cast<std::uint8_t>(std::clamp(byte + static_cast<int>(random() % 61) - 30, 0, 255));
    model.centroids.push_back(centroid);
    model.parent.push_back(w == 0 ? 0 : static_cast<std::uint32_t>(random() % w));
    const auto p = static_cast<float>(0.01 + 0.3 * uniform());
    model.marginal.push_back(p);
    model.given_parent_absent.push_back(w == 0 ? p : static_cast<float>(0.005 + 0.2 * uniform()));
    model.given_parent_present.push_back(w == 0 ? p : static_cast<float>(0.1 + 0.8 * uniform()));
  }
  model.branch_begin.push_back(words);
  for (std::uint32_t s = 0; s < samples; ++s) {
    std::vector<std::uint32_t> place;
    for (std::uint32_t w = 0; w < words; ++w)
      if (uniform() < static_cast<double>(model.marginal[w])) place.push_back(w);
    model.sample_places.push_back(std::move(place));
  }
  return model;
}

inline std::shared_ptr<const Vocabulary> random_vocabulary(std::uint32_t words, std::uint32_t samples,
                                                           std::uint64_t seed) {
  return Vocabulary::from_bytes(encode_vocabulary(random_vocabulary_model(words, samples, seed))).or_throw();
}

}  // namespace relmap::place
