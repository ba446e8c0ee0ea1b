// Localises a picture whose camera is only supposed: if geometry finds that another camera took it, the picture is
// localised once more with an unknown camera.
#pragma once

#include <functional>

#include "server/place/localise.h"

namespace relmap::place {

// Describes the picture of a question anew, as of an unknown camera, for a second attempt. Called at most once and only
// after the first attempt has ended, so it may replace what the first question refers to. What the question that it
// returns refers to must live until the second attempt has ended. Empty if the picture can only be described with its
// camera (a stereo pair, or features).
using DescribeWithoutCamera = std::function<Result<PlaceQuestion>()>;

// As the functions of these names in localise.h, but with a second attempt: if the camera of the question is only
// supposed (kSupposed) and the first attempt ends with WRONG_CALIBRATION (of match_features(), as nothing_verified),
// the answer is that to the question which `without_camera` returns, or the reason why it returns none.
Result<Localisation> localise_features(const PlaceKnowledge& map, const PlaceQuestion& question,
                                       const DescribeWithoutCamera& without_camera, const Proceed& proceed);
Result<PlaceMatches> match_features(const PlaceKnowledge& map, const PlaceQuestion& question,
                                    const DescribeWithoutCamera& without_camera, std::size_t max_verified,
                                    const Proceed& proceed);

}  // namespace relmap::place
