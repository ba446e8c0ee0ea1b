#include "server/rpc/localise.h"

#include <algorithm>

#include "proto/crc32c.h"
#include "server/route/breadth_first.h"

namespace relmap {

namespace {

constexpr std::size_t kVerified = 6;       // candidates of the place index that geometry is tried on
constexpr std::uint32_t kPriorDepth = 12;  // edges around a prior frame
constexpr std::uint32_t kPriorStride = 4;  // every so many edges one candidate: a verification covers its neighbours
constexpr std::size_t kPriorCandidates = 8;
constexpr std::uint32_t kSure = 2 * kMinInliers;  // inliers with which no further candidate is tried

struct Candidate {
  FrameId frame;
  double probability = 0;
};

// The same picture asks RANSAC for the same numbers.
std::uint64_t seed_of(std::span<const AppearanceFeature> features) {
  std::uint32_t crc = 0;
  for (const AppearanceFeature& feature : features) crc = crc32c(feature.descriptor, crc);
  return crc;
}

Status check_question(const PlaceKnowledge& map, const PlaceQuestion& question) {
  if (map.places.size() == 0) return {Reason::EMPTY_MAP, "the map holds no place yet"};
  if (question.features.size() < kMinInliers)
    return {Reason::TOO_FEW_FEATURES, std::to_string(question.features.size()) + " features; at least " +
                                          std::to_string(kMinInliers) + " are needed"};
  return {};
}

Result<std::vector<Candidate>> near_prior(const PlaceKnowledge& map, FrameId prior, const Deadline& deadline) {
  const WorkLimit work{.max_frames = kTreeFrames, .proceed = [&](std::size_t) { return deadline.check(); }};
  const auto tree =
      search_breadth_first(map.graph, prior, work, [&](const PathTree&, const PathNode& node, const Edge&) {
        return node.depth < kPriorDepth ? Visit::kExpand : Visit::kLeaf;
      });
  if (!tree.ok()) return tree.status();
  std::vector<Candidate> candidates;
  for (const PathNode& node : tree->nodes)
    if (node.depth % kPriorStride == 0 && candidates.size() < kPriorCandidates) candidates.push_back({node.frame, 0});
  return candidates;
}

// Several places explain the picture about as well, and none stands out.
bool is_ambiguous(const PlaceAnswer& answer) {
  return answer.candidates.size() >= 2 && answer.candidates[0].probability < 2 * answer.candidates[1].probability;
}

Status why_nowhere(const PlaceAnswer& answer, const Status& geometry) {
  const std::string said = geometry.ok() ? "" : "; geometry: " + geometry.to_string();
  if (geometry.reason() == Reason::NOT_STEREO) return geometry;
  if (answer.candidates.empty() || answer.new_place > 0.5)
    return {Reason::NEW_PLACE, "a new place with probability " + std::to_string(answer.new_place) + said};
  if (is_ambiguous(answer))
    return {Reason::AMBIGUOUS_PLACE, "the two best of " + std::to_string(answer.candidates.size()) +
                                         " places have probabilities " +
                                         std::to_string(answer.candidates[0].probability) + " and " +
                                         std::to_string(answer.candidates[1].probability) + said};
  return geometry;
}

}  // namespace

Result<Localisation> localise_features(const PlaceKnowledge& map, const PlaceQuestion& question,
                                       const Deadline& deadline) {
  if (!question.camera) return {Reason::NO_CALIBRATION, "localising needs the calibration of the picture"};
  if (Status status = check_question(map, question); !status.ok()) return status;

  std::vector<Candidate> candidates;
  if (question.prior) {
    auto near = near_prior(map, *question.prior, deadline);
    if (!near.ok()) return near.status();
    candidates = std::move(near).value();
  }
  const PlaceAnswer answer = map.places.query(map.vocabulary.words(question.features), map.graph);
  for (const PlaceCandidate& place : answer.candidates) {
    if (candidates.size() >= kVerified + (question.prior ? kPriorCandidates : 0)) break;
    candidates.push_back({place.frame, place.probability});
  }

  const QueryPicture query{question.features, *question.camera};
  const std::uint64_t seed = seed_of(question.features);
  std::optional<Localisation> best;
  Status refusal;
  std::uint32_t tried = 0;
  for (const Candidate& candidate : candidates) {
    if (Status status = deadline.check(); !status.ok()) {
      if (best) break;
      return status;
    }
    auto verified = verify_place(map.graph, query, candidate.frame, seed);
    ++tried;
    if (verified.ok() && !in_metres(verified->verification))
      verified = Status(Reason::NOT_STEREO, "seen at " + candidate.frame.to_string() + ", which knows no metres");
    if (!verified.ok()) {
      if (refusal.ok()) refusal = verified.status();
      continue;
    }
    if (best && best->place.inliers >= verified->inliers) continue;
    best = Localisation{std::move(verified).value(), candidate.probability, answer.new_place, tried};
    if (best->place.inliers >= kSure) break;
  }
  if (!best) return why_nowhere(answer, refusal);
  best->verified_candidates = tried;
  return *std::move(best);
}

Result<PlaceMatches> match_features(const PlaceKnowledge& map, const PlaceQuestion& question, std::size_t verify,
                                    const Deadline& deadline) {
  if (Status status = check_question(map, question); !status.ok()) return status;
  const PlaceAnswer answer = map.places.query(map.vocabulary.words(question.features), map.graph);
  PlaceMatches matches;
  matches.new_place = answer.new_place;
  const std::uint64_t seed = seed_of(question.features);
  for (const PlaceCandidate& candidate : answer.candidates) {
    PlaceMatch match{candidate.frame, candidate.probability, std::nullopt};
    if (question.camera && matches.places.size() < verify) {
      if (Status status = deadline.check(); !status.ok()) return status;
      auto verified = verify_place(map.graph, {question.features, *question.camera}, candidate.frame, seed);
      if (verified.ok()) match.verified = std::move(verified).value();
    }
    matches.places.push_back(std::move(match));
  }
  return matches;
}

}  // namespace relmap
