// Where tracks are few, new ones start: the best corners, spread over the picture, that both eyes see.
#pragma once

#include <span>
#include <vector>

#include "frontend/tracking/landmark.h"
#include "frontend/tracking/pair.h"
#include "frontend/vision/corners.h"
#include "frontend/vision/spread.h"

namespace relmap::tracking {

// The position of a track that continues.
struct TakenPoint {
  vision::PicturePoint point;  // pixels of the picture
  int level = 0;
};

struct NewLandmark {
  Landmark landmark;
  StereoPixel pixel;
};

// Starts landmarks at `corners` of the left picture (by level) that have a stereo match, away from the points to
// `avoid`. Makes up to `wanted` landmarks including those `taken`, and some more if coarse levels have fewer than their
// share. `sigma` is the standard deviation of a coordinate on level 0 in pixels. `offset` pixels are subtracted from
// disparities.
std::vector<NewLandmark> start_landmarks(const Pair& pair, const std::vector<std::vector<vision::Corner>>& corners,
                                         const StereoCamera& camera, std::span<const TakenPoint> taken,
                                         std::span<const vision::PicturePoint> avoid, int wanted, double sigma,
                                         double offset);

}  // namespace relmap::tracking
