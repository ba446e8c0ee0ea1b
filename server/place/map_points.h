// Collects what the map knows around a frame: points with descriptors, in that frame's coordinates.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <unordered_map>
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
  double way = 0;                        // metres along the odometry
};

// The largest uncertainty of a rotation (radians, one sigma over all axes) with which a pose, or a frame's transform to
// the centre, is of use.
inline constexpr double kMaxRotationSigma = 0.1;

// Whether T_centre_frame is known to 0.3 m and 0.1 rad (one sigma). If it is not, the frame's points mostly carry the
// error of the transform, and a closure made with them would agree with any other.
bool well_known(const PlacedFrame& placed);

// How to cross a stretch along which the robot was carried (Edge::carried_by). Given an edge of the stretch, returns an
// edge from its first frame to its last, or nullopt if it cannot be crossed. An empty function crosses none: the walk
// ends there, as it does at motion that no sensor measured.
using AcrossCarried = std::function<std::optional<storage::Edge>(const storage::Edge& step)>;

// Returns the centre, then frames up to `back` steps before it and then frames up to `forward` steps after it, each way
// nearest first. Loop edges are not followed, since what lies beyond one would confirm that very closure; nor is motion
// that no sensor measured. Frames inside a stretch that is crossed are left out. Empty if the centre does not exist.
std::vector<PlacedFrame> along_odometry(const storage::Graph& graph, FrameId centre, std::uint32_t back,
                                        std::uint32_t forward, const AcrossCarried& across = {});

// Places an earlier frame of the centre's session, however far back. nullopt where the motion between them was not
// sensed throughout.
std::optional<PlacedFrame> back_along_odometry(const storage::Graph& graph, FrameId centre, FrameId earlier,
                                               const AcrossCarried& across = {});

inline constexpr std::uint32_t kNoWord = std::numeric_limits<std::uint32_t>::max();

struct MapPoint {
  Vector3 point;                           // metres, in the centre's frame
  Matrix3 covariance;                      // in the centre's frame; of the measurement, without that of T_centre_frame
  LandmarkId landmark;                     // in force; invalid for a feature that belongs to no landmark
  const Descriptor* descriptor = nullptr;  // owned by MapPoints::held
  std::uint32_t placed = 0;                // index into MapPoints::frames
  std::uint32_t word = kNoWord;
  float u = 0, v = 0;  // pixels of its feature, in the frame that it is from
};

struct MapPoints {
  std::vector<PlacedFrame> frames;  // the centre first
  // Of the frames in which landmarks seen from `frames` may be based: these, and kBaseReach steps further back.
  std::unordered_map<FrameId, SE3> T_centre_base;
  std::vector<MapPoint> points;                                 // in the order of their frames
  std::vector<std::shared_ptr<const storage::FrameCold>> held;  // owns the descriptors
};

// How many points are of the centre; they come first.
std::size_t points_of_centre(const MapPoints& map);

// Returns the points seen in the frames up to `reach` steps before and after the centre, for a stereo session. A point
// is the estimate of the feature's landmark if that has its base near by, or else comes from the feature's disparity.
// Points with a disparity of less than 2 sigmas are left out, since the error of their depth is not Gaussian; so are
// the points of frames that are not well_known() and of those for which `left_out(frame)` is true.
MapPoints gather_points(const storage::Graph& graph, FrameId centre, std::uint32_t reach,
                        const std::function<bool(FrameId)>& left_out = {});

// The same in two steps: the centre's points first, which cost a fraction, and then those of the other frames.
MapPoints gather_centre(const storage::Graph& graph, FrameId centre, std::uint32_t reach);
void gather_rest(const storage::Graph& graph, MapPoints& map);

// Base frames of landmarks are searched this many steps further back than their observers.
inline constexpr std::uint32_t kBaseReach = 15;

// Covariance of a landmark's estimate at `p` that `observers` frames saw, each coordinate with `sigma` pixels. At most
// four observations count as independent, since they share errors of the poses of their frames.
Matrix3 estimate_covariance(const StereoCamera& camera, const Vector3& p, double sigma, std::size_t observers);

// Covariance of camera.triangulate(z) at `p`, where the coordinates of z have independent errors of `sigma` pixels.
Matrix3 stereo_covariance(const StereoCamera& camera, const Vector3& p, double sigma);

// The pyramid level at which a tracked feature of this scale was measured; also used for features that were only
// detected.
int level_of_scale(float scale);

}  // namespace relmap::place
