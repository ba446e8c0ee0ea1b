// The skeleton of a map: its shape, contracted for drawing, so that a map of a million frames fits a picture's
// program. relmap/v1/skeleton.proto describes the levels; client/skeleton_relaxation.h lays a skeleton out in a plane.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "client/map_types.h"

namespace relmap::client {

struct SkeletonOptions {
  // How many frames become points beside junctions: one in 64, at most (0), 16 (1), 4 (2), or all (3).
  std::uint32_t level = 1;
  std::vector<SessionNumber> sessions = {};  // empty: all that have a metric scale
  bool candidates = false;                   // with closures that are not in force
};

// The level at which a picture shows a map with so many keyframes: every frame of a small one.
constexpr std::uint32_t level_for(std::uint64_t keyframes) {
  if (keyframes <= 50'000) return 3;
  if (keyframes <= 500'000) return 2;
  return keyframes <= 3'000'000 ? 1 : 0;
}

struct Skeleton {
  // A kept frame, and the step to it from the point before; of the first point of a chain there is none.
  struct Point {
    FrameId frame;
    std::int64_t time_us = 0;  // UTC, in whole milliseconds; 0: not known
    SE3 T_before_this = {};    // p_before = T p_this
    // The traces of the covariance of the step, m^2 and rad^2.
    double translation_variance = 0, rotation_variance = 0;
    std::uint32_t frames = 0;  // contracted into the step, this one included
    bool unmeasured = false;   // the motion, or a part of it, is a guess
    bool carried = false;      // the robot was carried
  };
  // Points that motion joins, of one session and ascending.
  struct Chain {
    SessionNumber session = 0;
    std::vector<Point> points;
  };
  struct Closure {
    EdgeId id;
    FrameId a;  // the older end; the newer one is id.frame
    EdgeState state = EdgeState::kCandidate;
    bool carries = false;  // it is an edge of the graph while it is accepted
    SE3 T_ab = {};
    double translation_variance = 0, rotation_variance = 0;  // as of a point
    double suspicion = 0;                                    // 0..1
    std::uint32_t alike = 1;                                 // closures that it stands for, itself included
  };

  std::uint64_t map_version = 0;
  std::uint64_t commit_number = 0;            // of the stored map that it shows
  std::uint64_t frames_done = 0, frames = 0;  // of the chosen sessions: told so far, and in all
  std::vector<Chain> chains = {};             // by session, ascending
  std::vector<Closure> closures = {};         // ascending by id; both ends are points once all is told
  std::size_t points() const {
    std::size_t count = 0;
    for (const Chain& chain : chains) count += chain.points.size();
    return count;
  }
};

// Called with what is there after each message. A status other than OK ends the reading with it.
using SkeletonSink = std::function<Status(const Skeleton& so_far)>;

}  // namespace relmap::client
