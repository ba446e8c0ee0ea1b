// What the map knows round a frame: points with descriptors, in that frame's coordinates.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "proto/geometry/camera.h"
#include "server/place/descriptor.h"
#include "storage/graph/graph.h"

namespace relmap::place {

// A frame reached along its session's odometry.
struct PlacedFrame {
  FrameId frame;
  SE3 T_centre_frame;
  Matrix6 covariance = Matrix6::Zero();  // of T_centre_frame Exp(xi)
  double way = 0;                        // metres, along the odometry
};

// What is known worse than this tells no place: of the way to a frame, and of a pose; radians, one sigma of all axes.
inline constexpr double kMaxRotationSigma = 0.1;

// Whether the way to it is known to 0.3 m and 0.1 rad. Else its points say more of the way than of the place, and a
// closure made with them would agree with any other.
bool well_known(const PlacedFrame& placed);

// How to go on where the robot was carried (Edge::carried_by): given an edge of such a stretch, an edge from its first
// frame to its last; nullopt: not at all. By default odometry ends there, as it does at motion that nothing sensed.
using AcrossCarried = std::function<std::optional<storage::Edge>(const storage::Edge& step)>;

// Frames up to `back` steps before and `forward` after the centre, each way nearest first, the centre itself at the
// front. Loop edges are not followed: what is found beyond one would confirm that very closure. Nor is motion that
// nothing sensed. Frames within a stretch that is gone across are left out. Empty: there is no such frame.
std::vector<PlacedFrame> along_odometry(const storage::Graph& graph, FrameId centre, std::uint32_t back,
                                        std::uint32_t forward, const AcrossCarried& across = {});

// An earlier frame of the session, however far back; nothing where the way to it was not sensed.
std::optional<PlacedFrame> back_along_odometry(const storage::Graph& graph, FrameId centre, FrameId earlier,
                                               const AcrossCarried& across = {});

struct MapPoint {
  Vector3 point;                           // in the centre's frame
  Matrix3 covariance;                      // there; of the point's own measurement, not of the way to the frame
  LandmarkId landmark;                     // in force; invalid: a feature with a disparity that means none
  const Descriptor* descriptor = nullptr;  // held by MapPoints
  std::uint32_t placed = 0;                // index into MapPoints::frames
};

struct MapPoints {
  std::vector<PlacedFrame> frames;
  std::vector<MapPoint> points;
  std::vector<std::shared_ptr<const storage::FrameCold>> held;  // keeps the descriptors
};

// Points seen in the frames up to `reach` steps before and after the centre. Where a feature's landmark has its base
// near by, the point is the landmark's estimate, otherwise it comes from the feature's own disparity. Points under 2
// sigmas of disparity are left out: their depth has no Gaussian error. Not looked at: `left_out(frame)`,
// and frames the way to which is not known to 0.3 m and 0.1 rad.
MapPoints gather_points(const storage::Graph& graph, FrameId centre, std::uint32_t reach,
                        const std::function<bool(FrameId)>& left_out = {});

// Bases of landmarks are looked for this many steps further back than their observers.
inline constexpr std::uint32_t kBaseReach = 15;

// Covariance of a landmark's estimate at `p`, seen by so many frames, each coordinate measured with `sigma` pixels. Few
// of its measurements count as independent: they share the poses of their frames.
Matrix3 estimate_covariance(const StereoCamera& camera, const Vector3& p, double sigma, std::size_t observers);

// Covariance of camera.triangulate(z) at `p`, each coordinate of z independent with `sigma` pixels.
Matrix3 stereo_covariance(const StereoCamera& camera, const Vector3& p, double sigma);

// The pyramid level at which a tracked feature of this scale was measured; detected features count as such.
int level_of_scale(float scale);

}  // namespace relmap::place
