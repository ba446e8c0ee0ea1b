#include "tools/bench/planted_closures.h"

#include <algorithm>
#include <memory>
#include <optional>

#include "server/map/closures.h"
#include "server/map/edge_edit.h"
#include "server/map/propose.h"
#include "server/place/map_points.h"
#include "server/place/verify.h"

namespace relmap::bench {

namespace {

constexpr std::uint32_t kMinFrames = 40;  // between the ends, in the session
constexpr int kTries = 2000;

}  // namespace

std::vector<storage::Edge> Planter::donors(const storage::Graph& graph) const {
  std::vector<storage::Edge> found;
  for (const storage::Session& session : graph.sessions())
    for (std::uint32_t i = 0; i <= session.last; ++i) {
      const auto hot = graph.hot({session.number, i});
      for (const storage::Edge& edge : hot ? hot->edges : std::vector<storage::Edge>{})
        if (edge.kind == storage::EdgeKind::kLoop && edge.state == storage::EdgeState::kAccepted &&
            std::find(planted_.begin(), planted_.end(), edge.id) == planted_.end())
          found.push_back(edge);
    }
  return found;
}

FrameId Planter::some_frame(const storage::Graph& graph, std::uint32_t before_end) {
  const std::vector<storage::Session> sessions = graph.sessions();
  const storage::Session& session = sessions[random_.bits() % sessions.size()];
  const std::uint32_t last = session.last > before_end ? session.last - before_end : 0;
  return {session.number, static_cast<std::uint32_t>(random_.bits() % (last + 1))};
}

std::optional<Planter::Site> Planter::site(const storage::Graph& graph, std::uint32_t length) {
  for (int i = 0; i < kTries; ++i) {
    Site site{some_frame(graph, length), some_frame(graph, length)};
    if (site.a == site.b) continue;
    if (map::taken_in_before(graph, site.b, site.a)) std::swap(site.a, site.b);
    if (site.a.session == site.b.session && site.b.index - site.a.index < kMinFrames) continue;
    const auto at_a = ground_.where(site.a), at_b = ground_.where(site.b);
    if (at_a && at_b && (*at_a - *at_b).norm() > apart_ && !map::closure_between(graph, site.b, site.a)) return site;
  }
  return std::nullopt;
}

bool Planter::plant(const Site& site, const storage::Edge& donor, const SE3& T_ab) {
  storage::ClosureProposalRecord proposal;
  proposal.query = site.b;
  proposal.match = site.a;
  proposal.T_match_query = T_ab;
  proposal.covariance = donor.prior_covariance;
  proposal.verification = donor.verification;
  proposal.inliers = donor.inliers;
  proposal.probability = donor.probability;
  proposal.spread = donor.spread;
  proposal.uniqueness = donor.uniqueness;
  ground_.apply(proposal);
  const auto closure = map::closure_between(*ground_.graph(), site.b, site.a);
  if (!closure) return false;
  if (closure->state != storage::EdgeState::kAccepted) {
    const auto accept = map::edit_record(closure->id, map::EdgeAction::kAccept, "looks right");
    if (!map::check_edge_edit(*ground_.graph(), accept).ok()) return false;
    ground_.apply(accept);
  }
  planted_.push_back(closure->id);
  return true;
}

void Planter::plant(std::uint32_t length) {
  const auto graph = ground_.graph();
  const std::vector<storage::Edge> true_ones = donors(*graph);
  const auto first = site(*graph, 2 * length);
  if (true_ones.empty() || !first) return;
  SE3 T_ab;
  for (std::uint32_t k = 0; k < length; ++k) {
    const storage::Edge& donor = true_ones[random_.bits() % true_ones.size()];
    if (k == 0) T_ab = donor.prior_T_ab;
    const Site next{{first->a.session, first->a.index + 2 * k}, {first->b.session, first->b.index + 2 * k}};
    const auto along_a = place::along_odometry(*graph, first->a, 0, 2 * k);
    const auto along_b = place::along_odometry(*graph, first->b, 0, 2 * k);
    if (along_a.back().frame != next.a || along_b.back().frame != next.b) return;
    // The stretches are alike: the second closure says the same of the two as the first.
    const SE3 T = along_a.back().T_centre_frame.inverse() * T_ab * along_b.back().T_centre_frame;
    if (!plant(next, donor, T.normalized())) return;
  }
}

}  // namespace relmap::bench
