#include "tools/vocab/growing_map.h"

#include <algorithm>

#include "server/place/place_neighbours.h"
#include "server/place/verify.h"

namespace relmap::vocab {
namespace {

constexpr StereoCamera kOneEye{400, 256, 192, 0, 512, 384};  // that it is mono is all that matters

}  // namespace

GrowingMap::GrowingMap(std::shared_ptr<const place::Vocabulary> vocabulary, const RecognitionSet& set)
    : vocabulary_(std::move(vocabulary)), set_(set), index_(vocabulary_) {}

void GrowingMap::add(const DescribedPicture& picture) {
  const auto number = static_cast<std::uint32_t>(weights_.size());
  const auto& shown = set_.pictures[number];
  weights_.push_back(tf_idf(*vocabulary_, picture.words));
  if (!shown.stays || picture.words.empty()) return;  // a place that shows nothing cannot be recognised
  number_of_[shown.frame] = number;
  if (!graph_.session(shown.frame.session)) graph_.add_session(shown.frame.session, kOneEye);
  graph_.add_frame(shown.frame, {}, {}, {picture.features, picture.words, {}});
  if (const Status status = index_.add(shown.frame, picture.words); !status.ok()) throw StatusError(status);
}

std::vector<storage::FrameRange> GrowingMap::masked(const RecognitionSet::Picture& asked) const {
  std::vector<storage::FrameRange> masked;
  const auto leave_out = [&](std::size_t i) {
    const FrameId frame = set_.pictures[i].frame;
    masked.push_back({frame.session, frame.index, frame.index});
  };
  for (std::size_t i = asked.open; i < weights_.size(); ++i) leave_out(i);
  if (asked.itself) leave_out(*asked.itself);
  return masked;
}

place::PlaceAnswer GrowingMap::by_index(const RecognitionSet::Picture& asked, const DescribedPicture& picture) const {
  return index_.query(picture.words, graph_, masked(asked), {}, picture.features);
}

std::vector<place::PlaceCandidate> GrowingMap::by_tf_idf(const RecognitionSet::Picture& asked,
                                                         const DescribedPicture& picture) const {
  const WeightedWords query = tf_idf(*vocabulary_, picture.words);
  std::map<FrameId, double> open;
  std::vector<place::PlaceCandidate> order;
  for (const auto& [frame, number] : number_of_) {
    if (number >= asked.open || number == asked.itself) continue;
    order.push_back({frame, cosine(query, weights_[number])});
    open[frame] = order.back().probability;
  }
  std::stable_sort(order.begin(), order.end(), [](const place::PlaceCandidate& x, const place::PlaceCandidate& y) {
    return x.probability > y.probability;
  });
  std::vector<place::PlaceCandidate> places;
  for (const place::PlaceCandidate& candidate : order) {
    if (places.size() == place::kMaxCandidates) break;
    if (!open.contains(candidate.frame)) continue;
    for (const FrameId near : place::place_neighbours(graph_, candidate.frame, place::kPlaceRadius)) open.erase(near);
    places.push_back(candidate);
  }
  return places;
}

bool GrowingMap::shows(FrameId frame, const RecognitionSet::Picture& asked) const {
  const std::vector<FrameId> around = place::place_neighbours(graph_, frame, 1);
  return std::any_of(around.begin(), around.end(), [&](FrameId near) {
    const auto number = number_of_.find(near);
    return number != number_of_.end() && std::binary_search(asked.same.begin(), asked.same.end(), number->second);
  });
}

std::optional<std::uint32_t> GrowingMap::verify(FrameId frame, const RecognitionSet::Picture& asked,
                                                const DescribedPicture& picture) const {
  const std::vector<storage::FrameRange> no_answers = masked(asked);
  const StereoCamera camera{0, 0, 0, 0, picture.width, picture.height};
  const auto place = place::verify_place(graph_, {picture.features, camera, no_answers}, frame, 1);
  return place.ok() ? std::optional(place->inliers) : std::nullopt;
}

}  // namespace relmap::vocab
