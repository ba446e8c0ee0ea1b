// check_keyframe(): what can be judged from a keyframe alone.
#include <algorithm>
#include <cmath>
#include <vector>

#include "proto/base/names.h"
#include "proto/base/refuse.h"
#include "proto/geometry/canonical_rotation.h"
#include "proto/geometry/covariance.h"
#include "proto/keyframe/extension_codec.h"
#include "proto/keyframe/keyframe.h"

namespace relmap {

namespace {

constexpr double kMaxTranslation = 1e7;  // metres, from the odometry's origin

Status check_session(const SessionHeader& session) {
  if (session.uuid.is_nil()) return refuse(Reason::BAD_NAME, "session uuid is nil");
  if (Status s = check_name("robot name", session.robot); !s.ok()) return s;
  if (Status s = check_name("session name", session.name); !s.ok()) return s;
  if (Status s = session.camera.check_plausible(); !s.ok()) return s;
  if (!session.raw) return {};
  if (session.raw->rectified || session.raw->width == 0 || session.raw->height == 0)
    return refuse(Reason::IMPLAUSIBLE_CALIBRATION, "the session's raw calibration is rectified, or has no size");
  return session.raw->check_plausible();
}

Status check_sizes(const Keyframe& k) {
  if (k.tracks.size() > kMaxTracks) return refuse(Reason::BAD_SIZE, k.tracks.size(), " tracks; at most ", kMaxTracks);
  if (k.appearance.size() > kMaxAppearance)
    return refuse(Reason::BAD_SIZE, k.appearance.size(), " appearance features; at most ", kMaxAppearance);
  if (k.picture.size() > kMaxKeyframePictureBytes)
    return refuse(Reason::BAD_SIZE, "picture of ", k.picture.size(), " bytes; at most ", kMaxKeyframePictureBytes);
  if (Status s = check_extensions(header_extensions(k.session)); !s.ok()) return s;
  return check_extensions(k.unknown);
}

Status check_times(const Keyframe& k) {
  if (k.time_us < 0 || k.time_us > kMaxTimeUs)
    return refuse(Reason::BAD_DURATION, "time of ", k.time_us, " us; must be 0..", kMaxTimeUs);
  for (const std::int64_t duration : {k.driven_us, k.standing_us})
    if (duration < 0 || duration > kMaxTimeUs)
      return refuse(Reason::BAD_DURATION, "driven ", k.driven_us, " us, standing ", k.standing_us, " us");
  return {};
}

Status check_motion(const Keyframe& k) {
  const SE3& T = k.T_odom_frame;
  if (!T.R.allFinite() || !T.t.allFinite()) return refuse(Reason::NOT_FINITE, "odometry pose is not finite");
  if (!is_rotation(T.R)) return refuse(Reason::BAD_ROTATION, "odometry pose is no rotation");
  if (T.t.cwiseAbs().maxCoeff() > kMaxTranslation)
    return refuse(Reason::BAD_MOTION, "odometry pose ", T.t.norm(), " m from its origin");
  if (!k.step_covariance.allFinite()) return refuse(Reason::NOT_FINITE, "covariance of the step is not finite");
  if (k.source != MotionSource::kStart) return check_covariance(k.step_covariance);
  if (!k.step_covariance.isZero(0))
    return refuse(Reason::BAD_COVARIANCE, "the first keyframe has no step, but a covariance");
  return {};
}

Status check_track(const TrackMeasurement& t, const Keyframe& k) {
  const StereoCamera& camera = k.session.camera;
  const auto named = [&] { return "track " + std::to_string(t.track.sequence) + '.' + std::to_string(t.track.index); };
  if (!std::isfinite(t.u_left) || !std::isfinite(t.v) || std::isinf(t.u_right))
    return refuse(Reason::NOT_FINITE, named(), " is not finite");
  if (t.track.sequence > k.sequence) return refuse(Reason::BAD_TRACK, named(), " is from the future");
  if (t.level > kMaxPyramidLevel)
    return refuse(Reason::BAD_TRACK, named(), " at level ", int{t.level}, "; at most ", kMaxPyramidLevel);
  if (!camera.in_picture(t.u_left, t.v))
    return refuse(Reason::OUTSIDE_PICTURE, named(), " at (", t.u_left, ", ", t.v, ")");
  if (std::isnan(t.u_right)) return {};
  if (t.u_right > t.u_left)
    return refuse(Reason::OUTSIDE_PICTURE, named(), " with u_right ", t.u_right, " > u_left ", t.u_left);
  if (!camera.in_picture(t.u_right, t.v)) return refuse(Reason::OUTSIDE_PICTURE, named(), " with u_right ", t.u_right);
  return {};
}

Status check_unique(const std::vector<TrackMeasurement>& tracks) {
  std::vector<TrackId> ids;
  ids.reserve(tracks.size());
  for (const TrackMeasurement& t : tracks) ids.push_back(t.track);
  std::sort(ids.begin(), ids.end());
  const auto twice = std::adjacent_find(ids.begin(), ids.end());
  if (twice == ids.end()) return {};
  return refuse(Reason::BAD_TRACK, "track ", twice->sequence, '.', twice->index, " occurs twice in the keyframe");
}

Status check_feature(const AppearanceFeature& f, const Keyframe& k) {
  if (!std::isfinite(f.u) || !std::isfinite(f.v) || !std::isfinite(f.scale) || !std::isfinite(f.angle) ||
      std::isinf(f.disparity))
    return refuse(Reason::NOT_FINITE, "an appearance feature is not finite");
  if (!k.session.camera.in_picture(f.u, f.v))
    return refuse(Reason::OUTSIDE_PICTURE, "appearance feature at (", f.u, ", ", f.v, ")");
  if (f.disparity < 0 || f.disparity > static_cast<float>(k.session.camera.width))
    return refuse(Reason::OUTSIDE_PICTURE, "appearance feature with a disparity of ", f.disparity);
  if (!std::isnan(f.disparity) && !k.session.camera.is_stereo())
    return refuse(Reason::NOT_STEREO, "appearance feature with a disparity from a mono camera");
  if (f.scale <= 0) return refuse(Reason::BAD_SIZE, "appearance feature ", f.scale, " px wide");
  if (f.track < -1 || (f.track >= 0 && static_cast<std::size_t>(f.track) >= k.tracks.size()))
    return refuse(Reason::BAD_TRACK, "appearance feature of track ", f.track, " among ", k.tracks.size());
  return {};
}

Status check_picture(const Bytes& jpeg) {
  if (jpeg.empty()) return {};
  if (jpeg.size() < 3 || jpeg[0] != 0xff || jpeg[1] != 0xd8 || jpeg[2] != 0xff)
    return refuse(Reason::NOT_A_PICTURE, "the picture is no JPEG");
  return {};
}

}  // namespace

Status check_keyframe(const Keyframe& k) {
  for (const Status& s : {check_session(k.session), check_sizes(k), check_times(k), check_motion(k)})
    if (!s.ok()) return s;
  if (!k.session.camera.is_stereo() && !k.tracks.empty())
    return refuse(Reason::NOT_STEREO, k.tracks.size(), " tracks: landmarks need metres, and a mono session has none");
  for (const TrackMeasurement& t : k.tracks)
    if (Status s = check_track(t, k); !s.ok()) return s;
  if (Status s = check_unique(k.tracks); !s.ok()) return s;
  for (const AppearanceFeature& f : k.appearance)
    if (Status s = check_feature(f, k); !s.ok()) return s;
  return check_picture(k.picture);
}

}  // namespace relmap
