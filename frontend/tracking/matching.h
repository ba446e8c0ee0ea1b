// Landmarks found again in a new stereo pair.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "frontend/tracking/landmark.h"
#include "frontend/vision/corners.h"
#include "frontend/vision/motion.h"
#include "frontend/vision/pyramid.h"

namespace relmap {

struct Sighting {
  std::uint32_t landmark = 0;  // index
  StereoPixel pixel;           // u_right NaN: not found in the right picture
};

struct Pair {
  Pyramid left, right;
  std::vector<std::vector<Corner>> corners;  // of the left picture, by level
};

// Wide and coarse: each landmark against the corners of its level within `radius` pixels (of the picture) of where
// `T_camera_keyframe` puts it. One eye, a pixel's accuracy, many wrong.
std::vector<Sighting> match_corners(std::span<const Landmark> landmarks, const SE3& T_camera_keyframe,
                                    const StereoCamera& camera, const Pair& pair, double radius);

// Narrow and fine, where the pose is known to a few pixels: patches searched within two pixels of the level and
// aligned to a fraction of one, in time and then left to right. `expected`: how many should have been seen from there.
std::vector<Sighting> match_patches(std::span<const Landmark> landmarks, const SE3& T_camera_keyframe,
                                    const StereoCamera& camera, const Pair& pair, std::size_t& expected);

}  // namespace relmap
