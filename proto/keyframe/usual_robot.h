// The robot of recordings that name none.
#pragma once

namespace relmap {

// What `relmap ingest` calls it. Many of its recordings may be taken in at a time, so it is never two of one name.
inline constexpr char kUsualRobot[] = "batch";

}  // namespace relmap
