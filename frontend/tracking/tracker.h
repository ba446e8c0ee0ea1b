// Stereo pairs to keyframes (Sibley et al. 2010, 3.6; Mei et al., BMVC 2009).
//
// Of each pair: the rotation since the last pair from small pictures (or the gyro); the landmarks projected with the
// motion expected and their patches searched round there; three-point RANSAC; aligned to a fraction of a pixel, in time
// and left to right; a robust refinement. Motion is estimated against the last keyframe's landmarks, not against the
// last picture, so that standing still does not drift. At a keyframe the landmarks move to its frame, take in its
// measurements, and new ones start where there are few.
//
// Where vision fails, the motion is dead-reckoned (dead_reckoning.h), and tracking tries each pair to find its
// landmarks again; where it cannot, it starts anew behind a keyframe whose step is that guess, with its covariance.
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
  int tracks = 120;         // followed from a keyframe on, where the picture has them
  bool every_pair = false;  // that both eyes see becomes a keyframe; else when any of these is reached:
  double min_share = 0.7;   // of the last keyframe's tracks still followed
  int min_tracks = 60;      // followed
  double parallax = 0.08;   // translation over the median depth of the tracks
  double rotation = 0.17;   // radians
  int min_inliers = 15;     // fewer than that, and the pair is lost
  double lost_s = 0.25;     // lost for longer, and there is something to see: tracking starts anew
  // What a robot can do; motions beyond are not believed, however many landmarks agree with them.
  double hardest_brake = 12;  // m/s^2
  double fastest = 60;        // m/s
  double fastest_turn = 7;    // rad/s
};

// What became of the last pair.
struct PairReport {
  bool tracked = false;   // its pose comes from vision, or is where a session begins or goes on
  bool one_eye = false;   // of one eye
  bool repeated = false;  // the picture is that of the pair before: the camera gave it twice, and it was left out
  bool keyframe = false;
  bool started_anew = false;
  int landmarks = 0;                              // followed when it came
  int expected = 0;                               // of them, that should be seen from the pose found
  int found = 0;                                  // patches found
  int inliers = 0;                                // of them, agreed
  double rms_px = 0;                              // of the inliers, a coordinate
  double speed = 0;                               // m/s
  Matrix3 R_previous_this = Matrix3::Identity();  // the rotation expected before any feature was matched
  double rotation_correlation = 0;                // of the small pictures; 0: it comes from elsewhere
  double offset_px = 0;                           // between the eyes, as learnt so far (stereo_offset.h)
  SE3 T_odom_frame;                               // of this pair

  // Milliseconds spent.
  double features_ms = 0, rotation_ms = 0, match_ms = 0, motion_ms = 0;

  struct Track {
    float u = 0, v = 0;  // pixels
    int age = 0;         // keyframes since it started
    bool inlier = false;
  };
  std::vector<Track> tracks;  // those found
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

  // There is a gyro; `R_frame_camera` turns the raw left camera's axes into the rectified one's. Samples are to be
  // given before the pairs they precede.
  void use_imu(const ImuCalibration& calibration, const Matrix3& R_frame_camera);
  void feed(std::span<const ImuSample> samples);

  // From the next pair on keyframes are put off to be no more than so many a second, as long as enough of the last one
  // is in sight. 0: they are not.
  void at_most(double keyframes_hz);

  // `time_us` later than the pair before. `expected`, if the robot knows it, is T_previous_this between the pairs. A
  // keyframe, if this pair is one, without appearance and picture (keyframe_pictures.h).
  // BAD_SIZE, TIME_BACKWARDS: the pair is ignored.
  Result<std::optional<Keyframe>> feed(std::shared_ptr<const Pair> pair, std::int64_t time_us,
                                       const SE3* expected = nullptr);

  const PairReport& report() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::tracking
