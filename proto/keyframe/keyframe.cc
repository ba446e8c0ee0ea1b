#include "proto/keyframe/keyframe.h"

#include <cassert>
#include <cmath>
#include <limits>
#include <string>

#include "proto/geometry/canonical_rotation.h"
#include "proto/geometry/covariance.h"
#include "proto/keyframe/extension_codec.h"

namespace relmap {

namespace {

constexpr std::uint16_t kWithoutExtensions = 1;  // the version
constexpr std::uint8_t kOneway = 1;              // the only flag
constexpr std::size_t kTrackBytes = 4 + 4 + 3 * 4 + 1;
constexpr std::size_t kFeatureBytes = 5 * 4 + 2 + 128;

// Every NaN is written as the same one, so that equal keyframes give equal bytes.
float canonical(float value) { return std::isnan(value) ? std::numeric_limits<float>::quiet_NaN() : value; }

void put_header(ByteWriter& out, const SessionHeader& session) {
  out.put_array(session.uuid.bytes.data(), session.uuid.bytes.size());
  out.put_string(session.robot);
  out.put_string(session.name);
  const StereoCamera& c = session.camera;
  for (const double value : {c.f, c.cx, c.cy, c.baseline}) out.put(value);
  out.put(static_cast<std::int32_t>(c.width));
  out.put(static_cast<std::int32_t>(c.height));
}

SessionHeader get_header(ByteReader& in) {
  SessionHeader session;
  in.get_array(session.uuid.bytes.data(), session.uuid.bytes.size());
  session.robot = in.get_string();
  session.name = in.get_string();
  StereoCamera& c = session.camera;
  for (double* value : {&c.f, &c.cx, &c.cy, &c.baseline}) *value = in.get<double>();
  c.width = in.get<std::int32_t>();
  c.height = in.get<std::int32_t>();
  return session;
}

void put_motion(ByteWriter& out, const Keyframe& k) {
  const QuaternionWxyz q = canonical_quaternion(k.T_odom_frame.R);
  out.put_array(q.data(), q.size());
  out.put_array(k.T_odom_frame.t.data(), 3);
  const UpperTriangle covariance = upper_triangle(k.step_covariance);
  out.put_array(covariance.data(), covariance.size());
  out.put(k.driven_us);
  out.put(k.standing_us);
}

void get_motion(ByteReader& in, Keyframe& k) {
  QuaternionWxyz q;
  in.get_array(q.data(), q.size());
  k.T_odom_frame.R = rotation_of(q);
  in.get_array(k.T_odom_frame.t.data(), 3);
  UpperTriangle covariance;
  in.get_array(covariance.data(), covariance.size());
  k.step_covariance = from_upper_triangle(covariance);
  k.driven_us = in.get<std::int64_t>();
  k.standing_us = in.get<std::int64_t>();
}

void put_track(ByteWriter& out, const TrackMeasurement& t) {
  out.put(t.track.sequence);
  out.put(t.track.index);
  out.put(t.u_left);
  out.put(t.v);
  out.put(canonical(t.u_right));
  out.put(t.level);
}

TrackMeasurement get_track(ByteReader& in) {
  TrackMeasurement t;
  t.track.sequence = in.get<std::uint32_t>();
  t.track.index = in.get<std::uint32_t>();
  t.u_left = in.get<float>();
  t.v = in.get<float>();
  t.u_right = in.get<float>();
  t.level = in.get<std::uint8_t>();
  return t;
}

void put_feature(ByteWriter& out, const AppearanceFeature& f) {
  out.put(f.u);
  out.put(f.v);
  out.put(canonical(f.disparity));
  out.put(f.scale);
  out.put(f.angle);
  out.put(f.track);
  out.put_array(f.descriptor.data(), f.descriptor.size());
}

AppearanceFeature get_feature(ByteReader& in) {
  AppearanceFeature f;
  f.u = in.get<float>();
  f.v = in.get<float>();
  f.disparity = in.get<float>();
  f.scale = in.get<float>();
  f.angle = in.get<float>();
  f.track = in.get<std::int16_t>();
  in.get_array(f.descriptor.data(), f.descriptor.size());
  return f;
}

Status get_extensions(ByteReader& in, Keyframe& k) {
  auto of_header = read_extensions(in);
  if (!of_header.ok()) return of_header.status();
  auto of_keyframe = read_extensions(in);
  if (!of_keyframe.ok()) return of_keyframe.status();
  if (of_header->empty() && of_keyframe->empty())
    return {Reason::CORRUPT, "a keyframe of version 2 without extensions; it must be written as version 1"};
  if (!set_header_extensions(k.session, std::move(*of_header)))
    return {Reason::CORRUPT, "the session's raw calibration is malformed"};
  k.unknown = std::move(*of_keyframe);
  return {};
}

Status over_limit(const char* what, std::size_t count, std::size_t limit) {
  return {Reason::BAD_SIZE, std::to_string(count) + ' ' + what + "; at most " + std::to_string(limit)};
}

Status cut_short(const ByteReader& in, ByteSpan bytes) {
  return {Reason::TRUNCATED,
          "keyframe of " + std::to_string(bytes.size()) + " bytes ends early, after " + std::to_string(in.position())};
}

}  // namespace

Bytes encode_keyframe(const Keyframe& k) {
  const Extensions of_header = header_extensions(k.session);
  const bool extended = !of_header.empty() || !k.unknown.empty();
  assert(k.tracks.size() <= kMaxTracks && k.appearance.size() <= kMaxAppearance &&
         k.picture.size() <= kMaxKeyframePictureBytes);
  ByteWriter out;
  out.reserve(512 + k.tracks.size() * kTrackBytes + k.appearance.size() * kFeatureBytes + k.picture.size());
  out.put(kKeyframeMagic);
  out.put(extended ? kKeyframeVersion : kWithoutExtensions);
  out.put(static_cast<std::uint8_t>(k.session.oneway ? kOneway : 0));
  out.put(k.source);
  put_header(out, k.session);
  out.put(k.sequence);
  out.put(k.time_us);
  put_motion(out, k);
  out.put(static_cast<std::uint16_t>(k.tracks.size()));
  out.put(static_cast<std::uint16_t>(k.appearance.size()));
  out.put(static_cast<std::uint16_t>(k.picture.size()));
  for (const TrackMeasurement& t : k.tracks) put_track(out, t);
  for (const AppearanceFeature& f : k.appearance) put_feature(out, f);
  out.put_bytes(k.picture);
  if (extended) {
    put_extensions(out, of_header);
    put_extensions(out, k.unknown);
  }
  return out.take();
}

Result<Keyframe> decode_keyframe(ByteSpan bytes) {
  if (bytes.size() > kMaxKeyframeBytes) return over_limit("bytes of keyframe", bytes.size(), kMaxKeyframeBytes);
  ByteReader in(bytes);
  const auto magic = in.get<std::uint32_t>();
  const auto version = in.get<std::uint16_t>();
  if (!in.ok()) return cut_short(in, bytes);
  if (magic != kKeyframeMagic) return {Reason::CORRUPT, "the bytes are no keyframe"};
  if (version < kWithoutExtensions || version > kKeyframeVersion)
    return {Reason::UNKNOWN_PROTOCOL_VERSION,
            "keyframe of version " + std::to_string(version) + "; known: up to " + std::to_string(kKeyframeVersion)};
  Keyframe k;
  const auto flags = in.get<std::uint8_t>();
  const auto source = in.get<std::uint8_t>();
  k.session = get_header(in);
  k.sequence = in.get<std::uint32_t>();
  k.time_us = in.get<std::int64_t>();
  get_motion(in, k);
  const std::size_t tracks = in.get<std::uint16_t>();
  const std::size_t features = in.get<std::uint16_t>();
  const std::size_t picture_bytes = in.get<std::uint16_t>();
  if (!in.ok()) return cut_short(in, bytes);
  if (flags & ~kOneway) return {Reason::CORRUPT, "unknown flags " + std::to_string(flags)};
  if (source >= kMotionSources) return {Reason::CORRUPT, "unknown source of motion " + std::to_string(source)};
  k.session.oneway = flags & kOneway;
  k.source = static_cast<MotionSource>(source);
  if (tracks > kMaxTracks) return over_limit("tracks", tracks, kMaxTracks);
  if (features > kMaxAppearance) return over_limit("appearance features", features, kMaxAppearance);
  if (picture_bytes > kMaxKeyframePictureBytes)
    return over_limit("bytes of picture", picture_bytes, kMaxKeyframePictureBytes);

  if (!in.fits(tracks, kTrackBytes)) return cut_short(in, bytes);
  k.tracks.reserve(tracks);
  for (std::size_t i = 0; i < tracks; ++i) k.tracks.push_back(get_track(in));
  if (!in.fits(features, kFeatureBytes)) return cut_short(in, bytes);
  k.appearance.reserve(features);
  for (std::size_t i = 0; i < features; ++i) k.appearance.push_back(get_feature(in));
  const ByteSpan picture = in.get_bytes(picture_bytes);
  k.picture.assign(picture.begin(), picture.end());
  if (!in.ok()) return cut_short(in, bytes);
  if (version > kWithoutExtensions)
    if (Status status = get_extensions(in, k); !status.ok()) return status;
  if (!in.at_end()) return {Reason::CORRUPT, std::to_string(in.remaining()) + " bytes after the keyframe's end"};
  return k;
}

}  // namespace relmap
