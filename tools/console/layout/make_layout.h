// Makes a layout of a skeleton that was relaxed.
#pragma once

#include "client/skeleton_relaxation.h"
#include "tools/console/layout/map_layout.h"

namespace relmap::console {

// `before`: an older layout; parts lie where they lay there, turned likewise, by the frames that both have. Null: there
// is none. Of the skeleton's points each must be in a part of `relaxed`. What the layout is of (map, boot_id, version,
// level, coarse, seconds) is the caller's to set; map_version and commit_number are the skeleton's.
MapLayout make_layout(const client::Skeleton& skeleton, const client::RelaxedSkeleton& relaxed,
                      const MapLayout* before);

// Sets MapLayout::zooms from its points: so that no tile of that zoom has more than so many points, and none of a zoom
// more has more keyframes.
inline constexpr std::uint32_t kMaxPointsOfTile = 12'000;
inline constexpr std::uint32_t kMaxZooms = 16;
inline constexpr double kLeastTile = 4;  // metres
void choose_zooms(MapLayout& layout);

}  // namespace relmap::console
