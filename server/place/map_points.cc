#include "server/place/map_points.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>

#include "storage/graph/binding.h"
#include "storage/graph/compounded_chain.h"

namespace relmap::place {
namespace {

constexpr double kMaxWayMetres = 0.3;  // one sigma

constexpr double kMinDisparitySigmas = 2;
constexpr std::size_t kMaxIndependent = 4;  // observations of a landmark
// Diameter (pixels) of the region that is described at level 0: twice SIFT's sigma of 2.5
// (frontend/vision/appearance.h).
constexpr float kLevelZeroScale = 5;

// Walks along a session's odometry, step by step.
class OdometryWalk {
 public:
  OdometryWalk(const storage::Graph& graph, FrameId at, const AcrossCarried& across)
      : graph_(graph), across_(across), placed_{at, {}, Matrix6::Zero(), 0}, hot_(graph.hot(at)) {}

  const PlacedFrame& placed() const { return placed_; }
  const storage::FrameHot* hot() const { return hot_.get(); }

  bool back() {
    const storage::Edge* edge = hot_ ? sensed(*hot_) : nullptr;
    return edge && step(*edge, false);
  }
  bool forward() {
    const auto next = hot_ ? storage::next_in_session(placed_.frame, *hot_) : std::nullopt;
    const auto hot = next ? graph_.hot(*next) : nullptr;
    const storage::Edge* edge = hot ? sensed(*hot) : nullptr;
    return edge && step(*edge, true);
  }

 private:
  static const storage::Edge* sensed(const storage::FrameHot& hot) {
    if (hot.edges.empty() || hot.edges.front().id.ordinal != 0) return nullptr;
    const storage::Edge& edge = hot.edges.front();
    return edge.in_graph() && edge.source != MotionSource::kUnsensed ? &edge : nullptr;
  }

  bool step(const storage::Edge& edge, bool forward) {
    if (edge.carried_by.empty()) {
      placed_.way += edge.T_ab.t.norm();
      return go(edge, forward);
    }
    const std::optional<storage::Edge> stretch = across_ ? across_(edge) : std::nullopt;
    // From a frame within the stretch it is not known how far the robot was carried.
    if (!stretch || (forward ? stretch->a : stretch->b) != placed_.frame) return false;
    return go(*stretch, forward);
  }
  bool go(const storage::Edge& edge, bool forward) {
    chain_.append(edge, forward);
    placed_.frame = forward ? edge.b : edge.a;
    placed_.T_centre_frame = chain_.T();
    placed_.covariance = chain_.covariance();
    hot_ = graph_.hot(placed_.frame);
    return hot_ != nullptr;
  }

  const storage::Graph& graph_;
  const AcrossCarried& across_;
  storage::CompoundedChain chain_;
  PlacedFrame placed_;
  std::shared_ptr<const storage::FrameHot> hot_;
};

// Makes the map points of one frame.
class FramePoints {
 public:
  FramePoints(const storage::Graph& graph, const std::unordered_map<FrameId, SE3>& T_centre_base,
              const PlacedFrame& placed, const StereoCamera& camera)
      : graph_(graph), T_centre_base_(T_centre_base), placed_(placed), camera_(camera) {}

  std::optional<MapPoint> point_of(const AppearanceFeature& feature, const storage::FrameWarm& warm) const {
    MapPoint result;
    result.descriptor = &feature.descriptor;
    const storage::Observation* observation = nullptr;
    if (feature.track >= 0 && static_cast<std::size_t>(feature.track) < warm.observations.size())
      observation = &warm.observations[static_cast<std::size_t>(feature.track)];
    if (observation) {
      result.landmark = storage::resolve(graph_, observation->landmark);
      if (from_landmark(result, observation->level)) return result;
    }
    const StereoPixel z =
        observation ? observation->pixel() : StereoPixel(feature.u, feature.v, double{feature.u} - feature.disparity);
    const double sigma = pixel_sigma(observation ? observation->level : level_of_scale(feature.scale));
    if (is_mono(z) || z.x() - z.z() < kMinDisparitySigmas * sigma) return std::nullopt;
    const Vector3 p = camera_.triangulate(z);
    place(result, p, stereo_covariance(camera_, p, sigma));
    return result;
  }

 private:
  bool from_landmark(MapPoint& result, int level) const {
    const auto base = T_centre_base_.find(result.landmark.base);
    if (base == T_centre_base_.end()) return false;
    const auto hot = graph_.hot(result.landmark.base);
    if (!hot || result.landmark.slot >= hot->landmarks.size()) return false;
    const storage::Landmark& landmark = hot->landmarks[result.landmark.slot];
    if (landmark.depth_prior) return false;
    const Vector3 p = placed_.T_centre_frame.inverse() * (base->second * landmark.point());
    const double sigma = pixel_sigma(level);
    if (!(p.z() > 0) || camera_.f * camera_.baseline / p.z() < kMinDisparitySigmas * sigma) return false;
    place(result, p, estimate_covariance(camera_, p, sigma, landmark.observers.size()));
    return true;
  }

  void place(MapPoint& result, const Vector3& p, const Matrix3& covariance) const {
    const Matrix3& R = placed_.T_centre_frame.R;
    result.point = placed_.T_centre_frame * p;
    result.covariance = R * covariance * R.transpose();
  }

  const storage::Graph& graph_;
  const std::unordered_map<FrameId, SE3>& T_centre_base_;
  const PlacedFrame& placed_;
  const StereoCamera& camera_;
};

// The frames around the centre, without points; no frames if the session is not stereo.
MapPoints place_frames(const storage::Graph& graph, FrameId centre, std::uint32_t reach) {
  MapPoints map;
  const auto session = graph.session(centre.session);
  if (!session || !session->header.camera.is_stereo()) return map;
  std::uint32_t back = 0;
  for (const PlacedFrame& placed : along_odometry(graph, centre, reach + kBaseReach, reach)) {
    map.T_centre_base.emplace(placed.frame, placed.T_centre_frame);
    if (placed.frame.index >= centre.index || ++back <= reach) map.frames.push_back(placed);
  }
  return map;
}

// Adds the points of frames `begin` to `end` of the map.
void add_points(const storage::Graph& graph, std::size_t begin, std::size_t end,
                const std::function<bool(FrameId)>& left_out, MapPoints& map) {
  if (begin >= end) return;
  const auto session = graph.session(map.frames[begin].frame.session);
  for (std::size_t i = begin; session && i < end; ++i) {
    const PlacedFrame& placed = map.frames[i];
    if ((left_out && left_out(placed.frame)) || !well_known(placed)) continue;
    const auto warm = graph.warm(placed.frame);
    auto cold = graph.cold(placed.frame);
    if (!warm || !cold) continue;
    const FramePoints frame(graph, map.T_centre_base, placed, session->header.camera);
    for (std::size_t f = 0; f < cold->appearance.size(); ++f)
      if (auto point = frame.point_of(cold->appearance[f], *warm)) {
        point->placed = static_cast<std::uint32_t>(i);
        point->u = cold->appearance[f].u;
        point->v = cold->appearance[f].v;
        if (f < cold->words.size()) point->word = cold->words[f];
        map.points.push_back(*point);
      }
    map.held.push_back(std::move(cold));
  }
}

}  // namespace

bool well_known(const PlacedFrame& placed) {
  const Vector6 variance = placed.covariance.diagonal();
  return variance.head<3>().sum() <= kMaxWayMetres * kMaxWayMetres &&
         variance.tail<3>().sum() <= kMaxRotationSigma * kMaxRotationSigma;
}

std::vector<PlacedFrame> along_odometry(const storage::Graph& graph, FrameId centre, std::uint32_t back,
                                        std::uint32_t forward, const AcrossCarried& across) {
  OdometryWalk backwards(graph, centre, across), forwards(graph, centre, across);
  if (!backwards.hot()) return {};
  std::vector<PlacedFrame> frames{backwards.placed()};
  for (std::uint32_t step = 0; step < back && backwards.back(); ++step) frames.push_back(backwards.placed());
  for (std::uint32_t step = 0; step < forward && forwards.forward(); ++step) frames.push_back(forwards.placed());
  return frames;
}

std::optional<PlacedFrame> back_along_odometry(const storage::Graph& graph, FrameId centre, FrameId earlier,
                                               const AcrossCarried& across) {
  if (centre.session != earlier.session) return std::nullopt;
  OdometryWalk walk(graph, centre, across);
  while (walk.placed().frame.index > earlier.index)
    if (!walk.back()) return std::nullopt;
  if (walk.placed().frame != earlier) return std::nullopt;
  return walk.placed();
}

std::size_t points_of_centre(const MapPoints& map) {
  return static_cast<std::size_t>(
      std::ranges::find_if(map.points, [](const MapPoint& point) { return point.placed != 0; }) - map.points.begin());
}

MapPoints gather_points(const storage::Graph& graph, FrameId centre, std::uint32_t reach,
                        const std::function<bool(FrameId)>& left_out) {
  MapPoints map = place_frames(graph, centre, reach);
  add_points(graph, 0, map.frames.size(), left_out, map);
  return map;
}

MapPoints gather_centre(const storage::Graph& graph, FrameId centre, std::uint32_t reach) {
  MapPoints map = place_frames(graph, centre, reach);
  add_points(graph, 0, std::min<std::size_t>(map.frames.size(), 1), {}, map);
  return map;
}

void gather_rest(const storage::Graph& graph, MapPoints& map) { add_points(graph, 1, map.frames.size(), {}, map); }

Matrix3 estimate_covariance(const StereoCamera& camera, const Vector3& p, double sigma, std::size_t observers) {
  return stereo_covariance(camera, p, sigma) /
         static_cast<double>(std::clamp<std::size_t>(observers, 1, kMaxIndependent));
}

Matrix3 stereo_covariance(const StereoCamera& camera, const Vector3& p, double sigma) {
  const double disparity = camera.f * camera.baseline / p.z();
  Matrix3 J = Matrix3::Zero();  // d p / d (u_left, v, u_right)
  J.col(0) = -p / disparity;
  J.col(2) = p / disparity;
  J(0, 0) += p.z() / camera.f;
  J(1, 1) = p.z() / camera.f;
  return sigma * sigma * J * J.transpose();
}

int level_of_scale(float scale) {
  if (!(scale > kLevelZeroScale)) return 0;
  return std::clamp(static_cast<int>(std::lround(std::log2(scale / kLevelZeroScale))), 0, kMaxPyramidLevel);
}

}  // namespace relmap::place
