// The frames of a chunk that become points of a chain, and the steps between them.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "proto/base/ids.h"
#include "proto/geometry/geometry.h"
#include "storage/graph/digest.h"

namespace relmap::skeleton {

// A point of a chain, and the step to it from the point before.
struct Point {
  std::uint32_t index = 0;
  std::int64_t time_us = 0;
  SE3 T_before_this = {};          // identity for the first point of a chain
  float translation_variance = 0;  // of the step: the traces of its covariance, m^2 and rad^2
  float rotation_variance = 0;
  std::uint32_t frames = 0;  // contracted into the step, this one included
  bool unmeasured = false;   // the motion, or a part of it, is a guess
  bool carried = false;      // the robot was carried
};

struct Chain {
  SessionNumber session = 0;
  std::vector<Point> points;
};

// Whether motion leads to the frame from the one before. It does not where next to nothing is known of it: the robot
// may have been carried, and no camera could tell.
inline bool is_joined(const storage::FrameDigest& frame) {
  return frame.joined && !(frame.unmeasured && frame.source == MotionSource::kUnsensed);
}

// Contracts the frames of chunks, one chunk after another. The last frame of each chunk is a point, so every chunk
// begins anew from it.
class ChainContraction {
 public:
  explicit ChainContraction(std::uint32_t level) : level_(level) {}

  // Adds the points of a chunk of the session to `chains`, or a chain for each piece that motion does not join to what
  // was before. `kept`: bit by slot, frames that must be points beside those at which the chain begins, ends, or is
  // carried or a guess from here on.
  void add(const storage::ChunkDigest& chunk, std::uint64_t kept, std::vector<Chain>& chains);
  // The last point; nullopt before the first chunk.
  std::optional<FrameId> last() const { return last_; }
  // What is added next begins a chain of its own, with a copy of the last point if motion joins it to that.
  void begin_chain() { open_ = false; }

 private:
  struct Place {                                  // of a frame, relative to the beginning of its piece in this chunk
    const storage::FrameDigest* frame = nullptr;  // null: the last point of the chunk before
    SE3 pose;
    bool kept = false;
  };
  void keep_bends(std::vector<Place>& piece, std::uint32_t& left) const;
  void emit(const std::vector<Place>& piece, storage::ChunkId chunk, std::vector<Chain>& chains);

  const std::uint32_t level_;
  std::optional<FrameId> last_;
  std::int64_t last_time_us_ = 0;
  bool open_ = false;  // the last chain of `chains` ends with the last point
};

}  // namespace relmap::skeleton
