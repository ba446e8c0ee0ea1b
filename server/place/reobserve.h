// Finds old landmarks again in a keyframe's picture by their appearance in older pictures: the patch around a landmark
// is warped to the frame's viewpoint and aligned to a fraction of a pixel. Matching by descriptors is less exact, since
// the new keypoint may lie a pixel beside the old one or may not have been detected; here every old landmark in view is
// measured as exactly as by tracking.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/place/changes.h"
#include "server/place/picture_cache.h"
#include "storage/journal/journal_record.h"

namespace relmap::place {

// The pose of a frame relative to another frame, `match`.
struct Standpoint {
  FrameId match;
  SE3 T_match_frame;
  Matrix6 covariance;  // of T_match_frame Exp(xi)
};

inline constexpr int kMinAligned = 20;
// With so many fixed landmarks aligned, a frame is located better than its own new landmarks could improve.
inline constexpr int kEnoughFixed = 60;

struct Reobservation {
  std::vector<storage::ProposedBinding> bindings;
  // The landmarks around the first standpoint that should be in the picture at about the distance from which they were
  // seen before; empty if those that are aligned do not agree on a pose.
  std::vector<SoughtLandmark> sought;
};

// Re-observes the landmarks that were seen around the matches, up to kBindingReach steps along their sessions' motion
// in both directions. Returns two kinds of bindings: landmarks that are aligned in the picture, and tracks of the
// frame's own session that began since frame `first_maskable` and are not needed (AliasClaim), since an aligned
// landmark of about the same depth lies beside them. If kEnoughFixed of the aligned landmarks are fixed
// (storage/graph/observers.h), no such track is needed, so that what a place adds to the map is bounded.
//
// The landmarks that are aligned from one standpoint agree on a pose; a standpoint from which fewer than kMinAligned
// agree gives no bindings. The result is empty if the frame has no picture.
Reobservation reobserve(const storage::Graph& graph, PictureCache& pictures, FrameId frame,
                        std::span<const Standpoint> standpoints, std::uint32_t first_maskable);

}  // namespace relmap::place
