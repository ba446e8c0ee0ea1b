#include "server/map/lookup.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "server/map/unseen.h"
#include "server/map/way_around.h"
#include "server/place/older_views.h"
#include "server/place/place_neighbours.h"
#include "server/place/reobserve.h"
#include "server/place/same_place.h"
#include "server/place/trials.h"
#include "server/place/uniqueness.h"
#include "server/place/verify.h"
#include "storage/graph/compounded_chain.h"
#include "storage/graph/local_graph.h"

namespace relmap::map {

namespace {

constexpr double kWorthVerifying = 0.05;  // minimum probability of a place
constexpr std::size_t kMaxVerified = 4;   // places per query
constexpr std::size_t kMinBindings = 5;   // fewer are not worth a record

// An older frame that looks the same way from nearly the same position, reached through an accepted closure.
struct OldNeighbour {
  FrameId frame;
  ClosureId closure;
  SE3 T_old_frame;
  Matrix6 covariance;
};

std::optional<OldNeighbour> nearest_old_frame(const storage::Graph& view, FrameId frame, std::uint32_t recent) {
  storage::LocalGraph local(view);
  const std::int32_t root = local.frame(frame);
  if (root < 0) return std::nullopt;
  const auto& walk = local.walk_up(root);
  const auto edge_of = [&](std::size_t n) -> const storage::Edge& {
    return *local.edges[static_cast<std::size_t>(walk[n].edge)].record;
  };
  const std::vector<SE3> T_frame_node = local.poses_up(root);
  const storage::TakenIn own = storage::taken_in(*local.frames[static_cast<std::size_t>(root)].hot);
  std::size_t best = 0;
  double best_distance = place::kMaxViewDistance;
  for (std::size_t n = 1; n < walk.size(); ++n) {
    const FrameId id = local.frames[static_cast<std::size_t>(walk[n].frame)].id;
    if (id.session == frame.session && id.index >= recent) continue;
    if (storage::taken_in(*local.frames[static_cast<std::size_t>(walk[n].frame)].hot) > own) continue;
    const double distance = T_frame_node[n].t.norm();
    if (distance < best_distance && rotation_angle(T_frame_node[n].R) < place::kMaxViewAngle) {
      best = n;
      best_distance = distance;
    }
  }
  if (best == 0) return std::nullopt;

  OldNeighbour old{local.frames[static_cast<std::size_t>(walk[best].frame)].id, {}, {}, Matrix6::Zero()};
  storage::CompoundedChain chain;
  // From the old frame to the new one: T_old_frame = product of the steps node -> parent.
  for (std::size_t n = best; n > 0; n = static_cast<std::size_t>(walk[n].parent)) {
    chain.append(edge_of(n), !walk[n].forward);
    if (edge_of(n).kind == storage::EdgeKind::kLoop) old.closure = edge_of(n).id;
  }
  if (!old.closure.valid()) return std::nullopt;
  old.T_old_frame = chain.T();
  old.covariance = chain.covariance();
  return old;
}

// Binds the frame to the landmarks around an older frame near by that closures in force join to it.
std::optional<storage::BindingRecord> bind_to_older(const storage::Graph& view, place::PictureCache& pictures,
                                                    const place::QueryPicture& query, FrameId frame,
                                                    std::uint32_t recent) {
  const auto old = nearest_old_frame(view, frame, recent);
  if (!old) return std::nullopt;
  const place::Standpoint standpoint{old->frame, old->T_old_frame, old->covariance};
  storage::BindingRecord record{frame, old->closure,
                                place::reobserve(view, pictures, frame, {&standpoint, 1}, recent).bindings};
  if (record.bindings.empty())
    record.bindings =
        place::propose_bindings(view, query, frame, old->frame, old->T_old_frame, old->covariance, recent);
  if (record.bindings.size() < kMinBindings) return std::nullopt;
  return record;
}

std::optional<FrameId> step_back(const storage::Graph& graph, FrameId frame, const storage::FrameHot& hot) {
  if (const storage::Edge* motion = motion_to(hot)) return motion->a;
  if (place::is_mono_session(graph, frame.session)) return place::previous_of(graph, frame);
  return std::nullopt;
}

// Whether the verification with the older view, or a frame next to it, places the query about where the map has it.
bool stands_at(const storage::Graph& view, const place::OlderView& older, const place::VerifiedPlace& found) {
  const auto T_older_match = place::way_beside(view, older.frame, found.match, place::kViewReach);
  return T_older_match && place::says_the_same(older.T_frame_query.inverse() * *T_older_match * found.T_match_query);
}

// Appends those of `more` whose track and landmark `bindings` does not contain yet.
void add_new(std::vector<storage::ProposedBinding>& bindings, const std::vector<storage::ProposedBinding>& more) {
  for (const storage::ProposedBinding& candidate : more) {
    const bool known = std::any_of(bindings.begin(), bindings.end(), [&](const storage::ProposedBinding& b) {
      return b.landmark == candidate.landmark || (b.track >= 0 && b.track == candidate.track);
    });
    if (!known) bindings.push_back(candidate);
  }
}

std::uint64_t ransac_seed(const storage::Graph& view, FrameId frame) {
  std::uint64_t words[2];
  std::memcpy(words, view.session(frame.session)->header.uuid.bytes.data(), sizeof words);
  return words[0] ^ (words[1] + 0x9e3779b97f4a7c15ULL * (frame.index + 1));
}

}  // namespace

place::PlaceTrial try_frame(const storage::Graph& view, const place::QueryPicture& query, FrameId frame,
                            FrameId match) {
  return place::try_place(view, query, match, ransac_seed(view, frame));
}

Result<place::VerifiedPlace> verify_frame(const storage::Graph& view, const place::QueryPicture& query, FrameId frame,
                                          FrameId match) {
  return try_frame(view, query, frame, match).verified;
}

storage::ClosureProposalRecord proposal_of(const storage::Graph& view, place::PictureCache& pictures,
                                           const place::QueryPicture& query, FrameId frame, place::VerifiedPlace found,
                                           const storage::Uniqueness& uniqueness, std::uint32_t recent) {
  const auto is_recent = [&](FrameId other) { return other.session == frame.session && other.index >= recent; };
  const std::vector<storage::ProposedBinding> seen_there = found.bindings;
  std::vector<place::Standpoint> standpoints{{found.match, found.T_match_query, found.covariance}};
  for (const place::OlderView& older : place::older_views(view, found.match, found.T_match_query, is_recent))
    if (auto there = verify_frame(view, query, frame, older.frame); there.ok() && stands_at(view, older, *there)) {
      found = std::move(*there);
      standpoints.push_back({found.match, found.T_match_query, found.covariance});
      break;
    }
  storage::ClosureProposalRecord proposal;
  proposal.query = frame;
  proposal.match = found.match;
  proposal.T_match_query = found.T_match_query;
  proposal.covariance = found.covariance;
  proposal.verification = found.verification;
  proposal.inliers = static_cast<std::uint16_t>(std::min<std::uint32_t>(found.inliers, 0xffff));
  proposal.spread = static_cast<float>(found.spread);
  place::Reobservation again = place::reobserve(view, pictures, frame, standpoints, recent);
  proposal.uniqueness = uniqueness;
  if (uniqueness.known) {
    // Changes are counted against the pass that the closure is made with, which may be an older one.
    const place::Standpoint& older = standpoints.back();
    const place::Changes there = place::changes(
        standpoints.size() == 1 ? again.sought : place::reobserve(view, pictures, frame, {&older, 1}, recent).sought,
        query.camera);
    proposal.uniqueness.compared = there.compared;
    proposal.uniqueness.changed = there.changed;
  }
  proposal.bindings = std::move(again.bindings);
  const bool aligned = !proposal.bindings.empty();
  add_new(proposal.bindings, found.bindings);
  add_new(proposal.bindings, seen_there);  // what only later passes have seen
  if (!aligned)
    add_new(proposal.bindings,
            place::propose_bindings(view, query, frame, found.match, found.T_match_query, found.covariance, recent));
  return proposal;
}

std::uint32_t first_recent(const storage::Graph& graph, FrameId query) {
  FrameId frame = query;
  std::int64_t time_us = graph.hot(query)->time_us, driving_us = 0;
  for (std::uint32_t edges = 0, driven = 0; edges <= kMaxRecentEdges; ++edges) {
    const auto hot = graph.hot(frame);
    driving_us += time_us - hot->time_us;
    time_us = hot->time_us;
    if (driven > kRecentEdges && driving_us > kRecentMicroseconds) return frame.index + 1;
    const auto previous = step_back(graph, frame, *hot);
    if (!previous) return frame.index;
    const storage::Edge* motion = motion_to(*hot);
    const bool stands = motion && stood(*motion);
    driven += !stands;
    if (stands) time_us = graph.hot(*previous)->time_us;
    frame = *previous;
  }
  return frame.index + 1;
}

storage::FrameRange recent_past(const storage::Graph& graph, FrameId query) {
  return {query.session, first_recent(graph, query), std::numeric_limits<std::uint32_t>::max()};
}

Lookup look_up(const storage::Graph& view, const place::PlaceIndex& places, place::PictureCache& pictures,
               FrameId frame, const LaterFrames& later, const RouteMap& newest) {
  const auto cold = view.cold(frame);
  if (!cold || cold->words.empty()) return {};
  const storage::Session session = *view.session(frame.session);
  if (!session.header.camera.is_stereo()) return {};
  const storage::FrameRange own_past = recent_past(view, frame);
  const std::uint32_t recent = own_past.first;
  const auto not_asked = [&] {
    std::vector<storage::FrameRange> ranges = later ? later() : std::vector<storage::FrameRange>();
    ranges.push_back(own_past);
    return ranges;
  };
  const std::vector<storage::FrameRange> masked = not_asked();
  place::PlaceAnswer answer = place::metric_answer(places.query(cold->words, view, masked, {}, cold->appearance),
                                                   places, cold->words, view, masked, cold->appearance);
  place::QueryPicture query = place::query_of(*cold, session.header.camera);
  query.masked = masked;
  query.taken_in = storage::taken_in(*view.hot(frame));
  const auto drop_later = [&](std::vector<place::PlaceCandidate>& candidates) {
    std::erase_if(candidates, [&](const place::PlaceCandidate& candidate) {
      return !place::may_answer(view, query, candidate.frame);
    });
  };
  drop_later(answer.candidates);
  const place::Proceed proceed = [] { return Status(); };
  place::Trials trials(view, query, ransac_seed(view, frame), proceed);
  // A mono session is a place, but gives no transform.
  place::TrialLimits limits{.max_trials = kMaxVerified, .min_probability = kWorthVerifying, .skip_mono = true};
  (void)trials.run(answer.candidates, limits);
  const std::size_t answers = trials.size();
  // Also tries places that look like the best one: they are no answer, but tell whether the best one is unique.
  if (const auto best = trials.best()) {
    limits.min_probability = 0;
    std::vector<place::PlaceCandidate> alike = place::look_alikes(view, places, trials.all()[*best].frame, masked);
    drop_later(alike);
    (void)trials.run(alike, limits);
  }
  if (const place::PlaceTrial* trial = place::contradiction(std::span(trials.all()).first(answers)))
    return {{}, CameraContradiction{trial->frame.session, trial->verified.status()}};
  auto standing = trials.weigh(answers, [&](const place::VerifiedPlace& place) {
    const place::Standpoint standpoint{place.match, place.T_match_query, place.covariance};
    return place::changes(place::reobserve(view, pictures, frame, {&standpoint, 1}, recent).sought, query.camera);
  });
  if (standing) {
    const auto probability_of = [&](std::size_t trial) {
      for (const place::PlaceCandidate& candidate : answer.candidates)
        if (candidate.frame == trials.candidate(trial).frame) return static_cast<float>(candidate.probability);
      return 0.0F;
    };
    if (standing->runner_up) standing->uniqueness.runner_up_probability = probability_of(*standing->runner_up);
    storage::ClosureProposalRecord proposal =
        proposal_of(view, pictures, query, frame, *trials.all()[standing->best].verified, standing->uniqueness, recent);
    proposal.probability = probability_of(standing->best);
    if (const auto unseen = find_unseen(view, query, frame, proposal.match, ransac_seed(view, frame)))
      proposal.unseen = unseen->closure;
    proposal.around = way_around(view, proposal, newest);
    return {{std::move(proposal)}, {}};
  }

  if (auto bound = bind_to_older(view, pictures, query, frame, recent)) return {{*std::move(bound)}, {}};
  if (const auto unseen = find_unseen(view, query, frame, {}, ransac_seed(view, frame))) return {{*unseen}, {}};
  return {};
}

}  // namespace relmap::map
