// The keyframe that a robot streams (docs/method.md, 1), its bytes, and the checks it must pass. The same bytes travel
// in LCM parts and in Ingest RPCs, and stand in the journal; their CRC32C is the keyframe's.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/ids.h"
#include "proto/base/names.h"
#include "proto/base/status.h"
#include "proto/calibration/calibration.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"
#include "proto/keyframe/extensions.h"

namespace relmap {

// Of the bytes; an unknown one is UNKNOWN_PROTOCOL_VERSION. Version 1 has no extensions; a keyframe without any is
// written so, which older daemons read.
inline constexpr std::uint16_t kKeyframeVersion = 2;

inline constexpr std::size_t kMaxTracks = 1024;
inline constexpr std::size_t kMaxAppearance = 1024;
inline constexpr std::size_t kMaxKeyframePictureBytes = 48 * 1024;
inline constexpr std::size_t kMaxKeyframeBytes = 256 * 1024;
inline constexpr std::uint32_t kKeyframeMagic = 0x464b4d52;        // "RMKF": what the canonical bytes begin with
inline constexpr std::int64_t kMaxTimeUs = std::int64_t{1} << 53;  // the year 2255

// What a session is begun with. Every keyframe repeats it, so that any of them can be the first to arrive; it may not
// change within a session, but for `raw` and what this version does not know: of these the session has what its first
// keyframe said, which an older front-end may have made.
struct SessionHeader {
  SessionUuid uuid;
  std::string robot;  // for display; UTF-8, 1..64 bytes
  std::string name;
  // Rectified. Baseline 0: a mono session. Its frames are unconnected and have an appearance set and no landmarks: no
  // tracks, no disparities, every source kStart.
  StereoCamera camera;
  bool oneway = false;  // its edges may be travelled only in the direction driven
  // The camera as it takes pictures, if the front-end rectified them: whoever asks with a picture of this camera is
  // undistorted by it. Not known: the pictures came rectified, or an older front-end made the session.
  std::optional<StereoCalibration> raw;
  Extensions unknown;  // of a later version: kept as they came

  bool operator==(const SessionHeader&) const = default;
};

// Whether a session that was begun with one header may go on with another; else CALIBRATION_CHANGED. Camera and flags
// must be the same, and the raw calibration where both have one: an older front-end does not send it.
inline bool same_camera(const SessionHeader& begun, const SessionHeader& now) {
  return begun.camera == now.camera && begun.oneway == now.oneway && (!begun.raw || !now.raw || *begun.raw == *now.raw);
}

// Where the motion since the previous keyframe comes from.
enum class MotionSource : std::uint8_t {
  kStart = 0,  // first keyframe: there is no step
  kVision = 1,
  kOneEye = 2,            // vision with one eye: scale from elsewhere
  kGyro = 3,              // rotation from a gyro, translation extrapolated
  kConstantVelocity = 4,  // extrapolated
  kUnsensed = 5,          // the robot may have been carried: the camera cannot tell
};
inline constexpr int kMotionSources = 6;
inline bool is_vision(MotionSource s) { return s == MotionSource::kVision || s == MotionSource::kOneEye; }

struct TrackMeasurement {
  TrackId track;     // sequence <= this keyframe's
  float u_left = 0;  // pixels, rectified
  float v = 0;
  float u_right = 0;       // NaN: seen by the left eye only
  std::uint8_t level = 0;  // pyramid level it was measured at: pixel_sigma(level)

  StereoPixel pixel() const { return {u_left, v, u_right}; }
};

// One keypoint of the appearance set (docs/method.md, 7): detector and descriptor are those of vision/appearance.h.
struct AppearanceFeature {
  float u = 0;  // pixels, rectified left picture
  float v = 0;
  float disparity = 0;                         // pixels, u_left - u_right; NaN: none found
  float scale = 0;                             // diameter of the described region, pixels
  float angle = 0;                             // radians
  std::int16_t track = -1;                     // index into Keyframe::tracks if this is a tracked feature
  std::array<std::uint8_t, 128> descriptor{};  // SIFT
};

struct Keyframe {
  SessionHeader session;
  std::uint32_t sequence = 0;                 // FrameId::index; sequences may be missing
  std::int64_t time_us = 0;                   // UTC
  SE3 T_odom_frame;                           // pose in the session's own odometry frame
  Matrix6 step_covariance = Matrix6::Zero();  // of T_previous_this (right perturbation); zero for kStart
  MotionSource source = MotionSource::kStart;
  std::int64_t driven_us = 0;    // time since the previous keyframe spent faster than 0.05 m/s,
  std::int64_t standing_us = 0;  // and slower
  std::vector<TrackMeasurement> tracks;
  std::vector<AppearanceFeature> appearance;
  // JPEG of the rectified left picture, grey. At the camera's size, or that halved once or twice, the map finds old
  // landmarks in it; smaller it is only there to be looked at. May be empty.
  Bytes picture;
  Extensions unknown;  // of a later version: kept as they came
};

// The canonical bytes: equal keyframes give equal bytes.
Bytes encode_keyframe(const Keyframe& keyframe);

// CORRUPT, TRUNCATED, BAD_SIZE or UNKNOWN_PROTOCOL_VERSION if the bytes are no keyframe. What it returns decodes back
// to the same bytes; it has not been checked yet.
Result<Keyframe> decode_keyframe(ByteSpan bytes);

// Everything that can be said of a keyframe by itself: finite numbers, sizes, unit rotation, positive definite
// covariance, plausible calibration, names, measurements inside the picture, tracks not from the future and not twice.
// The reason is the first check that fails.
Status check_keyframe(const Keyframe& keyframe);

// Keyframes from..to (inclusive) that the robot gave up; final.
struct Gap {
  SessionUuid session;
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  Reason reason = Reason::DROPPED_BY_ROBOT;
};

}  // namespace relmap
