// A simulated town for maps of more than a hundred kilometres: measurements with exact truth, without pictures.
//
// The houses and kerbs of each direction of each street have points, and so have the corners of crossings. A robot sees
// those before it, from both lanes the same ones, nearer or farther; on each pass it sees another part of them. Driving
// another way shows other points, as a camera that looks forward sees the other sides of things. Some
// stretches of streets look nearly like others. In the cabin of a train it sees the cabin alone.
//
// Everything is a function of the options. A keyframe's tracks go on from one frame to the next, so that a robot makes
// them in order, but may begin anywhere.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "proto/geometry/camera.h"
#include "proto/keyframe/keyframe.h"
#include "tools/sim/city_plan.h"
#include "tools/sim/descriptor.h"

namespace relmap::sim {

// Draws the descriptor of a point. Points of one `style` are those of a stretch of 30 m of a street, or of a cabin:
// what is built together looks alike. A pure function of its arguments.
using DrawDescriptor = std::function<Descriptor(std::uint64_t style, Stream& random)>;

struct CityWorldOptions {
  CityOptions plan;
  StereoCamera camera{450, 320, 240, 0.4, 640, 480};

  std::uint32_t tracks = 120, appearance = 300;  // of a keyframe, at most
  double tracked_per_metre = 60;                 // points of each direction of a street that are tracked when seen,
  double described_per_metre = 90;               // and points that are described only
  double seen_in_a_pass = 0.7;                   // probability of a point to be seen in a pass at all
  double described_in_a_frame = 0.85;            // and then, of one that is not tracked, in a frame
  double look_alike_share = 0.03;                // of the stretches of 30 m: copies of another
  double copied_share = 0.6;                     // of the points of a copied stretch

  double speed = 5;                                                          // m/s
  double pixel_noise = 0.5;                                                  // sigma of u_left, v and u_right, px
  double step_noise_m = 0.01, step_noise_rad = 0.05 * 0.017453292519943295;  // sigma of the odometry step, per axis
  // Of a point's descriptor: the largest change of an entry in a pass, and again in a frame; and the probability that
  // light, viewpoint or a wrong orientation make it another one altogether. On a rendered drive, descriptors of a track
  // were 219 apart from one keyframe to the next and 367 later (medians), and 24 and 9 % of them showed the same word.
  std::uint32_t pass_noise = 16, frame_noise = 14;
  double changed_in_a_pass = 0.3, changed_in_a_frame = 0.25;
  std::int64_t start_us = 1'700'000'000'000'000;
  DrawDescriptor draw;  // empty: make_descriptor()
};

class CityWorld {
 public:
  explicit CityWorld(CityWorldOptions options);
  const CityWorldOptions& options() const { return options_; }
  const CityPlan& plan() const { return plan_; }

  // A point that a camera can see from a piece, or in a cabin.
  struct Point {
    std::uint64_t id = 0;
    std::uint64_t look = 0;  // seeds the descriptor: equal for copies
    std::uint64_t style = 0;
    Vector3 at;       // in the world, or in the cabin: x right, y down, z ahead, metres
    double from = 0;  // seen from at most so many metres before it, along the piece or the robot's view
    Heading facing = Heading::kNorth;  // of a crossing: seen by who drives about this way
    bool tracked = false;
  };
  // The points of the metre that begins `metre` metres along the piece; of the cabin of a robot's ride.
  std::vector<Point> street_points(const Piece& piece, std::uint32_t metre) const;
  // The points of the corners of a crossing, and of what closes it where no street goes on.
  std::vector<Point> crossing_points(std::size_t crossing) const;
  std::vector<Point> cabin_points(std::uint64_t drive_seed, std::uint32_t ride) const;

 private:
  Point street_point(const Piece& piece, std::uint32_t metre, std::uint32_t number) const;

  const CityWorldOptions options_;
  const CityPlan plan_;
};

// A robot's keyframes along one drive. For one thread.
class CityRobot {
 public:
  // `world` must outlive the robot. The next keyframe is number `first`.
  CityRobot(const CityWorld& world, const CityDriveOptions& drive, SessionHeader session, std::uint32_t first = 0);

  const CityDrive& drive() const { return drive_; }
  std::uint32_t next_number() const { return next_; }
  Keyframe next();

  // Truth.
  SE3 T_world_frame(std::uint32_t i) const;

 private:
  struct Seen {
    const CityWorld::Point* point;
    Vector3 in_frame;
  };

  SE3 bobbing(std::uint32_t i) const;  // of the camera on the robot
  SE3 T_cabin_frame(std::uint32_t i) const;
  Vector6 noise_of_step(std::uint32_t i) const;
  SE3 step(std::uint32_t i) const;  // of the odometry, from frame i - 1 to i
  std::vector<Seen> look(std::uint32_t i);
  void look_along(const Piece& piece, const SE3& T_frame_world, std::uint32_t i, double part, std::vector<Seen>& seen);
  void look_at_crossing(std::size_t crossing, const SE3& T_frame_world, std::uint32_t i, double part,
                        std::vector<Seen>& seen);
  void look_around_cabin(std::uint32_t ride, std::uint32_t i, std::vector<Seen>& seen);
  bool visible(const Vector3& in_frame) const;
  bool shown(const CityWorld::Point& point, std::uint32_t i, double part) const;  // in this pass
  const std::vector<CityWorld::Point>& points(const Piece& piece, std::uint32_t metre);
  void forget_old_points();
  TrackMeasurement measure(const Seen& seen, std::uint32_t i) const;
  AppearanceFeature describe(const Seen& seen, const TrackMeasurement& measurement, int track, std::uint32_t i);
  Keyframe advance();

  const CityWorld& world_;
  const CityDrive drive_;
  const SessionHeader session_;
  const std::uint64_t noise_seed_;
  std::uint32_t next_ = 0;
  SE3 T_odom_frame_;                                   // of frame next_ - 1
  std::unordered_map<std::uint64_t, TrackId> tracks_;  // of the last frame, by the point's id
  // What has been generated of the streets around the robot and of its cabin.
  struct Cell {
    std::vector<CityWorld::Point> points;
    std::uint32_t used = 0;  // in which frame
  };
  std::unordered_map<std::uint64_t, Cell> cells_;
  std::unordered_map<std::uint64_t, Descriptor> descriptors_;  // in this pass, by the point's id
};

}  // namespace relmap::sim
