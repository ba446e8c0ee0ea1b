#include "server/place/localise.h"

#include <algorithm>
#include <string>
#include <utility>

#include "proto/base/crc32c.h"
#include "proto/base/number_text.h"
#include "server/place/likeliest.h"
#include "server/place/place_neighbours.h"
#include "server/place/uniqueness.h"
#include "server/route/breadth_first.h"

namespace relmap::place {

namespace {

constexpr std::size_t kVerified = 6;       // candidates of the place index on which geometry is tried
constexpr std::uint32_t kPriorDepth = 12;  // edges around a prior frame
constexpr std::uint32_t kPriorStride = 4;  // edges between candidates, since a verification covers the neighbours too
constexpr std::size_t kPriorCandidates = 8;
constexpr std::uint32_t kSure = 2 * kMinInliers;  // inliers from which no further candidate is tried

// Seeds RANSAC by the picture, so that the same picture gets the same answer.
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

Result<std::vector<PlaceCandidate>> near_prior(const PlaceKnowledge& map, FrameId prior,
                                               std::span<const storage::FrameRange> masked, const Proceed& proceed) {
  const route::WorkLimit work{.max_frames = storage::kTreeFrames, .proceed = [&](std::size_t) { return proceed(); }};
  const auto tree = route::search_breadth_first(
      map.graph, prior, work, [&](const storage::PathTree&, const storage::PathNode& node, const storage::Edge&) {
        return node.depth < kPriorDepth ? route::Visit::kExpand : route::Visit::kLeaf;
      });
  if (!tree.ok()) return tree.status();
  std::vector<PlaceCandidate> candidates;
  for (const storage::PathNode& node : tree->nodes)
    if (node.depth % kPriorStride == 0 && candidates.size() < kPriorCandidates && !storage::within(node.frame, masked))
      candidates.push_back({node.frame, 0});
  return candidates;
}

Status why_nowhere(const storage::Graph& graph, const PlaceAnswer& answer, const Status& geometry) {
  const std::string said = geometry.ok() ? "" : "; geometry: " + geometry.to_string();
  if (geometry.reason() == Reason::NOT_STEREO || geometry.reason() == Reason::NO_CALIBRATION ||
      geometry.reason() == Reason::WRONG_CALIBRATION)
    return geometry;
  if (answer.candidates.empty() || answer.new_place > 0.5)
    return {Reason::NEW_PLACE, "a new place with probability " + number_text(answer.new_place) + said};
  if (const Likeliest found = likeliest(graph, answer.candidates); found.ambiguous())
    return {Reason::AMBIGUOUS_PLACE, "the two best of " + std::to_string(found.places) + " places have probabilities " +
                                         number_text(found.best) + " and " + number_text(found.other) + said};
  return geometry;
}

std::string place_text(const PlaceTrial& trial) {
  return trial.frame.to_string() + " (" + std::to_string(trial.features.size()) + " inliers)";
}

Status ambiguous(std::span<const PlaceTrial> trials, const Standing& standing) {
  return {Reason::AMBIGUOUS_PLACE, place_text(trials[standing.best]) + " and " +
                                       place_text(trials[*standing.runner_up]) + " explain the picture about as well"};
}

// The refusal of a contradicted trial (contradiction()), with what to do about it; ok if there is none.
Status contradiction_of(std::span<const PlaceTrial> trials) {
  const PlaceTrial* trial = contradiction(trials);
  if (!trial) return {};
  const Status& status = trial->verified.status();
  if (status.reason() != Reason::WRONG_CALIBRATION) return status;
  return {status.reason(),
          status.message() +
              "; name the camera that took it, or ask for one picture without a camera: then its lens is estimated"};
}

// Tries geometry on one candidate after another, and knows which of them explains the picture best.
class Search {
 public:
  Search(const PlaceKnowledge& map, const PlaceQuestion& question, const Proceed& proceed)
      : map_(map), trials_(map.graph, question.picture(), seed_of(question.features), proceed) {}

  // Tries candidates until one has kSure inliers. If `proceed` refuses to go on, its status is returned unless a
  // candidate has been confirmed.
  Status run(std::span<const PlaceCandidate> candidates) {
    Status status = trials_.run(candidates, {.sure_inliers = kSure, .needs_metres = true});
    return trials_.best() ? Status() : status;
  }

  // WRONG_CALIBRATION or NOT_STEREO if more features fit at a contradicted place than at any confirmed one.
  Status contradiction() const { return contradiction_of(trials_.all()); }

  // The confirmed place with the most inliers.
  std::optional<Localisation> best() const {
    const auto best = trials_.best();
    if (!best) return std::nullopt;
    return Localisation{*trials_.all()[*best].verified,
                        trials_.candidate(*best).probability,
                        1,
                        false,
                        static_cast<std::uint32_t>(trials_.tried()),
                        trials_.all()[*best].matches};
  }
  // The refusal of the first candidate; NOT_STEREO, if any candidate has that, takes precedence.
  Status refusal() const {
    Status first;
    for (const PlaceTrial& trial : trials_.all())
      if (!trial.verified.ok() && (first.ok() || trial.verified.reason() == Reason::NOT_STEREO))
        first = trial.verified.status();
    return first;
  }

  Status check_not_mirrored(const Localisation& found) const { return trials_.check_not_mirrored(found.place); }

  // AMBIGUOUS_PLACE if a look-alike of the place explains the picture about as well; or what `proceed` returns.
  Status check_unique(const Localisation& found) {
    trials_.keep_confirmed();
    const std::size_t answers = trials_.size();
    const auto alike = look_alikes(map_.graph, map_.places, found.place.match, trials_.query().masked);
    if (Status status = trials_.run(alike, {.max_trials = kVerified, .skip_mono = true}); !status.ok()) return status;
    if (Status status = contradiction(); !status.ok()) return status;
    const auto standing = trials_.weigh(answers);
    return standing && is_ambiguous(standing->uniqueness, found.place.inliers) ? ambiguous(trials_.all(), *standing)
                                                                               : Status();
  }

 private:
  const PlaceKnowledge& map_;
  Trials trials_;
};

// The most probable in metres, before those of mono sessions, which can only tell that there are none.
std::vector<PlaceCandidate> worth_verifying(const PlaceKnowledge& map, const PlaceAnswer& answer,
                                            const PlaceAnswer& metric) {
  std::vector<PlaceCandidate> candidates;
  for (const PlaceCandidate& place : metric.candidates) candidates.push_back({place.frame, place.probability});
  for (const PlaceCandidate& place : answer.candidates)
    if (is_mono_session(map.graph, place.frame.session)) candidates.push_back({place.frame, place.probability});
  if (candidates.size() > kVerified) candidates.resize(kVerified);
  return candidates;
}

// NO_CALIBRATION without a camera: geometry needs the picture's size at least.
Status check_named(const PlaceQuestion& question) {
  if (question.camera) return {};
  return {Reason::NO_CALIBRATION, "geometry needs the camera that took the picture"};
}

// Tries geometry on the candidates and on look-alikes of the best of them, and decides which of the confirmed ones is
// the place.
Result<PlaceMatches> judge(const PlaceKnowledge& map, const PlaceQuestion& question,
                           std::span<const PlaceCandidate> candidates, const Proceed& proceed) {
  Trials trials(map.graph, question.picture(), seed_of(question.features), proceed);
  if (Status status = trials.run(candidates, {}); !status.ok()) return status;
  const std::size_t asked = trials.size();
  PlaceMatches matches;
  if (const Result<VerifiedPlace>& first = trials.all().front().verified; !first.ok())
    matches.nothing_verified = first.status();
  if (const auto best = trials.best()) {
    auto alike = look_alikes(map.graph, map.places, trials.all()[*best].frame, question.masked);
    for (PlaceCandidate& other : alike) other.probability = 0;  // this question's words say nothing of it
    if (Status status = trials.run(alike, {.max_trials = std::max(asked, kVerified)}); !status.ok()) return status;
  }
  const auto standing = trials.weigh(trials.size());
  if (standing) {
    const VerifiedPlace& best = *trials.all()[standing->best].verified;
    matches.nothing_verified = is_ambiguous(standing->uniqueness, best.inliers) ? ambiguous(trials.all(), *standing)
                                                                                : trials.check_not_mirrored(best);
  }
  if (Status status = contradiction_of(trials.all()); !status.ok()) matches.nothing_verified = std::move(status);
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const PlaceTrial& trial = trials.all()[i];
    PlaceMatch match{trials.candidate(i).frame, trials.candidate(i).probability, {}, {}, {}, trial.matches};
    if (!trial.verified.ok()) {
      match.unverified = trial.verified.status();
      if (i >= asked) continue;
    } else if (matches.nothing_verified.ok() && standing->at_best[i]) {
      match.verified = *trial.verified;
    } else {
      match.unverified =
          matches.nothing_verified.ok()
              ? Status(Reason::AMBIGUOUS_PLACE, "more fits at " + place_text(trials.all()[standing->best]))
              : matches.nothing_verified;
      match.doubted = *trial.verified;
    }
    matches.places.push_back(std::move(match));
  }
  return matches;
}

// Lists a frame once to which geometry led from several candidates: as the first of them, with the sum of their
// probabilities, since each of them gives the same answer.
void list_frames_once(std::vector<PlaceMatch>& places) {
  std::vector<PlaceMatch> once;
  for (PlaceMatch& match : places) {
    const auto same =
        std::find_if(once.begin(), once.end(), [&](const PlaceMatch& other) { return other.shown() == match.shown(); });
    if (same == once.end())
      once.push_back(std::move(match));
    else
      same->probability += match.probability;
  }
  places = std::move(once);
}

}  // namespace

Result<Localisation> localise_features(const PlaceKnowledge& map, const PlaceQuestion& question,
                                       const Proceed& proceed) {
  if (Status status = check_named(question); !status.ok()) return status;
  if (Status status = check_question(map, question); !status.ok()) return status;

  Search search(map, question, proceed);
  if (question.prior) {
    const auto near = near_prior(map, *question.prior, question.masked, proceed);
    if (!near.ok()) return near.status();
    if (Status status = search.run(*near); !status.ok()) return status;
    if (auto found = search.best(); found && search.contradiction().ok()) {
      if (Status status = search.check_not_mirrored(*found); !status.ok()) return status;
      found->near_prior = true;
      return *std::move(found);
    }
  }
  const auto words = map.vocabulary.words(question.features);
  const PlaceAnswer answer = map.places.query(words, map.graph, question.masked, {}, question.features);
  const std::vector<PlaceCandidate> candidates = worth_verifying(
      map, answer, metric_answer(answer, map.places, words, map.graph, question.masked, question.features));
  if (Status status = search.run(candidates); !status.ok()) return status;
  if (Status status = search.contradiction(); !status.ok()) return status;
  auto found = search.best();
  if (!found) return why_nowhere(map.graph, answer, search.refusal());
  if (Status status = search.check_not_mirrored(*found); !status.ok()) return status;
  if (Status status = search.check_unique(*found); !status.ok()) return status;
  found->new_place = answer.new_place;
  return *std::move(found);
}

Result<PlaceMatches> match_features(const PlaceKnowledge& map, const PlaceQuestion& question, std::size_t max_verified,
                                    const Proceed& proceed) {
  if (Status status = check_question(map, question); !status.ok()) return status;
  const PlaceAnswer answer = map.places.query(map.vocabulary.words(question.features), map.graph, question.masked,
                                              question.prior, question.features);
  const Status camera = check_named(question);
  const std::size_t tried = camera.ok() ? std::min(max_verified, answer.candidates.size()) : 0;

  PlaceMatches matches;
  matches.new_place = answer.new_place;
  const auto untried = answer.candidates.begin() + static_cast<std::ptrdiff_t>(tried);
  if (tried > 0) {
    auto judged = judge(map, question, std::span(answer.candidates).first(tried), proceed);
    if (!judged.ok()) return judged.status();
    matches.places = std::move(judged->places);
    matches.nothing_verified = std::move(judged->nothing_verified);
  } else {
    matches.nothing_verified = camera;
  }
  for (const PlaceCandidate& candidate : std::span(untried, answer.candidates.end())) {
    const std::string before = "geometry was tried on the " + std::to_string(max_verified) + " before it";
    matches.places.push_back(
        {candidate.frame, candidate.probability, {}, {}, camera.ok() ? Status(Reason::OUT_OF_REACH, before) : camera});
  }
  const auto order = [](const PlaceMatch& match) {
    return match.verified  ? std::pair(0, match.verified->inliers)
           : match.doubted ? std::pair(1, match.doubted->inliers)
                           : std::pair(2, 0U);
  };
  std::stable_sort(matches.places.begin(), matches.places.end(), [&](const PlaceMatch& x, const PlaceMatch& y) {
    const auto [rank_x, inliers_x] = order(x);
    const auto [rank_y, inliers_y] = order(y);
    return rank_x != rank_y ? rank_x < rank_y : inliers_x > inliers_y;
  });
  const bool none = matches.places.empty() || !(matches.places.front().verified || matches.places.front().doubted);
  if (none) matches.nothing_verified = why_nowhere(map.graph, answer, matches.nothing_verified);
  list_frames_once(matches.places);
  return matches;
}

}  // namespace relmap::place
