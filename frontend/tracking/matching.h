// Landmarks found again in a new picture.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "frontend/tracking/landmark.h"
#include "frontend/vision/corners.h"
#include "frontend/vision/pyramid.h"

namespace relmap::tracking {

struct Sighting {
  std::uint32_t landmark = 0;  // index
  StereoPixel pixel;           // u_right NaN: not found in the right picture
  float difference = 0;        // of the patches, mean over the pixels, grey levels: the smaller the likelier
};

// How landmarks should look to one eye from a pose: their patches, warped once for all the searches from about there.
class ExpectedPatches {
 public:
  // `T_eye_keyframe`: the pose of that eye, whose picture has `levels` pyramid levels. Landmarks behind the eye,
  // outside the picture, or of which the patch cannot be had, are not expected.
  ExpectedPatches(std::span<const Landmark> landmarks, const SE3& T_eye_keyframe, const StereoCamera& camera,
                  int levels);

  struct Patch {
    std::uint32_t landmark;
    int level;
    vision::Template fine;
    vision::SadPatch coarse;
  };
  const std::vector<Patch>& patches() const { return patches_; }  // coarse levels first
  std::span<const Landmark> landmarks() const { return landmarks_; }

 private:
  std::span<const Landmark> landmarks_;
  std::vector<Patch> patches_;
};

// All of one eye: u_right of the sightings is NaN, and `pixel` is where that eye sees the landmark.

// Whole pixels, everywhere within `radius` pixels (of the picture) of where the pose puts the landmark. Fine levels
// are left out where a wider radius would cost too much, and once there are enough sightings for a pose: they are found
// from that.
std::vector<Sighting> search_around(const ExpectedPatches& expected, const SE3& T_eye_keyframe,
                                    const StereoCamera& camera, const vision::Pyramid& eye, double radius);

// The same against the corners of the picture only, so that it may be wide.
std::vector<Sighting> search_corners(const ExpectedPatches& expected, const SE3& T_eye_keyframe,
                                     const StereoCamera& camera, const vision::Pyramid& eye,
                                     const std::vector<std::vector<vision::Corner>>& corners, double radius);

// Where the pose is known to a few pixels: searched within two pixels of the level and aligned to a fraction of one.
// `in_view`: how many should have been seen from there.
std::vector<Sighting> align_patches(const ExpectedPatches& expected, const SE3& T_eye_keyframe,
                                    const StereoCamera& camera, const vision::Pyramid& eye, std::size_t& in_view);

// Fills in u_right of sightings of the left eye, where the right one has them. `offset`: to be taken off disparities.
void match_right(std::span<const Landmark> landmarks, const SE3& T_camera_keyframe, const StereoCamera& camera,
                 double offset, const vision::Pyramid& left, const vision::Pyramid& right,
                 std::vector<Sighting>& sightings);

}  // namespace relmap::tracking
