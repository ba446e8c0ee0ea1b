// Where tracks are few, new ones start: the best corners, spread over the picture, that both eyes see.
#pragma once

#include <span>
#include <vector>

#include "frontend/tracking/landmark.h"
#include "frontend/tracking/pair.h"
#include "frontend/vision/corners.h"
#include "frontend/vision/spread.h"

namespace relmap::tracking {

// Where a track goes on.
struct TakenPoint {
  vision::PicturePoint point;  // pixels of the picture
  int level = 0;
};

struct NewLandmark {
  Landmark landmark;
  StereoPixel pixel;
};

// At `corners` of the left picture, by level. Up to `wanted` in all, `taken` (positions of the tracks that go on,
// pixels of the picture) included; where coarse levels have fewer than their share, some more. `sigma`: of a coordinate
// on level 0, pixels. `offset`: to be taken off disparities, pixels.
std::vector<NewLandmark> start_landmarks(const Pair& pair, const std::vector<std::vector<vision::Corner>>& corners,
                                         const StereoCamera& camera, std::span<const TakenPoint> taken,
                                         std::span<const vision::PicturePoint> avoid, int wanted, double sigma,
                                         double offset);

}  // namespace relmap::tracking
