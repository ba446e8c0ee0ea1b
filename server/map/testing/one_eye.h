// Turns a stereo keyframe into one of a mono session. For tests.
#pragma once

#include <limits>
#include <utility>

#include "proto/keyframe/keyframe.h"

namespace relmap::map {

inline Keyframe with_one_eye(Keyframe keyframe) {
  keyframe.session.uuid.bytes[0] ^= 0x80;
  keyframe.session.name += ", one eye";
  keyframe.session.camera.baseline = 0;
  keyframe.T_odom_frame = {};
  keyframe.step_covariance.setZero();
  keyframe.source = MotionSource::kStart;
  keyframe.driven_us = keyframe.standing_us = 0;
  keyframe.tracks.clear();
  for (AppearanceFeature& feature : keyframe.appearance) {
    feature.disparity = std::numeric_limits<float>::quiet_NaN();
    feature.track = -1;
  }
  return keyframe;
}

}  // namespace relmap::map
