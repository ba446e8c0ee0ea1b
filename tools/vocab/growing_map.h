// A map that grows picture by picture, with two ways to find its places: the place index, and tf-idf.
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

  // Adds the next picture of the set. Throws.
  void add(const DescribedPicture& picture);

  // Places for a picture of the set.
  place::PlaceAnswer by_index(const RecognitionSet::Picture& asked, const DescribedPicture& picture) const;
  // The same by tf-idf: as many candidates, as far apart, with the cosine in place of a probability.
  std::vector<place::PlaceCandidate> by_tf_idf(const RecognitionSet::Picture& asked,
                                               const DescribedPicture& picture) const;

  // Whether the frame, or the one before or after it, shows the place that was asked for.
  bool shows(FrameId frame, const RecognitionSet::Picture& asked) const;
  // The number of inliers of geometric verification at `frame`; nullopt if it refuses. Places that are masked for
  // `asked` are not answers.
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
