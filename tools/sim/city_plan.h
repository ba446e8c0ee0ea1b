// A town's streets on an irregular grid, and drives of robots through them, with rides in a train in between.
//
// Plane coordinates: x east, z north, metres. Traffic keeps to the right. A street is 24 m wide from house to house and
// has two lanes in each direction.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "proto/geometry/geometry.h"
#include "tools/sim/ground_plan.h"
#include "tools/sim/random.h"

namespace relmap::sim {

struct CityOptions {
  std::uint64_t seed = 1;
  int columns = 14, rows = 12;             // streets that run north, and those that run east; at least 2
  double min_block = 80, max_block = 150;  // metres between neighbouring crossings
};

enum class Heading : std::uint8_t { kNorth, kEast, kSouth, kWest };
Vector2 direction_of(Heading heading);  // x, z; of length 1

// One direction of a street between two neighbouring crossings: 4 * the crossing that it leaves + its heading.
using PieceId = std::uint32_t;

struct Piece {
  PieceId id = 0;
  Vector2 begin;      // x, z: where it leaves the crossing, on the street's middle line
  Vector2 direction;  // of length 1
  double length = 0;  // metres, up to the next crossing's edge

  Vector2 right() const { return {direction.y(), -direction.x()}; }
  // The point `along` the piece and `aside` to the right of the middle line.
  Vector2 at(double along, double aside) const { return begin + along * direction + aside * right(); }
};

inline constexpr double kHalfStreet = 12;        // metres from the middle line to the houses
inline constexpr double kLane[] = {1.75, 5.25};  // the lanes' middles, from the middle line

class CityPlan {
 public:
  explicit CityPlan(const CityOptions& options);

  double street_metres() const;  // of all streets, each counted once
  std::size_t crossings() const { return x_.size() * z_.size(); }
  std::optional<Piece> piece(PieceId id) const;  // nullopt at the edge of the town
  Vector2 centre(std::size_t crossing) const { return {x_[crossing % x_.size()], z_[crossing / x_.size()]}; }
  std::size_t end_of(PieceId id) const { return *neighbour(id / 4, static_cast<Heading>(id % 4)); }
  // The piece that follows at the crossing where `id` ends, if one goes `turn` quarters to the right: -1, 0 or 1.
  std::optional<Piece> next(PieceId id, int turn) const;

 private:
  std::optional<std::size_t> neighbour(std::size_t crossing, Heading heading) const;

  std::vector<double> x_, z_;  // of the streets that run north and east, ascending
};

struct CityDriveOptions {
  std::uint64_t seed = 1;  // of the way through the town
  std::uint32_t frames = 1000;
  double step = 0.5;               // metres between keyframes while it drives
  double ride_every = 5000;        // metres driven between rides; 0: none
  std::uint32_t ride_frames = 20;  // keyframes while the train runs
};

// A robot's drive, a random walk over the crossings without turning back. Everything is a function of the options, in
// any order of frames.
class CityDrive {
 public:
  // `plan` must outlive the drive.
  CityDrive(const CityPlan& plan, const CityDriveOptions& options);

  const CityDriveOptions& options() const { return options_; }
  std::uint32_t size() const { return options_.frames; }

  struct Standpoint {
    PlanePose pose;     // in the world. While the train runs, somewhere on its way
    PieceId piece = 0;  // on which it drives, or which it has just left to cross a crossing
    // The ride, from 1 on, in whose cabin the robot is: 0 if in none. The cabin stands still in the world while the
    // robot enters and leaves it, and runs with the robot between.
    std::uint32_t ride = 0;
    double in_cabin = 0;   // metres that the robot stands ahead of its place in the cabin; negative while it enters
    bool running = false;  // nothing but the cabin is seen
  };
  Standpoint at(std::uint32_t frame) const;
  double metres_driven(std::uint32_t frame) const;            // since frame 0, without rides
  std::uint32_t frames_on_trains(std::uint32_t frame) const;  // up to this one, while the train ran

 private:
  // A curve through the plane: a lane of a piece, or the way across a crossing.
  struct Segment {
    double begin = 0, length = 0;  // metres along the stage
    PieceId piece = 0;
    Vector2 from, from_direction, to, to_direction;
    bool curved = false;
  };
  // What is driven between two rides.
  struct Stage {
    std::uint32_t first_frame = 0, frames = 0;
    std::vector<Segment> segments;
  };

  const Stage& stage_of(std::uint32_t frame) const;
  void add_stage(Random& random, PieceId start, double metres);
  PlanePose on(const Segment& segment, double along) const;
  PlanePose on(const Stage& stage, double along, PieceId& piece) const;

  const CityPlan& plan_;
  const CityDriveOptions options_;
  std::vector<Stage> stages_;
};

}  // namespace relmap::sim
