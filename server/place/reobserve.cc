#include "server/place/reobserve.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "frontend/vision/motion.h"
#include "frontend/vision/template.h"
#include "server/place/binding_proposal.h"
#include "server/place/map_points.h"
#include "storage/graph/binding.h"
#include "storage/graph/local_graph.h"
#include "storage/graph/observers.h"

namespace relmap::place {
namespace {

constexpr int kMinSearch = 2, kMaxSearch = 8;  // search radius, in pixels of the pyramid level
constexpr float kMinCorrelation = 0.8F;
constexpr double kAgreementSigma = 0.5;   // pixels of the level; alignments agree within three of these
constexpr double kBeside = 0.03;          // of the picture's width: tracks this near a landmark may be superfluous
constexpr double kSameSurfacePixels = 2;  // points this close together have the same disparity
constexpr double kSameDepth = 0.15;       // share of the disparity by which points of one surface may differ

// A landmark as it appears in the picture of an older frame.
struct View {
  LandmarkId landmark;
  Vector3 point;       // in the match's frame
  Matrix3 covariance;  // in the match's frame
  std::shared_ptr<const FramePicture> picture;
  SE3 T_match_frame;
  StereoPixel pixel;
  int level = 0;
};

// A landmark that was measured in the picture of the new frame.
struct Aligned {
  const View* view;
  LandmarkId landmark;
  Vector2 pixel;
  double disparity;  // the predicted one
  int level = 0;
};

// The poses of frames in which landmarks seen around `match` may be based: frames along its session's motion, and those
// that are reached by walking up the graph.
std::unordered_map<FrameId, SE3> poses_round(const storage::Graph& graph, FrameId match) {
  std::unordered_map<FrameId, SE3> T_match_frame;
  for (const PlacedFrame& placed : along_odometry(graph, match, kBindingReach + kBaseReach, kBindingReach))
    T_match_frame.emplace(placed.frame, placed.T_centre_frame);
  storage::LocalGraph local(graph);
  const std::int32_t root = local.frame(match);
  if (root < 0) return T_match_frame;
  const auto& walk = local.walk_up(root);
  const std::vector<SE3> poses = local.poses_up(root);
  for (std::size_t n = 0; n < walk.size(); ++n)
    T_match_frame.emplace(local.frames[static_cast<std::size_t>(walk[n].frame)].id, poses[n]);
  return T_match_frame;
}

// The landmark that the picture shows at exactly the observation's pixel. Invalid if the pixel may lie beside the
// landmark: if the landmark was claimed to be another one, or if the observation is a keypoint's.
LandmarkId shown_by(const storage::Graph& graph, const storage::Observation& z) {
  if (!z.is_tracked() && (!z.aligned || !storage::closure_holds(graph, z.origin))) return {};
  const LandmarkId landmark = storage::resolve(graph, z.landmark);
  return landmark == z.landmark ? landmark : LandmarkId();
}

// For each landmark seen around the match, the view from the frame nearest to the standpoint. Views by tracks are
// preferred to views by alignment, since errors of alignments would add up.
std::vector<View> views_round(const storage::Graph& graph, const Standpoint& standpoint, const StereoCamera& camera,
                              const std::function<std::shared_ptr<const FramePicture>(FrameId)>& picture_of,
                              const std::function<bool(LandmarkId)>& wanted) {
  const std::unordered_map<FrameId, SE3> T_match_frame = poses_round(graph, standpoint.match);
  std::vector<PlacedFrame> frames = along_odometry(graph, standpoint.match, kBindingReach, kBindingReach);
  std::erase_if(frames, [&](const PlacedFrame& placed) { return !well_known(placed) || !picture_of(placed.frame); });
  const auto distance = [&](const PlacedFrame& placed) {
    return (placed.T_centre_frame.t - standpoint.T_match_frame.t).norm();
  };
  std::stable_sort(frames.begin(), frames.end(),
                   [&](const PlacedFrame& l, const PlacedFrame& r) { return distance(l) < distance(r); });
  std::vector<View> views;
  std::unordered_set<LandmarkId> met;
  for (const bool aligned : {false, true})
    for (const PlacedFrame& placed : frames) {
      const auto warm = graph.warm(placed.frame);
      const auto picture = picture_of(placed.frame);
      if (!warm) continue;
      for (const storage::Observation& z : warm->observations) {
        if (z.aligned != aligned) continue;
        const LandmarkId landmark = shown_by(graph, z);
        if (!landmark.valid() || !wanted(landmark)) continue;
        const auto T_match_base = T_match_frame.find(landmark.base);
        const auto base = graph.hot(landmark.base);
        if (T_match_base == T_match_frame.end() || !base || landmark.slot >= base->landmarks.size()) continue;
        const storage::Landmark& estimate = base->landmarks[landmark.slot];
        const Vector3 point = T_match_base->second * estimate.point();
        const Vector3 p = placed.T_centre_frame.inverse() * point;
        if (estimate.depth_prior || !(p.z() > 0) || !met.insert(landmark).second) continue;
        const Matrix3& R = placed.T_centre_frame.R;
        const Matrix3 S = estimate_covariance(camera, p, pixel_sigma(z.level), estimate.observers.size());
        views.push_back({landmark, point, R * S * R.transpose(), picture, placed.T_centre_frame, z.pixel(), z.level});
      }
    }
  return views;
}

// The warp from the new frame's picture to an older one, for a patch at `p` that is parallel to the image plane.
std::optional<vision::Warp> warp_to(const SE3& T_view_frame, const StereoCamera& view, const Vector3& p,
                                    const StereoCamera& camera) {
  constexpr double kStep = 4;  // pixels
  const auto in_view = [&](double du, double dv) -> std::optional<Vector2> {
    const Vector3 q = T_view_frame * (p + Vector3(du, dv, 0) * (p.z() / camera.f));
    if (q.z() < 0.05) return std::nullopt;
    return Vector2(view.project(q).head<2>());
  };
  const auto centre = in_view(0, 0), right = in_view(kStep, 0), below = in_view(0, kStep);
  if (!centre || !right || !below) return std::nullopt;
  const Vector2 x = (*right - *centre) / kStep, y = (*below - *centre) / kStep;
  return vision::Warp{static_cast<float>(x.x()), static_cast<float>(y.x()), static_cast<float>(x.y()),
                      static_cast<float>(y.y())};
}

// The pixel around which the picture is most similar to the patch; nullopt if the patch fits nowhere into the picture.
std::optional<std::pair<int, int>> most_like(const vision::Template& patch, vision::ImageView image, float x, float y,
                                             int reach) {
  const vision::SadPatch sad = patch.sad();
  const int x0 = static_cast<int>(std::lround(x)), y0 = static_cast<int>(std::lround(y));
  int min_difference = std::numeric_limits<int>::max();
  std::optional<std::pair<int, int>> best;
  for (int v = y0 - reach; v <= y0 + reach; ++v)
    for (int u = x0 - reach; u <= x0 + reach; ++u) {
      if (!vision::patch_fits(image, u, v, 1)) continue;
      const int difference = sad.compare(image, u, v);
      if (difference >= min_difference) continue;
      min_difference = difference;
      best = {u, v};
    }
  return best;
}

// The picture of the new frame, and its pose.
struct Look {
  const FramePicture& picture;
  const StereoCamera &camera, &view_camera;
  const SE3 T_frame_match;
  const Matrix6& pose_covariance;

  // A landmark that was searched for, and the result.
  struct Sought {
    Vector2 expected;
    bool as_near;  // seen from about the same distance as before
    std::optional<Aligned> aligned;
  };

  // nullopt if the landmark is out of sight, its position too uncertain, or its patch unusable.
  std::optional<Sought> seek(const View& view) const {
    const FramePicture& shown = *view.picture;
    const auto expected = expect(view.point, view.covariance, camera, T_frame_match, pose_covariance);
    if (!expected) return std::nullopt;
    const int level = std::max({view.level, picture.first, shown.first});
    if (level > std::min(picture.last(), shown.last())) return std::nullopt;
    const double sigma = std::sqrt(expected->covariance.topLeftCorner<2, 2>().diagonal().maxCoeff());
    const int reach = std::max(kMinSearch, static_cast<int>(std::ceil(3 * sigma / pixel_sigma(level))) + 1);
    if (reach > kMaxSearch) return std::nullopt;

    const auto warp =
        warp_to((T_frame_match * view.T_match_frame).inverse(), view_camera, T_frame_match * view.point, camera);
    const auto on_level = [level](double u) { return vision::to_level(static_cast<float>(u), level); };
    const auto anchor = vision::Anchor::take(shown.level(level), on_level(view.pixel.x()), on_level(view.pixel.y()));
    const auto patch = warp && anchor ? vision::Template::from_anchor(*anchor, *warp) : std::nullopt;
    if (!patch) return std::nullopt;
    const double depth = (T_frame_match * view.point).z(), seen_from = (view.T_match_frame.inverse() * view.point).z();
    Sought sought{expected->pixel.head<2>(), depth < kMaxNearer * seen_from && seen_from < kMaxNearer * depth, {}};
    const vision::ImageView image = picture.level(level);
    const auto near = most_like(*patch, image, on_level(expected->pixel.x()), on_level(expected->pixel.y()), reach);
    if (!near) return sought;
    const auto aligned = patch->align(image, static_cast<float>(near->first), static_cast<float>(near->second));
    if (aligned && aligned->correlation >= kMinCorrelation)
      sought.aligned = Aligned{&view,
                               view.landmark,
                               {vision::from_level(aligned->x, level), vision::from_level(aligned->y, level)},
                               expected->pixel.x() - expected->pixel.z(),
                               level};
    return sought;
  }
};

// The landmarks that agree on one pose; empty if they are fewer than kMinAligned.
std::vector<Aligned> agreeing(const std::vector<Aligned>& all, const StereoCamera& camera, const SE3& T_match_frame) {
  std::vector<vision::Correspondence> correspondences;
  for (const Aligned& aligned : all)
    correspondences.push_back({aligned.view->point,
                               {aligned.pixel.x(), aligned.pixel.y(), kNoRight},
                               kAgreementSigma * pixel_sigma(aligned.level),
                               aligned.view->covariance});
  vision::MotionOptions options;
  options.min_inliers = kMinAligned;
  const auto motion = vision::estimate_motion(correspondences, camera, options, &T_match_frame);
  std::vector<Aligned> result;
  if (motion.ok())
    for (const std::uint32_t i : motion->inliers) result.push_back(all[i]);
  return result;
}

bool same_depth(double disparity, double expected) {
  return std::abs(disparity - expected) <= std::max(1.0, kSameDepth * expected);
}

// Whether a track lies so close to an aligned landmark of about the same depth that it is not needed.
bool beside(const storage::Observation& track, const Aligned& aligned, double radius) {
  if ((aligned.pixel - Vector2(track.u_left, track.v)).squaredNorm() > radius * radius) return false;
  return is_mono(track.pixel()) || same_depth(double{track.u_left} - track.u_right, aligned.disparity);
}

// The disparity of the feature nearest to an aligned landmark and of about its depth; NaN if there is none within
// kSameSurfacePixels.
double disparity_at(const Aligned& aligned, std::span<const AppearanceFeature> features) {
  double min_distance = kSameSurfacePixels * kSameSurfacePixels, disparity = kNoRight;
  for (const AppearanceFeature& feature : features) {
    if (!(feature.disparity > 0) || !same_depth(feature.disparity, aligned.disparity)) continue;
    const double distance = (aligned.pixel - Vector2(feature.u, feature.v)).squaredNorm();
    if (distance >= min_distance) continue;
    min_distance = distance;
    disparity = feature.disparity;
  }
  return disparity;
}

}  // namespace

Reobservation reobserve(const storage::Graph& graph, PictureCache& pictures, FrameId frame,
                        std::span<const Standpoint> standpoints, std::uint32_t first_maskable) {
  const auto picture = pictures.find(graph, frame);
  const auto session = graph.session(frame.session);
  const auto warm = graph.warm(frame);
  const auto cold = graph.cold(frame);
  if (!picture || !session || !warm || !cold) return {};
  const StereoCamera& camera = session->header.camera;
  const auto recent = [&](FrameId id) { return id.session == frame.session && id.index >= first_maskable; };

  SeenLandmarks seen = seen_by(graph, frame);
  std::vector<Aligned> found;  // `view` is null: the views do not outlive the loop
  Reobservation result;
  for (const Standpoint& standpoint : standpoints) {
    const auto match_session = graph.session(standpoint.match.session);
    if (!match_session) continue;
    const StereoCamera& view_camera = match_session->header.camera;
    const std::vector<View> views = views_round(
        graph, standpoint, view_camera, [&](FrameId id) { return recent(id) ? nullptr : pictures.find(graph, id); },
        [&](LandmarkId landmark) { return !recent(landmark.base) && !seen.landmarks.contains(landmark); });
    const Look look{*picture, camera, view_camera, standpoint.T_match_frame.inverse(), standpoint.covariance};
    std::vector<Aligned> aligned;
    std::vector<std::pair<LandmarkId, Vector2>> expected;  // landmarks seen from about the same distance as before
    for (const View& view : views) {
      const auto sought = look.seek(view);
      if (sought && sought->as_near) expected.emplace_back(view.landmark, sought->expected);
      if (sought && sought->aligned) aligned.push_back(*sought->aligned);
    }
    const std::vector<Aligned> agreed = agreeing(aligned, camera, standpoint.T_match_frame);
    for (const Aligned& one : agreed) {
      found.push_back({nullptr, one.landmark, one.pixel, one.disparity, one.level});
      seen.landmarks.insert(one.landmark);
    }
    if (&standpoint == &standpoints.front() && !agreed.empty())
      for (const auto& [landmark, pixel] : expected)
        result.sought.push_back({pixel, seen.landmarks.contains(landmark)});
  }

  std::vector<storage::ProposedBinding>& bindings = result.bindings;
  for (const Aligned& aligned : found) {
    storage::ProposedBinding& binding = bindings.emplace_back();
    binding.landmark = aligned.landmark;
    binding.u_left = static_cast<float>(aligned.pixel.x());
    binding.v = static_cast<float>(aligned.pixel.y());
    binding.u_right = static_cast<float>(aligned.pixel.x() - disparity_at(aligned, cold->appearance));
    binding.level = static_cast<std::uint8_t>(aligned.level);
    binding.aligned = true;
  }
  const auto fixed = std::count_if(found.begin(), found.end(), [&](const Aligned& aligned) {
    return storage::is_fixed(graph.hot(aligned.landmark.base)->landmarks[aligned.landmark.slot].observers);
  });
  const double radius = kBeside * camera.width;
  for (std::size_t t = 0; t < warm->observations.size(); ++t) {
    const storage::Observation& track = warm->observations[t];
    if (!track.is_tracked() || !recent(seen.of_track[t].base)) continue;
    if (fixed >= kEnoughFixed ||
        std::any_of(found.begin(), found.end(), [&](const Aligned& aligned) { return beside(track, aligned, radius); }))
      bindings.emplace_back().track = static_cast<std::int32_t>(t);
  }
  return result;
}

}  // namespace relmap::place
