// Digests: what a picture of the map, and a list of its closures, needs of each frame. They follow from the hot parts
// and are a fiftieth of their size, so a million frames are read in a fraction of a second (docs/storage-format.md).
#pragma once

#include <cstdint>
#include <vector>

#include "storage/graph/chunk.h"
#include "storage/graph/frame.h"

namespace relmap::storage {

// A loop closure, as it is stored with its newer end.
struct ClosureDigest {
  EdgeId id;
  FrameId a;  // the older end
  EdgeKind kind = EdgeKind::kLoop;
  EdgeState state = EdgeState::kCandidate;
  Reason reason = Reason::LONE;
  Verification verification = Verification::kNone;
  bool carries = false;
  SE3 T_ab = {};                   // the estimate, as floats
  float translation_variance = 0;  // traces of the two blocks of its covariance: m^2, rad^2
  float rotation_variance = 0;

  // What speaks for and against it (server/map/suspicion.h).
  std::uint16_t inliers = 0, bound = 0;
  std::uint32_t support = 0;
  float probability = 0, spread = 0;
  std::uint16_t agreeing = 0;     // Edge::consistent_with, their number
  std::uint16_t unseen = 0;       // Edge::unseen, their number
  float tension = 0;              // standard deviations between what was measured and the estimate; see tension_of()
  bool was_contradicted = false;  // it was outvoted, or contradicted the robot's motion, at some time
  bool looks_alike = false;       // the daemon refused it last because two places look alike (LOOKS_ALIKE)
  bool carried = false;           // it says that the robot was carried
  Uniqueness uniqueness = {};
  ClosureTests tests = {};
};

// A frame and its motion.
struct FrameDigest {
  std::uint32_t slot = 0;
  std::int64_t time_us = 0;
  bool joined = false;             // an odometry or prior edge joins it to the frame before
  SE3 T_previous_frame = {};       // along that edge, as floats
  float translation_variance = 0;  // of it: m^2, rad^2
  float rotation_variance = 0;
  float driven_s = 0;
  bool unmeasured = false;  // is_unmeasured()
  bool carried = false;     // closures in force say that the robot was carried along it
  MotionSource source = MotionSource::kStart;
  bool labelled = false;
  std::vector<ClosureDigest> closures = {};  // stored with the frame, ascending by ordinal
};

struct ChunkDigest {
  ChunkId id;
  std::vector<FrameDigest> frames;  // those that are present, ascending by slot
};

// Which frames of a chunk are asked for: of a map without closures, none need be decoded to see that there are none.
enum class DigestsOf : std::uint8_t { kAll, kClosures };  // closures: frames with closures, candidate or not

// How far the estimate of a closure has moved away from what was measured, in standard deviations of the measurement:
// the root of the squared Mahalanobis distance. 0 if the covariance cannot be used, or there is no metric measurement.
float tension_of(const Edge& closure);

ClosureDigest digest_of(const Edge& closure);
FrameDigest digest_of(FrameId id, const FrameHot& frame);

}  // namespace relmap::storage
