// A feature of a query as a measurement, and as a re-observation of a landmark.
#pragma once

#include "proto/camera.h"
#include "storage/journal_record.h"

namespace relmap {

// u_right NaN where the feature or the camera has no disparity.
StereoPixel pixel_of(const AppearanceFeature& feature, const StereoCamera& camera);

ProposedBinding binding_to(LandmarkId landmark, const AppearanceFeature& feature, const StereoCamera& camera);

}  // namespace relmap
