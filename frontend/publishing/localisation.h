// Where the robot is in the map, by what the daemon says of its keyframes: a closure ties one of them to an older
// frame, and the odometry since then does the rest. Across a step that vision did not measure the odometry is only a
// guess; from there on the place is unknown until a later keyframe is recognised.
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>

#include "proto/ingest_messages.h"

namespace relmap {

// Thread-safe.
class Localisation {
 public:
  // In the order of their sequences.
  void published(const Keyframe& keyframe);

  // A keyframe behind unmeasured steps was recognised in what the map held before them, or in another session.
  struct Recovery {
    FrameId keyframe, frame;
    double distance_m = 0;    // between them
    std::uint64_t steps = 0;  // unmeasured ones that this closes
  };
  std::optional<Recovery> hear(const PoseNews& news);

  struct Place {
    FrameId frame;       // of the map
    SE3 T_frame_newest;  // of the newest keyframe published
    FrameId recognised;  // the keyframe whose closure says so
  };
  // nullopt: no closure is known, or vision was lost since.
  std::optional<Place> place() const;

  struct Counts {
    std::uint64_t closures = 0;  // that came into force
    std::uint64_t withdrawn = 0;
    std::uint64_t unmeasured_steps = 0;
    std::uint64_t recovered_steps = 0;  // of them, those behind which the robot was recognised
  };
  Counts counts() const;

 private:
  struct Pose {
    std::uint32_t sequence = 0;
    SE3 T_odom_keyframe;
  };
  struct Anchor {
    FrameId keyframe, frame;
    SE3 T_frame_odom;
  };
  std::optional<SE3> odometry(std::uint32_t sequence) const;

  mutable std::mutex mutex_;
  std::deque<Pose> poses_;             // of the newest keyframes
  std::deque<std::uint32_t> guesses_;  // open unmeasured steps: the sequences of the keyframes that they lead to
  std::optional<std::uint32_t> last_guess_;
  std::deque<Anchor> anchors_;  // closures in force, the newest ones
  Counts counts_;
};

}  // namespace relmap
