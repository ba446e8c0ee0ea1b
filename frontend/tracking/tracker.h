// Stereo pairs to keyframes (Sibley et al. 2010, 3.6; Mei et al., BMVC 2009).
//
// Of each pair: both pictures brought to the same exposure; a pyramid with FAST corners; the landmarks projected with
// the motion expected (constant velocity, or what the caller knows) and matched against corners; three-point RANSAC;
// matched again as 9 x 9 patches to a fraction of a pixel, in time and left to right; a robust refinement. Motion is
// estimated against the last keyframe's landmarks, not against the last picture, so that standing still does not drift.
// At a keyframe the landmarks move to its frame, take in its measurements, and new ones start where there are few.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "frontend/vision/image.h"
#include "proto/keyframe.h"

namespace relmap {

struct TrackerOptions {
  int tracks = 150;        // followed from a keyframe on, where the picture has them
  int appearance = 300;    // keypoints of a keyframe's appearance set, tracked ones included; 0: none
  bool thumbnails = true;  // a JPEG of at most kMaxThumbnailBytes
  // A keyframe when any of these is reached.
  double least_share = 0.7;  // of the last keyframe's tracks still followed
  int least_tracks = 60;     // followed
  double parallax = 0.06;    // translation over the median depth of the tracks
  double rotation = 0.17;    // radians
  int least_inliers = 15;    // fewer than that, and the pair is lost
  double lost_s = 0.5;       // lost for longer: a keyframe by constant velocity, and tracking starts again
  double pixel_sigma = 0.5;  // of a coordinate measured on level 0
};

// What became of the last pair.
struct PairReport {
  bool tracked = false;  // its pose comes from vision
  bool keyframe = false;
  int landmarks = 0;  // followed when it came
  int coarse = 0;     // agreed with the coarse motion
  int found = 0;      // patches found
  int inliers = 0;    // of them, agreed
  double rms_px = 0;  // of the inliers
  double speed = 0;   // m/s
  SE3 T_odom_frame;   // of this pair
};

class StereoTracker {
 public:
  // `session.camera` is the rectified stereo camera.
  explicit StereoTracker(SessionHeader session, TrackerOptions options = {});
  ~StereoTracker();
  StereoTracker(StereoTracker&&) noexcept;

  // Goes on after `last`, the newest keyframe of an interrupted session: sequences and odometry continue. If the next
  // pair fed is that keyframe's own (the same time), nothing is lost; otherwise the first keyframe says that the motion
  // since then was not sensed.
  void resume(const Keyframe& last);

  // Rectified pictures of the camera's size; `time_us` later than the pair before. `expected`, if the robot knows it,
  // is T_previous_this between the pairs. A keyframe, if this pair is one.
  // BAD_SIZE, TIME_BACKWARDS: the pair is ignored.
  Result<std::optional<Keyframe>> feed(ImageView left, ImageView right, std::int64_t time_us,
                                       const SE3* expected = nullptr);

  const PairReport& report() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap
