// The keyframe that a robot streams (docs/method.md, 1), its encoding, and the checks that it must pass. The same bytes
// are sent in LCM parts and in Ingest RPCs and written to the journal; their CRC32C is the checksum of the keyframe.
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

// Version of the encoding. Version 1 has no extensions; a keyframe without extensions is written as version 1, so that
// older daemons can read it.
inline constexpr std::uint16_t kKeyframeVersion = 2;

inline constexpr std::size_t kMaxTracks = 1024;
inline constexpr std::size_t kMaxAppearance = 1024;
inline constexpr std::size_t kMaxKeyframePictureBytes = 48 * 1024;
inline constexpr std::size_t kMaxKeyframeBytes = 256 * 1024;
inline constexpr std::uint32_t kKeyframeMagic = 0x464b4d52;        // the first four bytes, "RMKF"
inline constexpr std::int64_t kMaxTimeUs = std::int64_t{1} << 53;  // the year 2255

// What a session begins with. Every keyframe repeats it, so that any of them can be the first to arrive. It must not
// change within a session, except that `raw` may be absent and `unknown` may differ, since front-ends of several
// versions may contribute; the session has those of its first keyframe.
struct SessionHeader {
  SessionUuid uuid;
  std::string robot;  // for display; UTF-8, 1..64 bytes
  std::string name;
  // Rectified. A session with baseline 0 is mono: its frames are not connected and have appearance but no landmarks, so
  // its keyframes have no tracks and no disparities, and their source is kStart.
  StereoCamera camera;
  bool oneway = false;  // its edges may be travelled only in the direction driven
  // The camera before rectification, if the front-end rectified the pictures. Pictures of this camera in queries are
  // rectified by it. Absent if the pictures came rectified, or an older front-end made the session.
  std::optional<StereoCalibration> raw;
  Extensions unknown;  // of a later version: kept as received

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
  kOneEye = 2,            // vision with one eye: the scale is not measured by it
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
  float u_right = 0;       // NaN if only the left eye sees it
  std::uint8_t level = 0;  // pyramid level at which it was measured: sigma is pixel_sigma(level)

  StereoPixel pixel() const { return {u_left, v, u_right}; }
};

// One feature of a keyframe's appearance (docs/method.md, 7). frontend/vision/appearance.h has the detector and the
// descriptor.
struct AppearanceFeature {
  float u = 0;  // pixels, rectified left picture
  float v = 0;
  float disparity = 0;                         // pixels, u_left - u_right; NaN if there is none
  float scale = 0;                             // diameter of the described region, pixels
  float angle = 0;                             // radians
  std::int16_t track = -1;                     // index into Keyframe::tracks if this is a tracked feature
  std::array<std::uint8_t, 128> descriptor{};  // SIFT
};

struct Keyframe {
  SessionHeader session;
  std::uint32_t sequence = 0;                 // FrameId::index; there may be gaps
  std::int64_t time_us = 0;                   // UTC
  SE3 T_odom_frame;                           // pose in the session's own odometry frame
  Matrix6 step_covariance = Matrix6::Zero();  // of T_previous_this, right perturbation; zero for kStart
  MotionSource source = MotionSource::kStart;
  std::int64_t driven_us = 0;    // time since the previous keyframe spent faster than 0.05 m/s,
  std::int64_t standing_us = 0;  // and slower
  std::vector<TrackMeasurement> tracks;
  std::vector<AppearanceFeature> appearance;
  // Grey JPEG of the rectified left picture; may be empty. If it has the camera's size, or that halved once or twice,
  // the map finds old landmarks in it; at other sizes it is only for display.
  Bytes picture;
  Extensions unknown;  // of a later version: kept as received
};

// Equal keyframes give equal bytes.
Bytes encode_keyframe(const Keyframe& keyframe);

// CORRUPT, TRUNCATED, BAD_SIZE or UNKNOWN_PROTOCOL_VERSION if the bytes are no keyframe. Encoding what was decoded from
// encode_keyframe()'s bytes gives the same bytes. The result still has to pass check_keyframe().
Result<Keyframe> decode_keyframe(ByteSpan bytes);

// Checks all that can be judged from the keyframe alone: finite numbers, sizes, times, unit rotation, positive definite
// covariance, plausible calibration, names, measurements inside the picture, no tracks from the future and none twice.
// Returns the reason of the first check that fails.
Status check_keyframe(const Keyframe& keyframe);

// Keyframes from..to (inclusive) that the robot gave up and will never send.
struct Gap {
  SessionUuid session;
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  Reason reason = Reason::DROPPED_BY_ROBOT;
};

}  // namespace relmap
