#include "server/map/propose.h"

#include <algorithm>
#include <utility>

#include "proto/base/number_text.h"
#include "proto/geometry/camera.h"
#include "server/map/closures.h"
#include "server/map/lookup.h"
#include "server/map/way_around.h"
#include "server/place/place_neighbours.h"

namespace relmap::map {

namespace {

// A frame as a query.
struct Seen {
  FrameId frame;
  std::shared_ptr<const storage::FrameCold> cold;
  storage::FrameRange own_past;
  place::QueryPicture picture;

  Seen(const storage::Graph& view, FrameId id)
      : frame(id),
        cold(view.cold(id)),
        own_past(recent_past(view, id)),
        picture{cold->appearance, view.session(id.session)->header.camera, {&own_past, 1}} {}
  Seen(const Seen&) = delete;
  Seen& operator=(const Seen&) = delete;
};

Status check_end(const storage::Graph& view, FrameId frame) {
  if (!view.hot(frame) || !view.cold(frame)) return {Reason::NO_SUCH_FRAME, "no frame " + frame.to_string()};
  const storage::Session session = *view.session(frame.session);
  if (storage::is_going(session))
    return {Reason::SESSION_DELETED,
            frame.to_string() + " belongs to session " + session.display_name + ", which is being deleted"};
  if (!session.header.camera.is_stereo())
    return {Reason::NOT_STEREO, frame.to_string() + " was seen by a single camera, which measures no metres"};
  if (session.header.camera == kNoCamera)
    return {Reason::NO_CALIBRATION, "session " + session.display_name + " was imported without a camera"};
  return {};
}

Status check_not_there(const storage::Graph& view, FrameId query, FrameId match) {
  const auto known = closure_between(view, query, match);
  if (!known) return {};
  return {Reason::WRONG_STATE, "closure " + known->id.to_string() + " is between " + match.to_string() + " and " +
                                   query.to_string() + " already: " + std::string(reason_name(known->reason))};
}

Status too_recent(const storage::Graph& view, FrameId query, FrameId match) {
  const double apart = 1e-6 * static_cast<double>(view.hot(query)->time_us - view.hot(match)->time_us);
  return {Reason::INVALID_ARGUMENT,
          match.to_string() + " was seen " + fixed(apart, 1) + " s before " + query.to_string() +
              " in one drive: within " + std::to_string(kRecentEdges) + " odometry edges, or within " +
              std::to_string(kRecentMicroseconds / 1'000'000) + " s and " + std::to_string(kMaxRecentEdges) +
              " edges, its own motion says how far they are apart, and no geometry was tried"};
}

// Probability by appearance of the place that contains `match`; 0 if it is not among the candidates.
double probability_of(const storage::Graph& view, const place::PlaceIndex& places, const Seen& query, FrameId match) {
  for (const place::PlaceCandidate& place :
       places.query(query.cold->words, view, query.picture.masked, {}, query.cold->appearance).candidates) {
    const std::vector<FrameId> around = place::place_neighbours(view, place.frame, place::kPlaceRadius);
    if (std::find(around.begin(), around.end(), match) != around.end()) return place.probability;
  }
  return 0;
}

place::VerifiedPlace turned_round(place::VerifiedPlace found, FrameId match) {
  found.match = match;
  found.covariance = inverse_covariance(found.T_match_query, found.covariance);
  found.T_match_query = found.T_match_query.inverse();
  found.bindings.clear();  // they belong to the other frame
  return found;
}

class Proposer {
 public:
  Proposer(const storage::Graph& view, const place::PlaceIndex& places, place::PictureCache& pictures)
      : view_(view), places_(places), pictures_(pictures) {}

  // A closure is stored with the newer of its frames, whichever of them was the query of the verification.
  Result<storage::ClosureProposalRecord> enter(const Seen& query, place::VerifiedPlace found) {
    if (taken_in_before(view_, found.match, query.frame)) return enter_newer(query, std::move(found));
    const Seen newer(view_, found.match);
    return enter_newer(newer, turned_round(std::move(found), query.frame));
  }

 private:
  Result<storage::ClosureProposalRecord> enter_newer(const Seen& query, place::VerifiedPlace found) {
    storage::ClosureProposalRecord proposal =
        proposal_of(view_, pictures_, query.picture, query.frame, std::move(found), {}, query.own_past.first);
    if (Status status = check_not_there(view_, proposal.query, proposal.match); !status.ok()) return status;
    proposal.probability = static_cast<float>(probability_of(view_, places_, query, proposal.match));
    proposal.around = way_around(view_, proposal);
    return proposal;
  }

  const storage::Graph& view_;
  const place::PlaceIndex& places_;
  place::PictureCache& pictures_;
};

}  // namespace

std::optional<storage::Edge> closure_between(const storage::Graph& graph, FrameId query, FrameId match) {
  if (const auto hot = graph.hot(query))
    for (const storage::Edge& edge : hot->edges)
      if (edge.kind == storage::EdgeKind::kLoop && edge.a == match) return edge;
  return std::nullopt;
}

Result<storage::ClosureProposalRecord> propose_closure(const storage::Graph& view, const place::PlaceIndex& places,
                                                       place::PictureCache& pictures, FrameId a, FrameId b) {
  for (const FrameId end : {a, b})
    if (Status status = check_end(view, end); !status.ok()) return status;
  const auto [match, query] = taken_in_before(view, b, a) ? std::pair(b, a) : std::pair(a, b);
  if (match == query)
    return {Reason::INVALID_ARGUMENT, "a closure is between two frames, and both are " + match.to_string()};
  const Seen newer(view, query);
  if (newer.own_past.contains(match)) return too_recent(view, query, match);
  if (Status status = check_not_there(view, query, match); !status.ok()) return status;

  Proposer proposer(view, places, pictures);
  auto found = verify_frame(view, newer.picture, query, match);
  if (found.ok()) return proposer.enter(newer, std::move(found).value());
  const Seen older(view, match);
  // No mask: frames around the newer one are not in the older one's past.
  const place::QueryPicture unmasked{older.picture.features, older.picture.camera, {}};
  auto reverse = verify_frame(view, unmasked, match, query);
  if (reverse.ok()) return proposer.enter(older, std::move(reverse).value());
  return {found.reason(), query.to_string() + " at " + match.to_string() + ": " + found.status().message() + "; " +
                              match.to_string() + " at " + query.to_string() + ": " + reverse.status().to_string()};
}

}  // namespace relmap::map
