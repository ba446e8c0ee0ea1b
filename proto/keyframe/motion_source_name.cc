#include "proto/keyframe/motion_source_name.h"

namespace relmap {

const char* name_of(MotionSource source) {
  switch (source) {
    case MotionSource::kStart:
      return "start";
    case MotionSource::kVision:
      return "vision";
    case MotionSource::kOneEye:
      return "one eye";
    case MotionSource::kGyro:
      return "gyro";
    case MotionSource::kConstantVelocity:
      return "constant velocity";
    case MotionSource::kUnsensed:
      return "unsensed";
  }
  return "unknown";
}

}  // namespace relmap
