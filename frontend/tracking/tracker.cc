#include "frontend/tracking/tracker.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "frontend/tracking/keyframe_pictures.h"
#include "frontend/tracking/landmark.h"
#include "frontend/tracking/matching.h"
#include "frontend/tracking/new_landmarks.h"
#include "frontend/tracking/recovery.h"
#include "frontend/tracking/speedometer.h"

namespace relmap {

namespace {

constexpr double kNearRadius = 0.06;        // of the picture's width: searched round an expected place
constexpr double kFarRadius = 0.22;         // where nothing is known of the motion
constexpr double kCoarseSigma = 1.5;        // pixels of the level: corners jump about
constexpr int kMaxMissed = 2;               // pairs without a landmark before it is dropped
constexpr double kLongestPrediction = 0.5;  // seconds that a velocity is believed
constexpr double kForgetting = 0.15;        // pixels added to a landmark's uncertainty at each keyframe
constexpr double kLeastSeen = 0.3;          // of the landmarks that a pose would show
constexpr double kAnchorScale = 1.25;       // larger changes of size make a new anchor
constexpr double kAnchorTurn = 0.2;         // radians, likewise

double seconds(std::int64_t us) { return 1e-6 * static_cast<double>(us); }

double median(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Found in a pair and agreed with its motion.
struct Tracked {
  Motion motion;
  std::vector<Sighting> sightings;
};

}  // namespace

struct StereoTracker::Impl {
  SessionHeader session;
  TrackerOptions options;
  const StereoCamera camera;
  CornerDetector detector;
  Speedometer speedometer;
  PairReport report;

  std::vector<Landmark> landmarks;         // in the last keyframe's frame
  std::vector<DescribedPoint> remembered;  // of the last keyframe, in case the landmarks are lost
  std::uint32_t next_sequence = 0;
  std::optional<std::int64_t> keyframe_us;  // of the last keyframe
  std::optional<std::int64_t> resumed_us;   // until the first pair after resume()
  SE3 T_odom_keyframe;
  std::size_t tracks_at_keyframe = 0;

  std::optional<std::int64_t> pair_us;
  SE3 T_keyframe_pair;
  std::optional<Vector6> velocity;  // of the camera, per second
  std::int64_t tracked_us = 0;      // the last pair that was tracked
  Matrix6 tracked_covariance = Matrix6::Zero();
  std::uint64_t pairs = 0;

  Impl(SessionHeader header, TrackerOptions given)
      : session(std::move(header)), options(given), camera(session.camera) {}

  Pair prepare(ImageView left, ImageView right) {
    Pair pair;
    pair.left = Pyramid(left);
    pair.right = Pyramid(equalise(right, left));
    pair.corners = detector.detect(pair.left);
    return pair;
  }

  std::optional<Motion> solve(const std::vector<Sighting>& sightings, double sigma, const SE3& T_keyframe_guess,
                              int least) const {
    std::vector<Correspondence> correspondences;
    correspondences.reserve(sightings.size());
    for (const Sighting& s : sightings) {
      const Landmark& landmark = landmarks[s.landmark];
      correspondences.push_back({landmark.point, s.pixel, sigma * pixel_sigma(landmark.level), landmark.covariance});
    }
    MotionOptions motion_options;
    motion_options.seed = pairs;
    motion_options.min_inliers = least;
    auto motion = estimate_motion(correspondences, camera, motion_options, &T_keyframe_guess);
    if (!motion.ok()) return std::nullopt;
    return std::move(*motion);
  }

  // From a guess of the pose to what the patches say.
  std::optional<Tracked> track_from(const Pair& pair, const SE3& T_keyframe_guess, double radius) {
    const auto coarse = match_corners(landmarks, T_keyframe_guess.inverse(), camera, pair, radius * camera.width);
    report.coarse = 0;
    SE3 T = T_keyframe_guess;
    if (const auto motion = solve(coarse, kCoarseSigma, T, options.least_inliers)) {
      report.coarse = static_cast<int>(motion->inliers.size());
      T = motion->T_reference_camera;
    }
    std::optional<Tracked> tracked;
    // What was searched too far off at first is found from the better pose.
    for (int round = 0; round < 2; ++round) {
      std::size_t expected = 0;
      auto sightings = match_patches(landmarks, T.inverse(), camera, pair, expected);
      report.found = std::max(round == 0 ? 0 : report.found, static_cast<int>(sightings.size()));
      auto motion = solve(sightings, options.pixel_sigma, T, options.least_inliers);
      if (!motion) break;
      // From a wrong pose chance likenesses are found too, but few of those that should be seen.
      if (static_cast<double>(motion->inliers.size()) < kLeastSeen * static_cast<double>(expected)) break;
      T = motion->T_reference_camera;
      Tracked next;
      for (const std::uint32_t i : motion->inliers) next.sightings.push_back(sightings[i]);
      next.motion = std::move(*motion);
      const bool enough = 10 * next.sightings.size() >= 9 * landmarks.size();
      if (!tracked || next.sightings.size() >= tracked->sightings.size()) tracked = std::move(next);
      if (enough) break;
    }
    return tracked;
  }

  // By descriptors, and from there by patches where they are still there.
  std::optional<Tracked> recover(const Pair& pair) {
    if (remembered.empty()) return std::nullopt;
    auto motion = motion_by_appearance(remembered, pair.left.level(0), camera, pairs);
    if (!motion.ok()) return std::nullopt;
    if (auto tracked = track_from(pair, motion->T_reference_camera, kNearRadius)) return tracked;
    return Tracked{std::move(*motion), {}};
  }

  std::optional<Tracked> track(const Pair& pair, const SE3& T_keyframe_expected, bool motion_known) {
    std::optional<Tracked> best;
    const auto better = [&](std::optional<Tracked> other) {
      if (other && (!best || other->sightings.size() > best->sightings.size())) best = std::move(other);
      return best && 4 * best->sightings.size() >= landmarks.size();
    };
    if (motion_known && better(track_from(pair, T_keyframe_expected, kNearRadius))) return best;
    if (better(track_from(pair, T_keyframe_expected, kFarRadius))) return best;
    if (motion_known) better(track_from(pair, T_keyframe_pair, kFarRadius));
    if (!best) best = recover(pair);
    return best;
  }

  SE3 expect(double dt, const SE3* expected) const {
    if (expected) return T_keyframe_pair * *expected;
    if (velocity && dt <= kLongestPrediction) return T_keyframe_pair * SE3::exp(*velocity * dt);
    return T_keyframe_pair;
  }

  // Counts who was found; who is missed too often is dropped. Sightings keep pointing at the right landmarks.
  void note(std::vector<Sighting>& sightings) {
    std::vector<char> seen(landmarks.size(), 0);
    for (const Sighting& s : sightings) seen[s.landmark] = 1;
    std::vector<std::uint32_t> moved(landmarks.size());
    std::size_t kept = 0;
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      landmarks[i].missed = seen[i] ? 0 : landmarks[i].missed + 1;
      if (landmarks[i].missed > kMaxMissed) continue;
      moved[i] = static_cast<std::uint32_t>(kept);
      if (kept != i) landmarks[kept] = std::move(landmarks[i]);
      ++kept;
    }
    landmarks.resize(kept);
    for (Sighting& s : sightings) s.landmark = moved[s.landmark];
  }

  bool keyframe_due(const std::vector<Sighting>& sightings) const {
    const auto count = static_cast<double>(sightings.size());
    if (count < options.least_share * static_cast<double>(tracks_at_keyframe) || count < options.least_tracks)
      return T_keyframe_pair.t.norm() > 0.02 || rotation_angle(T_keyframe_pair.R) > 0.01 ||
             count < 0.5 * options.least_tracks;
    if (rotation_angle(T_keyframe_pair.R) > options.rotation) return true;
    std::vector<double> depths;
    for (const Sighting& s : sightings) depths.push_back(landmarks[s.landmark].point.z());
    return T_keyframe_pair.t.norm() > options.parallax * median(depths);
  }

  // The landmarks into the frame of the pair just tracked, which becomes the last keyframe; its measurements join.
  void rebase(const Pair& pair, std::vector<Sighting>& sightings) {
    const SE3 T_new_old = T_keyframe_pair.inverse();
    for (Landmark& landmark : landmarks) {
      landmark.point = T_new_old * landmark.point;
      landmark.covariance = (T_new_old.R * landmark.covariance * T_new_old.R.transpose()).eval();
      landmark.R_anchor_keyframe *= T_keyframe_pair.R;
    }
    for (const Sighting& s : sightings) {
      Landmark& landmark = landmarks[s.landmark];
      StereoEstimate estimate = to_pixels(camera, landmark.point, landmark.covariance);
      const double forgetting = kForgetting * pixel_sigma(landmark.level);
      estimate.covariance.diagonal().array() += forgetting * forgetting;
      if (estimate.pixel.x() > estimate.pixel.z()) {
        Vector3 point;
        Matrix3 covariance;
        from_pixels(camera, estimate, point, covariance);
        if (join_measurement(camera, s.pixel, options.pixel_sigma * pixel_sigma(landmark.level), point, covariance)) {
          landmark.point = point;
          landmark.covariance = covariance;
        }
      }
      const double scale = landmark.point.z() / landmark.anchor_depth;
      if (scale > kAnchorScale || scale * kAnchorScale < 1 || rotation_angle(landmark.R_anchor_keyframe) > kAnchorTurn)
        landmark.take_anchor(pair.left.level(landmark.level), to_level(static_cast<float>(s.pixel.x()), landmark.level),
                             to_level(static_cast<float>(s.pixel.y()), landmark.level), SE3());
    }
    // What has come too near or fallen behind is not measured any more, and dropped with the next pair.
    const auto passed = [](const Landmark& landmark) { return landmark.point.z() < 0.1; };
    std::erase_if(sightings, [&](const Sighting& s) { return passed(landmarks[s.landmark]); });
    for (Landmark& landmark : landmarks)
      if (passed(landmark)) landmark.missed = kMaxMissed;
  }

  std::vector<TrackMeasurement> measurements(std::vector<Sighting> sightings) {
    std::vector<TrackMeasurement> tracks;
    for (const Sighting& s : sightings) {
      Landmark& landmark = landmarks[s.landmark];
      if (tracks.size() >= kMaxTracks) break;
      if (!landmark.track) landmark.track = TrackId{next_sequence, static_cast<std::uint32_t>(tracks.size())};
      const bool right = !is_mono(s.pixel) && s.pixel.z() <= s.pixel.x() && s.pixel.z() >= 0;
      tracks.push_back({*landmark.track, static_cast<float>(s.pixel.x()), static_cast<float>(s.pixel.y()),
                        static_cast<float>(right ? s.pixel.z() : kNoRight), static_cast<std::uint8_t>(landmark.level)});
    }
    return tracks;
  }

  // Fills up the landmarks; returns the sightings of old and new.
  std::vector<Sighting> replenish(const Pair& pair, std::vector<Sighting> sightings) {
    std::vector<PicturePoint> taken;
    for (const Sighting& s : sightings)
      taken.push_back({static_cast<float>(s.pixel.x()), static_cast<float>(s.pixel.y())});
    for (NewLandmark& made : start_landmarks(pair, camera, taken, options.tracks, options.pixel_sigma)) {
      sightings.push_back({static_cast<std::uint32_t>(landmarks.size()), made.pixel});
      landmarks.push_back(std::move(made.landmark));
    }
    return sightings;
  }

  // The pair becomes the frame that motion is measured from.
  void settle_on(std::int64_t time_us, std::size_t tracks) {
    T_odom_keyframe = (T_odom_keyframe * T_keyframe_pair).normalized();
    T_keyframe_pair = SE3();
    tracked_covariance.setZero();
    tracks_at_keyframe = tracks;
    keyframe_us = time_us;
    tracked_us = time_us;
  }

  Keyframe make_keyframe(ImageView left, const Pair& pair, std::vector<Sighting> sightings, MotionSource source,
                         const Matrix6& covariance, std::int64_t time_us) {
    Keyframe keyframe;
    keyframe.session = session;
    keyframe.sequence = next_sequence;
    keyframe.time_us = time_us;
    keyframe.source = source;
    keyframe.step_covariance = covariance;
    if (source == MotionSource::kVision) rebase(pair, sightings);
    sightings = replenish(pair, std::move(sightings));
    keyframe.tracks = measurements(std::move(sightings));
    if (source != MotionSource::kStart) {
      keyframe.driven_us = speedometer.driven_us();
      keyframe.standing_us = speedometer.standing_us();
    }
    speedometer.restart();
    settle_on(time_us, keyframe.tracks.size());
    keyframe.T_odom_frame = T_odom_keyframe;
    if (options.appearance > 0)
      keyframe.appearance = appearance_set(left, pair, camera, keyframe.tracks, options.appearance);
    if (options.thumbnails) keyframe.thumbnail = make_thumbnail(left);
    remembered = described_points(keyframe, options.pixel_sigma);
    ++next_sequence;
    report.keyframe = true;
    return keyframe;
  }

  // What is not known after `dt` seconds without eyes.
  Matrix6 blind_covariance(double dt) const {
    const double speed = velocity ? velocity->head<3>().norm() : 1.0;
    const double turn = velocity ? velocity->tail<3>().norm() : 0.5;
    const double metres = 0.05 + 0.5 * speed * dt + 0.5 * dt * dt;
    const double radians = 0.02 + 0.5 * turn * dt + 0.2 * dt * dt;
    Matrix6 covariance = Matrix6::Zero();
    covariance.diagonal().head<3>().setConstant(metres * metres);
    covariance.diagonal().tail<3>().setConstant(radians * radians);
    return covariance;
  }

  std::optional<Keyframe> first_pair(ImageView left, const Pair& pair, std::int64_t time_us) {
    if (resumed_us && *resumed_us == time_us) {
      // The last keyframe's own pair: its landmarks again, published with the next keyframe.
      const auto sightings = replenish(pair, {});
      settle_on(time_us, sightings.size());
      return std::nullopt;
    }
    if (!resumed_us) return make_keyframe(left, pair, {}, MotionSource::kStart, Matrix6::Zero(), time_us);
    const double dt = seconds(time_us - *resumed_us);
    speedometer.restart();
    auto keyframe =
        make_keyframe(left, pair, {}, MotionSource::kUnsensed, blind_covariance(std::min(dt, 60.0)), time_us);
    keyframe.standing_us = time_us - *resumed_us;
    return keyframe;
  }

  std::optional<Keyframe> next_pair(ImageView left, const Pair& pair, std::int64_t time_us, const SE3* expected) {
    const double dt = seconds(time_us - *pair_us);
    const SE3 T_expected = expect(dt, expected);
    const bool motion_known = expected || (velocity && dt <= kLongestPrediction);
    report.landmarks = static_cast<int>(landmarks.size());
    auto tracked = track(pair, T_expected, motion_known);
    report.tracked = tracked.has_value();
    if (tracked) {
      velocity = Vector6((T_keyframe_pair.inverse() * tracked->motion.T_reference_camera).log() / dt);
      T_keyframe_pair = tracked->motion.T_reference_camera;
      tracked_covariance = tracked->motion.covariance;
      tracked_us = time_us;
      report.inliers = static_cast<int>(tracked->motion.inliers.size());
      report.rms_px = tracked->motion.rms_px;
    } else {
      T_keyframe_pair = T_expected;
    }
    speedometer.add(time_us, (T_odom_keyframe * T_keyframe_pair).t);
    if (tracked) {
      note(tracked->sightings);
      if (!keyframe_due(tracked->sightings)) return std::nullopt;
      return make_keyframe(left, pair, std::move(tracked->sightings), MotionSource::kVision, tracked_covariance,
                           time_us);
    }
    if (seconds(time_us - tracked_us) < options.lost_s) return std::nullopt;
    // Lost: start again from here, if there is anything to see.
    const Matrix6 covariance = tracked_covariance + blind_covariance(seconds(time_us - tracked_us));
    landmarks.clear();
    auto sightings = replenish(pair, {});
    if (sightings.size() < static_cast<std::size_t>(options.least_inliers)) return std::nullopt;
    return make_keyframe(left, pair, std::move(sightings), MotionSource::kConstantVelocity, covariance, time_us);
  }
};

StereoTracker::StereoTracker(SessionHeader session, TrackerOptions options)
    : impl_(std::make_unique<Impl>(std::move(session), options)) {}
StereoTracker::~StereoTracker() = default;
StereoTracker::StereoTracker(StereoTracker&&) noexcept = default;

void StereoTracker::resume(const Keyframe& last) {
  impl_->session = last.session;
  impl_->next_sequence = last.sequence + 1;
  impl_->T_odom_keyframe = last.T_odom_frame;
  impl_->resumed_us = last.time_us;
}

Result<std::optional<Keyframe>> StereoTracker::feed(ImageView left, ImageView right, std::int64_t time_us,
                                                    const SE3* expected) {
  Impl& self = *impl_;
  for (const ImageView& picture : {left, right})
    if (picture.width != self.camera.width || picture.height != self.camera.height)
      return {Reason::BAD_SIZE, "a picture of " + std::to_string(picture.width) + " x " +
                                    std::to_string(picture.height) + " from a camera of " +
                                    std::to_string(self.camera.width) + " x " + std::to_string(self.camera.height)};
  const auto earlier = self.pair_us ? self.pair_us : self.resumed_us;
  const bool own_pair = !self.pair_us && self.resumed_us == time_us;
  if (earlier && time_us <= *earlier && !own_pair)
    return {Reason::TIME_BACKWARDS, std::to_string(time_us) + " us after " + std::to_string(*earlier) + " us"};

  self.report = {};
  ++self.pairs;
  const Pair pair = self.prepare(left, right);
  std::optional<Keyframe> keyframe;
  if (self.pair_us) {
    keyframe = self.next_pair(left, pair, time_us, expected);
  } else {
    keyframe = self.first_pair(left, pair, time_us);
    self.speedometer.add(time_us, self.T_odom_keyframe.t);
  }
  self.pair_us = time_us;
  self.report.speed = self.speedometer.speed();
  self.report.T_odom_frame = self.T_odom_keyframe * self.T_keyframe_pair;
  return keyframe;
}

const PairReport& StereoTracker::report() const { return impl_->report; }

}  // namespace relmap
