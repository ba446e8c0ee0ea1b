// Pictures that were mirrored, as telephones mirror those of their front cameras: where a pattern is symmetric their
// geometry fits, metres off.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/place/verify.h"

namespace relmap::place {

// The features that the mirror image, left for right, of a picture of that width would have. Of SIFT the rows of cells
// across the keypoint's direction change places, and directions turn the other way.
std::vector<AppearanceFeature> mirrored(std::span<const AppearanceFeature> features, int width);

// NO_CALIBRATION: of the mirror image more fits at `place`, which the picture was found at, than of the picture itself.
// A pair is not asked: its disparities tell.
Status check_not_mirrored(const storage::Graph& graph, const QueryPicture& query, const VerifiedPlace& place,
                          std::uint64_t seed);

}  // namespace relmap::place
