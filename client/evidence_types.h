// Why a loop closure is believed, and how many there are between sessions, as plain values.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/map_types.h"

namespace relmap::client {

// What the way between a closure's ends without it says now: the odometry and other closures in force.
struct MotionVerdict {
  // OK: it agrees. CONTRADICTS_MOTION: it does not. CARRIED: it does not, since the robot was carried. NOT_CONNECTED:
  // there is no other way. OUT_OF_REACH: the way is too long, or passes motion that nothing measured, to say anything.
  // NOT_STEREO: the closure measured no metres. UNIMPLEMENTED: the daemon said nothing.
  Reason verdict = Reason::UNIMPLEMENTED;
  std::string message;      // in words
  std::uint32_t edges = 0;  // on the way
  double distance_m = 0;    // of the way
  SE3 T_ab;                 // by the way
  Matrix6 covariance = Matrix6::Identity();
  // Between what the closure says and what the way says; sigmas_apart is the Mahalanobis distance.
  double metres_apart = 0, radians_apart = 0, sigmas_apart = 0;
};

// Another closure that agrees with it or contradicts it.
struct Agreement {
  EdgeId edge;
  FrameId a, b;  // its ends: older, newer
  EdgeState state = EdgeState::kCandidate;
  bool agrees = false;  // false: it contradicts
};

struct EdgeExplanation {
  Edge edge;  // with its history and suspicion
  // Of its ends, if asked for. The view of the correspondences is b, the newer end, and the frame is a.
  std::optional<FramePicture> picture_a, picture_b;
  std::vector<Correspondence> correspondences;  // found anew, the inliers first
  Status correspondences_missing;               // not ok: why there are none
  MotionVerdict motion;
  std::vector<Agreement> agreements;      // at most 256
  std::optional<FramePicture> runner_up;  // of Edge::uniqueness' runner-up, if asked for
};

// The loop closures between two sessions, or within one.
struct ClosureMatrixCell {
  SessionNumber session_a = 0, session_b = 0;  // session_a <= session_b
  std::uint32_t candidate = 0, accepted = 0, quarantined = 0, removed = 0;
  std::optional<EdgeId> most_suspicious;  // of those in force; absent: none is in force
  double suspicion = 0;                   // of it, 0..1
};

}  // namespace relmap::client
