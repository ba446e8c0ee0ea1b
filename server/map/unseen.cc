#include "server/map/unseen.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "proto/base/quantile.h"
#include "server/map/stops.h"
#include "server/place/changes.h"
#include "server/place/map_points.h"

namespace relmap::map {

namespace {

// Steps of the odometry from the closure to the frame, and in the place's session.
constexpr std::uint32_t kReach = 60;
// Two views show nearly the same if they are no further apart than this share of the distance of what is seen, and
// turned by no more than this. From further apart, the same points look different.
constexpr double kMaxParallax = 0.25, kMaxAngle = 0.35;  // radians
// A place of which geometry finds nothing is another one if more cells differ. Of the right place that is seen with too
// few features to be verified, hardly ever more than half of the cells differ (docs/decisions/closures.md).
constexpr float kDiffers = 0.7f;

constexpr std::size_t kMaxStretches = 2;

struct EarlierClosure {
  storage::Edge closure;
  SE3 T_newer_end_frame;
};

// Whether two frames are so near to each other in one session that they belong to one stretch of its way.
bool in_one_stretch(FrameId a, FrameId b) {
  return a.session == b.session && std::max(a.index, b.index) - std::min(a.index, b.index) <= kReach;
}

// The frames that along_odometry() reaches on one way, back or forward, without a stop: beyond one, the robot may have
// been carried elsewhere.
std::vector<place::PlacedFrame> along_odometry_to_stop(const storage::Graph& graph, FrameId centre, std::uint32_t back,
                                                       std::uint32_t forward) {
  std::vector<place::PlacedFrame> way = place::along_odometry(graph, centre, back, forward);
  Standing standing;
  for (std::size_t i = 1; i < way.size(); ++i) {
    const auto newer = graph.hot(std::max(way[i - 1].frame, way[i].frame));
    const storage::Edge* step = storage::motion_to(*newer);
    if (step && !standing.is_stop(*step)) continue;
    way.resize(i);
    break;
  }
  return way;
}

// The last closures in force along the odometry before `frame`, one for each stretch to which they lead, the newest
// first; none of the stretch of `recognised`, and none before a stop.
std::vector<EarlierClosure> earlier_closures(const storage::Graph& graph, FrameId frame, FrameId recognised) {
  std::vector<EarlierClosure> found;
  for (const place::PlacedFrame& placed : along_odometry_to_stop(graph, frame, kReach, 0)) {
    const auto hot = graph.hot(placed.frame);
    for (const storage::Edge& edge : hot->edges) {
      if (edge.kind != storage::EdgeKind::kLoop || edge.state != storage::EdgeState::kAccepted ||
          edge.verification != storage::Verification::kStereo || in_one_stretch(edge.a, recognised))
        continue;
      if (std::ranges::any_of(found, [&](const auto& other) { return in_one_stretch(other.closure.a, edge.a); }))
        continue;
      found.push_back({edge, placed.T_centre_frame.inverse()});
      if (found.size() == kMaxStretches) return found;
    }
  }
  return found;
}

// The median distance of what a stereo picture shows, metres; 0 if no feature has a disparity.
double median_depth(const place::QueryPicture& query) {
  std::vector<double> depths;
  for (const AppearanceFeature& feature : query.features)
    if (feature.disparity > 0) depths.push_back(query.camera.f * query.camera.baseline / double{feature.disparity});
  return depths.empty() ? 0 : upper_median(std::move(depths));
}

// The view of the place's session that is nearest to where the closure puts the query.
std::optional<place::VerifiedPlace> expected_view(const storage::Graph& graph, const place::QueryPicture& query,
                                                  const EarlierClosure& earlier, double max_distance) {
  const SE3 T_older_end_query = earlier.closure.T_ab * earlier.T_newer_end_frame;
  std::optional<place::VerifiedPlace> nearest;
  double min_distance = max_distance;
  const auto find_nearest = [&](const std::vector<place::PlacedFrame>& way) {
    for (const place::PlacedFrame& placed : way) {
      const SE3 T_frame_query = placed.T_centre_frame.inverse() * T_older_end_query;
      if (T_frame_query.t.norm() > min_distance || rotation_angle(T_frame_query.R) > kMaxAngle ||
          !place::may_answer(graph, query, placed.frame))
        continue;
      min_distance = T_frame_query.t.norm();
      nearest.emplace();
      nearest->match = placed.frame;
      nearest->T_match_query = T_frame_query;
    }
  };
  find_nearest(along_odometry_to_stop(graph, earlier.closure.a, kReach, 0));
  find_nearest(along_odometry_to_stop(graph, earlier.closure.a, 0, kReach));
  return nearest;
}

}  // namespace

std::optional<storage::UnseenRecord> find_unseen(const storage::Graph& graph, const place::QueryPicture& query,
                                                 FrameId frame, FrameId recognised, std::uint64_t seed) {
  const double max_distance = kMaxParallax * median_depth(query);
  for (const EarlierClosure& earlier : earlier_closures(graph, frame, recognised)) {
    const auto expected = expected_view(graph, query, earlier, max_distance);
    if (!expected || place::differing_share(graph, query, *expected) < kDiffers) continue;
    const place::PlaceTrial trial = place::try_place(graph, query, expected->match, seed);
    if (!trial.features.empty() || trial.verified.status().reason() == Reason::POOR_SPREAD) continue;
    return storage::UnseenRecord{frame, earlier.closure.id};
  }
  return std::nullopt;
}

}  // namespace relmap::map
