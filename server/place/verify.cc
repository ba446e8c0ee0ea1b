#include "server/place/verify.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "frontend/vision/focal_length.h"
#include "server/place/binding_proposal.h"
#include "server/place/descriptor_match.h"
#include "server/place/epipolar.h"
#include "server/place/map_points.h"
#include "server/place/place_neighbours.h"
#include "server/place/spread.h"

namespace relmap {
namespace {

constexpr double kNearRadius = 0.02;  // of the picture's width
constexpr double kOutOfSight = -1e9;

// The points of one frame share the error of the way to it. A pose that is a mean over frames with weights w has at
// most the covariance sum w S.
Matrix6 covariance_of_way(const MapPoints& map, const std::vector<std::uint32_t>& placed, const SE3& T_match_query) {
  const double inliers = std::accumulate(placed.begin(), placed.end(), 0.0);
  std::vector<double> weight;
  for (const std::uint32_t count : placed) weight.push_back(count / inliers);
  Matrix6 sum = Matrix6::Zero();
  for (std::size_t i = 0; i < weight.size(); ++i) {
    if (weight[i] == 0) continue;
    // T_match_n Exp(xi) T_n_query = T_match_query Exp(Ad(T_query_n) xi)
    const Matrix6 ad = (T_match_query.inverse() * map.frames[i].T_centre_frame).adjoint();
    sum += weight[i] * ad * map.frames[i].covariance * ad.transpose();
  }
  return sum;
}

Result<VerifiedPlace> verify_view(const Graph& graph, const QueryPicture& query, FrameId candidate) {
  const auto cold = graph.cold(candidate);
  if (!cold) return Status(Reason::NO_SUCH_FRAME, candidate.to_string());
  const Result<EpipolarMatch> match = match_views(query.features, cold->appearance);
  if (!match.ok()) return match.status();
  const double spread = picture_spread(query.features, match->inliers, query.camera);
  if (spread < kMinSpread)
    return Status(Reason::POOR_SPREAD, std::to_string(match->inliers.size()) + " inliers cover " +
                                           std::to_string(spread) + " of the picture");
  VerifiedPlace place;
  place.match = candidate;
  place.covariance = Matrix6::Identity() * 1e6;
  place.verification = Verification::kEpipolar;
  place.homography = match->homography;
  place.inliers = static_cast<std::uint32_t>(match->inliers.size());
  place.spread = spread;
  place.focal_length = query.camera.f;
  return place;
}

// The views beside the candidate show the same place, one of them perhaps from nearer to where the query was taken.
Result<VerifiedPlace> verify_epipolar(const Graph& graph, const QueryPicture& query, FrameId candidate) {
  auto place = verify_view(graph, query, candidate);
  if (place.ok() || place.reason() == Reason::NO_SUCH_FRAME) return place;
  for (const auto& beside : {previous_of(graph, candidate), next_of(graph, candidate)})
    if (beside && !within(*beside, query.masked))
      if (auto there = verify_view(graph, query, *beside); there.ok()) return there;
  return place;
}

// How many inliers each frame of `map` placed.
std::vector<std::uint32_t> placed_by_frame(const MapPoints& map, std::span<const DescriptorMatch> inliers) {
  std::vector<std::uint32_t> placed(map.frames.size());
  for (const DescriptorMatch& match : inliers) ++placed[map.points[match.point].placed];
  return placed;
}

std::vector<Correspondence> correspond(const QueryPicture& query, const MapPoints& map,
                                       std::span<const DescriptorMatch> matches) {
  std::vector<Correspondence> correspondences;
  for (const DescriptorMatch& match : matches) {
    const AppearanceFeature& feature = query.features[match.feature];
    const MapPoint& point = map.points[match.point];
    correspondences.push_back(
        {point.point, pixel_of(feature, query.camera), pixel_sigma(level_of_scale(feature.scale)), point.covariance});
  }
  return correspondences;
}

// Matches among what lies near each other seen from the pose: in so small a part of the picture few look alike.
std::vector<DescriptorMatch> match_near(const QueryPicture& query, const MapPoints& map, const SE3& T_match_query) {
  const SE3 T_query_match = T_match_query.inverse();
  std::vector<Vector2> expected;
  for (const MapPoint& point : map.points) {
    const Vector3 p = T_query_match * point.point;
    expected.push_back(p.z() > 0 ? query.camera.project(p).head<2>() : Vector2(Vector2::Constant(kOutOfSight)));
  }
  const double radius = kNearRadius * query.camera.width;
  return match_points(query.features, map.points, [&](std::uint32_t f, std::uint32_t p) {
    const Vector2 seen(query.features[f].u, query.features[f].v);
    return (seen - expected[p]).squaredNorm() < radius * radius;
  });
}

// The pose of the query, and its focal length where that is not known.
Result<MotionAndFocalLength> estimate_pose(const std::vector<Correspondence>& correspondences,
                                           const StereoCamera& camera, const MotionOptions& options) {
  if (camera.f == 0) return estimate_motion_and_focal_length(correspondences, camera, options);
  auto motion = estimate_motion(correspondences, camera, options);
  if (!motion.ok()) return motion.status();
  return MotionAndFocalLength{std::move(*motion), camera.f, 0};
}

struct StereoPlace {
  VerifiedPlace place;
  FrameId nearest;  // placed most of the inliers
};

Result<StereoPlace> verify_stereo(const Graph& graph, const QueryPicture& query, FrameId candidate,
                                  std::uint64_t seed) {
  const MapPoints map = gather_points(graph, candidate, kViewReach);
  if (map.points.size() < static_cast<std::size_t>(kMinInliers))
    return Status(Reason::TOO_FEW_FEATURES, std::to_string(map.points.size()) + " points in the map");
  std::vector<DescriptorMatch> matches = match_points(query.features, map.points);
  std::vector<Correspondence> correspondences = correspond(query, map, matches);
  MotionOptions options;
  options.seed = seed;
  options.max_trials = 1000;
  options.min_inliers = kMinInliers;
  auto pose = estimate_pose(correspondences, query.camera, options);
  if (!pose.ok()) return pose.status();
  // Where the pose is found more of what was seen can be told apart; where chance agreed there is no more.
  if (query.camera.f > 0) {
    auto near = match_near(query, map, pose->motion.T_reference_camera);
    auto closer = correspond(query, map, near);
    auto motion = estimate_motion(closer, query.camera, options, &pose->motion.T_reference_camera);
    if (motion.ok() && motion->inliers.size() > pose->motion.inliers.size()) {
      pose->motion = std::move(*motion);
      matches = std::move(near);
      correspondences = std::move(closer);
    }
  }
  const Motion& motion = pose->motion;

  VerifiedPlace place;
  place.match = candidate;
  place.focal_length = pose->f;
  place.T_match_query = motion.T_reference_camera;
  place.inliers = static_cast<std::uint32_t>(motion.inliers.size());
  std::vector<DescriptorMatch> inliers;
  std::vector<std::uint32_t> features;
  std::size_t with_disparity = 0;
  for (const std::uint32_t i : motion.inliers) {
    inliers.push_back(matches[i]);
    features.push_back(matches[i].feature);
    with_disparity += !is_mono(correspondences[i].pixel);
  }
  place.spread = picture_spread(query.features, features, query.camera);
  if (place.spread < kMinSpread)
    return Status(Reason::POOR_SPREAD,
                  std::to_string(place.inliers) + " inliers cover " + std::to_string(place.spread) + " of the picture");
  const std::vector<std::uint32_t> placed = placed_by_frame(map, inliers);
  place.covariance = motion.covariance + covariance_of_way(map, placed, place.T_match_query);
  place.verification = with_disparity > 0 ? Verification::kStereo : Verification::kPnP;
  for (const DescriptorMatch& match : inliers)
    if (const LandmarkId landmark = map.points[match.point].landmark; landmark.valid())
      place.bindings.push_back(binding_to(landmark, query.features[match.feature], query.camera));
  const auto most = static_cast<std::size_t>(std::max_element(placed.begin(), placed.end()) - placed.begin());
  return StereoPlace{std::move(place), map.frames[most].frame};
}

}  // namespace

Result<VerifiedPlace> verify_place(const Graph& graph, const QueryPicture& query, FrameId candidate,
                                   std::uint64_t seed) {
  const auto session = graph.session(candidate.session);
  if (!session || !graph.hot(candidate)) return Status(Reason::NO_SUCH_FRAME, candidate.to_string());
  if (query.features.size() < static_cast<std::size_t>(kMinInliers))
    return Status(Reason::TOO_FEW_FEATURES, std::to_string(query.features.size()) + " features");
  if (!session->header.camera.is_stereo()) return verify_epipolar(graph, query, candidate);

  auto found = verify_stereo(graph, query, candidate, seed);
  if (!found.ok()) return found.status();
  // What was seen from another frame is told from there: the way between the two may be badly known, or wrong.
  if (found->nearest != candidate && !within(found->nearest, query.masked))
    if (auto nearer = verify_stereo(graph, query, found->nearest, seed); nearer.ok()) return std::move(nearer->place);
  return std::move(found->place);
}

}  // namespace relmap
