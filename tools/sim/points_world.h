// Simulated drives through a world of points: measurements with exact truth, without pictures.
//
// A world is a circuit driven `frames` keyframes far, `frames_per_lap` to a lap. Landmarks are born uniformly in the
// picture at a log-uniform depth, and are seen for two frames plus a geometric number, as long as both eyes see them.
// On later laps each landmark of the first lap is seen again at the same place of the circuit with probability
// `seen_again`; new landmarks replace the others. As in a real front-end, a landmark that is seen again begins a new
// track: only landmarks() tells that it is the same.
//
// Everything is a pure function of the options. keyframe(i) costs the same for every i, in any order, and memory grows
// by only two bytes a frame. `noise_seed` changes the noise of pixels, odometry and descriptors, and nothing else.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "proto/geometry/camera.h"
#include "proto/keyframe/keyframe.h"
#include "tools/sim/ground_plan.h"

namespace relmap::sim {

struct PointsWorldOptions {
  std::uint64_t world_seed = 1;
  std::uint64_t noise_seed = 1;

  PlanShape shape = PlanShape::kCircle;
  std::uint32_t frames = 1000;
  std::uint32_t frames_per_lap = 1000;
  double step = 0.2;           // metres of arc between keyframes
  double speed = 1;            // m/s
  double height = 0.05;        // metres: amplitude of height(s) = height sin(0.7 s)
  double pitch = 0.02;         // radians: amplitude of pitch(s) = pitch sin(1.3 s)
  double lateral_per_lap = 0;  // each lap is driven by so many metres further to the right
  double climb = 0;            // each lap climbs by so many metres, and falls back where the next begins (a lift)

  StereoCamera camera{400, 256, 192, 0.12, 512, 384};
  double births = 11.1;                    // landmarks born in each frame
  double mean_extra = 3.4;                 // mean of the geometric number of frames beyond two
  double depth_min = 1.5, depth_max = 10;  // metres
  double seen_again = 0.7;
  double mono_share = 0;  // of landmarks: seen by the left eye only

  double pixel_noise = 1;      // sigma of u_left, v and u_right, px
  double step_noise_m = 0.01;  // sigma of the odometry step, per axis
  double step_noise_rad = 0.05 * 0.017453292519943295;

  std::uint32_t appearance = 0;        // features of the appearance, with the tracked landmarks; 0: none
  std::uint32_t descriptor_noise = 8;  // largest change of an entry

  SessionUuid uuid{{0x72, 0x65, 0x6c, 0x6d, 0x61, 0x70, 0x20, 0x70, 0x6f, 0x69, 0x6e, 0x74, 0x73, 0, 0, 1}};
  std::string robot = "points";
  std::string session = "points";
  std::int64_t start_us = 1'700'000'000'000'000;
};

// The world of docs/method.md, 5: 288 frames, about 3,200 landmarks and 12,600 observations.
PointsWorldOptions figure8_options(std::uint64_t noise_seed);

// Identifies a point of the world, whatever tracks see it.
using PointId = std::uint64_t;

class PointsWorld {
 public:
  explicit PointsWorld(PointsWorldOptions options);

  const PointsWorldOptions& options() const { return options_; }
  std::uint32_t size() const { return options_.frames; }

  // Keyframe i, i < size(); its sequence is i. Thread-safe.
  Keyframe keyframe(std::uint32_t i) const;

  // Truth.
  SE3 T_world_frame(std::uint32_t i) const;
  std::vector<PointId> landmarks(std::uint32_t i) const;  // one for each of keyframe(i).tracks
  Vector3 point(PointId id) const;                        // in the world

  // The robot's odometry pose of frame i, as keyframe(i) carries it.
  SE3 T_odom_frame(std::uint32_t i) const;

 private:
  // Points that are tracked (and in the appearance set), and those that are in the appearance set only.
  enum class Kind : std::uint8_t { kTracked, kAppearance };
  struct Point {
    Vector3 in_world;
    std::uint32_t life = 0;  // frames
    bool mono = false;
  };
  struct Sighting {
    PointId id = 0;
    std::int64_t born = 0;   // frame; negative: before the start
    std::uint32_t slot = 0;  // among those born there
    Vector3 in_frame;
    bool mono = false;
  };

  SE3 pose(std::int64_t i) const;  // also for i < 0: landmarks born there may still be seen in frame 0
  std::uint32_t births(std::int64_t i, Kind kind) const;
  PointId born(std::int64_t i, std::uint32_t slot, Kind kind) const;
  std::uint32_t life(PointId id) const;
  Point make_point(PointId id) const;
  bool visible(const Point& point, const SE3& T_frame_world) const;
  SE3 step(std::uint32_t i) const;  // of the odometry, from frame i - 1 to i
  // What frame i sees; those that it sees first stand before the others.
  std::vector<Sighting> sightings(std::uint32_t i, Kind kind) const;
  TrackId track_of(const Sighting& sighting) const;
  TrackMeasurement measure(const Sighting& sighting, std::uint32_t i) const;
  void add_appearance(const std::vector<Sighting>& tracked, std::uint32_t i, Keyframe& keyframe) const;

  PointsWorldOptions options_;
  GroundPlan plan_;
  double appearance_births_ = 0;         // per frame
  std::vector<SE3> odometry_;            // every kOdometryStride-th pose
  std::vector<Sighting> seen_at_start_;  // by frame 0
};

}  // namespace relmap::sim
