// Recognises mirrored pictures, such as telephones make with their front cameras. Where a pattern is symmetric, the
// geometry of a mirrored picture fits with a pose that is metres off.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/place/verify.h"

namespace relmap::place {

// Returns the features that the mirror image (left and right exchanged) of a picture of this width would have. In a
// SIFT descriptor this reverses the order of the rows of cells and the sense of the gradient directions.
std::vector<AppearanceFeature> mirrored(std::span<const AppearanceFeature> features, int width);

// NO_CALIBRATION if more features of the mirror image than of the picture fit at `place`, where the picture was found.
// Stereo pairs are not checked, since their disparities exclude it.
Status check_not_mirrored(const storage::Graph& graph, const QueryPicture& query, const VerifiedPlace& place,
                          std::uint64_t seed);

}  // namespace relmap::place
