// Finds landmarks in a new picture.
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
  std::uint32_t landmark = 0;  // its index
  StereoPixel pixel;           // u_right is NaN if it was not found in the right picture
  float difference = 0;        // mean absolute difference of the patches, grey levels; smaller is likelier
};

// The patches of landmarks, warped to how one eye should see them from a pose. They serve all searches from about
// there.
class ExpectedPatches {
 public:
  // `T_eye_keyframe` is the pose of that eye, whose picture has `levels` pyramid levels. Landmarks that are behind the
  // eye, outside the picture, or whose patch cannot be warped, are left out.
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

// The next three functions search the picture of one eye. `pixel` of a sighting is where that eye sees the landmark,
// and u_right is NaN.

// Searches whole pixels within `radius` pixels (of the picture) of where the pose predicts the landmark. It leaves out
// levels so fine that the radius would cost too much, and all finer levels once there are enough sightings for a pose:
// align_patches() finds their landmarks from that pose.
std::vector<Sighting> search_around(const ExpectedPatches& expected, const SE3& T_eye_keyframe,
                                    const StereoCamera& camera, const vision::Pyramid& eye, double radius);

// The same among the corners of the picture only, so that the radius may be large.
std::vector<Sighting> search_corners(const ExpectedPatches& expected, const SE3& T_eye_keyframe,
                                     const StereoCamera& camera, const vision::Pyramid& eye,
                                     const std::vector<std::vector<vision::Corner>>& corners, double radius);

// For a pose that is known to a few pixels: searches within two pixels of the level and aligns to a fraction of a
// pixel. `in_view` is set to the number of landmarks that should be seen from the pose.
std::vector<Sighting> align_patches(const ExpectedPatches& expected, const SE3& T_eye_keyframe,
                                    const StereoCamera& camera, const vision::Pyramid& eye, std::size_t& in_view);

// Fills in u_right of those sightings of the left eye that the right eye sees, too. `offset` pixels are subtracted from
// measured disparities.
void match_right(std::span<const Landmark> landmarks, const SE3& T_camera_keyframe, const StereoCamera& camera,
                 double offset, const vision::Pyramid& left, const vision::Pyramid& right,
                 std::vector<Sighting>& sightings);

}  // namespace relmap::tracking
