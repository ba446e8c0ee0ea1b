// The map that grows picture by picture, and whom its places can be asked of: the place index, and tf-idf.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/place/place_index.h"
#include "server/place/testing/hand_made_graph.h"
#include "tools/vocab/recognition_set.h"
#include "tools/vocab/tf_idf.h"

namespace relmap::vocab {

struct DescribedPicture {
  std::vector<AppearanceFeature> features;
  std::vector<std::uint32_t> words;
  int width = 0, height = 0;
};

class GrowingMap {
 public:
  // The set must outlive it.
  GrowingMap(std::shared_ptr<const place::Vocabulary> vocabulary, const RecognitionSet& set);

  // The pictures of the set one after another. Throws.
  void add(const DescribedPicture& picture);

  // Places for a picture of the set.
  place::PlaceAnswer by_index(const RecognitionSet::Picture& asked, const DescribedPicture& picture) const;
  // By the cosine, which stands for a probability: as many, and as far apart.
  std::vector<place::PlaceCandidate> by_tf_idf(const RecognitionSet::Picture& asked,
                                               const DescribedPicture& picture) const;

  // Whether the frame, or the one before or after it, shows what was asked for.
  bool shows(FrameId frame, const RecognitionSet::Picture& asked) const;
  // Inliers of geometry there; nothing where it refuses. No answer is made of what is masked for `asked`.
  std::optional<std::uint32_t> verify(FrameId frame, const RecognitionSet::Picture& asked,
                                      const DescribedPicture& picture) const;

 private:
  std::vector<storage::FrameRange> masked(const RecognitionSet::Picture& asked) const;

  const std::shared_ptr<const place::Vocabulary> vocabulary_;
  const RecognitionSet& set_;
  place::PlaceIndex index_;
  place::HandMadeGraph graph_;
  std::map<FrameId, std::uint32_t> number_of_;  // pictures that are places
  std::vector<WeightedWords> weights_;
};

}  // namespace relmap::vocab
