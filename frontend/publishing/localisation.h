// Where the robot is in the map, by what the daemon says of its keyframes: a closure ties one of them to an older
// frame, and the odometry since then does the rest. Across a step that vision did not measure the odometry is only a
// guess; from there on the place is unknown until a later keyframe is recognised.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "proto/keyframe/ingest_messages.h"

namespace relmap::publishing {

// Thread-safe.
class Localisation {
 public:
  // A keyframe is about to be published; in the order of their sequences.
  void publishing(const Keyframe& keyframe);

  // A keyframe behind unmeasured steps was recognised in what the map held before them, or in another session.
  struct Recovery {
    FrameId keyframe, frame;
    double distance_m = 0;    // between them
    std::uint64_t steps = 0;  // unmeasured ones that nothing had closed yet
  };
  std::optional<Recovery> hear(const PoseNews& news);

  struct Place {
    FrameId frame;       // of the map
    SE3 T_frame_newest;  // of the newest keyframe
    FrameId recognised;  // the keyframe whose closure says so
  };
  // nullopt: no closure in force is known, or vision was lost since.
  std::optional<Place> place() const;

  struct Counts {
    std::uint64_t closures = 0;   // that came into force
    std::uint64_t withdrawn = 0;  // of them, taken out again
    std::uint64_t unmeasured_steps = 0;
    std::uint64_t recovered_steps = 0;  // of them, those that a closure in force reaches across
    std::uint64_t heard = 0;            // news of any kind
  };
  Counts counts() const;

 private:
  struct Pose {
    std::uint32_t sequence = 0;
    SE3 T_odom_keyframe;
  };
  // An unmeasured step, by the keyframe that it leads to.
  struct Guess {
    std::uint32_t sequence = 0;
    std::uint32_t closures = 0;  // in force, from behind it to before it
  };
  using Ends = std::pair<FrameId, FrameId>;  // keyframe, frame
  std::optional<SE3> odometry(std::uint32_t sequence) const;
  std::uint64_t reach_across(const Ends& ends, bool in_force);

  mutable std::mutex mutex_;
  std::deque<Pose> poses_;  // of the newest keyframes
  std::deque<Guess> guesses_;
  // T_frame_odom of the closures in force, those of the newest keyframes; none where the keyframe's pose is not known.
  std::map<Ends, std::optional<SE3>> closures_;
  SessionNumber session_ = 0;  // the map's number of this one
  Counts counts_;
};

}  // namespace relmap::publishing
