// Old landmarks found again in a keyframe's picture by what they looked like in an older one: the patch round a
// landmark's track is warped to where the frame stands and aligned to a fraction of a pixel. Descriptors tell which
// corner a corner is; the new one was chosen a pixel beside the old one, or not at all. Here every old landmark in view
// is measured, as exactly as by tracking.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/place/changes.h"
#include "server/place/picture_cache.h"
#include "storage/journal/journal_record.h"

namespace relmap::place {

// Where a frame stands, by another.
struct Standpoint {
  FrameId match;
  SE3 T_match_frame;
  Matrix6 covariance;  // of T_match_frame Exp(xi)
};

inline constexpr int kMinAligned = 20;
inline constexpr int kEnoughSettled = 60;  // they locate a frame better than what it could add

struct Reobservation {
  std::vector<storage::ProposedBinding> bindings;
  // From the first standpoint: landmarks that should be in the picture, seen from about as near; empty where nothing
  // there agrees on a pose.
  std::vector<SoughtLandmark> sought;
};

// Of the landmarks that were seen around the matches (kBindingReach steps along their sessions' motion, both ways).
// Bindings of two kinds: landmarks aligned in the picture, and tracks of the frame's session, begun since
// `first_maskable`, that are not needed since an aligned landmark of about the same depth lies beside them
// (AliasClaim); all such tracks where kEnoughSettled of what is aligned is settled (storage/graph/observers.h): what a
// place adds to the map is bounded. All that is aligned from one standpoint agrees on a pose; a standpoint from which
// fewer than kMinAligned do gives none. Empty where the frame has no picture.
Reobservation reobserve(const storage::Graph& graph, PictureCache& pictures, FrameId frame,
                        std::span<const Standpoint> standpoints, std::uint32_t first_maskable);

}  // namespace relmap::place
