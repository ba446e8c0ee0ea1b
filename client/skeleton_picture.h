// A skeleton as a picture of the map.
#pragma once

#include "client/map_picture.h"
#include "client/skeleton_relaxation.h"

namespace relmap::client {

// Adds parts, motion and closures of a skeleton that was laid out. Title, names, labels, routes and queries are the
// caller's; of the latter only what stands at points of the skeleton is drawn.
void add_skeleton(MapPicture& picture, const Skeleton& skeleton, const RelaxedSkeleton& layout);

}  // namespace relmap::client
