// Turns stereo pairs into keyframes (Sibley et al. 2010, 3.6; Mei et al., BMVC 2009).
//
// For each pair, the tracker estimates the rotation since the last pair from small pictures (or the gyro), projects the
// landmarks with the expected motion and searches their patches around there, runs three-point RANSAC, aligns the
// patches to a fraction of a pixel, in time and from left to right, and refines the motion robustly. Motion is
// estimated against the landmarks of the last keyframe, not against the last picture, so that a robot that stands still
// does not drift. At a keyframe the landmarks move to its frame and are updated by its measurements, and new ones start
// where there are few.
//
// When vision fails, the motion is dead-reckoned (dead_reckoning.h), and each further pair is searched for the
// landmarks. If that fails for longer than TrackerOptions::lost_s, tracking starts anew: with a keyframe whose step is
// the dead-reckoned motion with its covariance, and new landmarks.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "frontend/tracking/pair.h"
#include "proto/calibration/imu.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::tracking {

struct TrackerOptions {
  int tracks = 120;         // followed from a keyframe on, if the picture has as many corners
  bool every_pair = false;  // each pair that both eyes see becomes a keyframe
  // Otherwise a pair becomes a keyframe when one of these is reached:
  double min_share = 0.7;  // fewer than this share of the last keyframe's tracks is still followed
  int min_tracks = 60;     // fewer tracks are followed
  double parallax = 0.08;  // translation since the last keyframe / median depth of the tracks
  double rotation = 0.17;  // since the last keyframe, radians

  int min_inliers = 15;  // a pair with fewer inliers is lost
  double lost_s = 0.25;  // after this time without vision tracking starts anew, if there is something to see
  // What a robot can do. Motions beyond these limits are rejected, however many landmarks agree with them.
  double max_acceleration = 12;  // m/s^2, also of braking
  double max_speed = 60;         // m/s
  double max_turn_rate = 7;      // rad/s
};

// How tracking of the last pair went.
struct PairReport {
  bool tracked = false;   // its pose comes from vision, or it is the first pair of a session, new or resumed
  bool one_eye = false;   // tracked with one eye only
  bool repeated = false;  // the camera gave the picture of the pair before again; the pair was ignored
  bool keyframe = false;
  bool started_anew = false;
  int landmarks = 0;                              // followed before this pair
  int expected = 0;                               // landmarks that should be seen from the estimated pose
  int found = 0;                                  // patches found
  int inliers = 0;                                // patches that agree with the motion
  double rms_px = 0;                              // reprojection error of the inliers, per coordinate
  double speed = 0;                               // m/s
  Matrix3 R_previous_this = Matrix3::Identity();  // the rotation that was expected before any feature was matched
  double rotation_correlation = 0;                // of the small pictures; 0 if the rotation has another source
  double offset_px = 0;                           // disparity offset learnt so far (stereo_offset.h)
  SE3 T_odom_frame;                               // pose of this pair

  // Time spent in milliseconds.
  double features_ms = 0, rotation_ms = 0, match_ms = 0, motion_ms = 0;

  struct Track {
    float u = 0, v = 0;  // pixels
    int age = 0;         // keyframes since it started
    bool inlier = false;
  };
  std::vector<Track> tracks;  // of the landmarks that were found
};

// Not thread-safe.
class StereoTracker {
 public:
  // `session.camera` is the rectified stereo camera.
  explicit StereoTracker(SessionHeader session, TrackerOptions options = {});
  ~StereoTracker();
  StereoTracker(StereoTracker&&) noexcept;

  // Continues an interrupted session after `last`, its newest keyframe: sequences and odometry continue. If the next
  // pair is that keyframe's own (the same time), no motion is lost; otherwise the first keyframe states that the motion
  // since then was not sensed.
  void resume(const Keyframe& last);

  // Uses a gyro. `R_frame_camera` rotates from the raw left camera's axes to the rectified one's. Feed samples before
  // the pairs that they precede.
  void use_imu(const ImuCalibration& calibration, const Matrix3& R_frame_camera);
  void feed(std::span<const ImuSample> samples);

  // Limits the rate of keyframes from the next pair on. A keyframe still comes earlier if too few landmarks of the last
  // one are in sight. 0 removes the limit.
  void limit_keyframe_rate(double max_hz);

  // Tracks a pair, which must be later than the one before. `expected`, if the robot knows it, is T_previous_this
  // between the two pairs. If this pair becomes a keyframe, returns it without appearance and picture
  // (keyframe_pictures.h). BAD_SIZE, TIME_BACKWARDS; the pair is then ignored.
  Result<std::optional<Keyframe>> feed(std::shared_ptr<const Pair> pair, std::int64_t time_us,
                                       const SE3* expected = nullptr);

  const PairReport& report() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::tracking
