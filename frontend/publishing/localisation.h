// Where the robot is in the map: a closure that the daemon reports connects one of its keyframes to an older frame, and
// the odometry since then gives the rest. Across a step that vision did not measure, the odometry is only a guess, so
// the place is unknown until a later keyframe is recognised.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>

#include "proto/base/mutex.h"
#include "proto/keyframe/ingest_messages.h"

namespace relmap::publishing {

// Thread-safe.
class Localisation {
 public:
  // Must be called for each keyframe before it is published, in the order of sequences.
  void publishing(const Keyframe& keyframe);

  // A keyframe after unmeasured steps was recognised in a frame from before them, or in another session.
  struct Recovery {
    FrameId keyframe, frame;
    double distance_m = 0;    // between the two
    std::uint64_t steps = 0;  // unmeasured steps that no closure had bridged before
  };
  // Takes in news from the daemon. Returns a recovery if a closure bridges such steps.
  std::optional<Recovery> hear(const PoseNews& news);

  struct Place {
    FrameId frame;       // a frame of the map
    SE3 T_frame_newest;  // pose of the newest keyframe in it
    FrameId recognised;  // the keyframe whose closure the place is from
  };
  // nullopt if no closure in force is known, or vision was lost since.
  std::optional<Place> place() const;

  struct Counts {
    std::uint64_t closures = 0;   // closures that came into force
    std::uint64_t withdrawn = 0;  // closures that were taken out again
    std::uint64_t unmeasured_steps = 0;
    std::uint64_t recovered_steps = 0;  // unmeasured steps that one of the newest 4,096 closures in force bridges
    std::uint64_t heard = 0;            // news of any kind
  };
  Counts counts() const;

 private:
  struct Pose {
    std::uint32_t sequence = 0;
    SE3 T_odom_keyframe;
  };
  // An unmeasured step.
  struct Guess {
    std::uint32_t sequence = 0;  // of the keyframe that it leads to
    std::uint32_t closures = 0;  // closures in force that bridge it
  };
  using Ends = std::pair<FrameId, FrameId>;  // keyframe, frame
  std::optional<SE3> odometry(std::uint32_t sequence) const RELMAP_REQUIRES(mutex_);
  std::uint64_t bridge(const Ends& ends, bool in_force) RELMAP_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::deque<Pose> poses_ RELMAP_GUARDED_BY(mutex_);  // of the newest keyframes
  std::deque<Guess> guesses_ RELMAP_GUARDED_BY(mutex_);
  // T_frame_odom of the closures in force, for the newest keyframes; nullopt if the keyframe's pose is not known.
  std::map<Ends, std::optional<SE3>> closures_ RELMAP_GUARDED_BY(mutex_);
  SessionNumber session_ RELMAP_GUARDED_BY(mutex_) = 0;  // this session's number in the map
  Counts counts_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::publishing
