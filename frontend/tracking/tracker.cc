#include "frontend/tracking/tracker.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "frontend/tracking/dead_reckoning.h"
#include "frontend/tracking/gyro.h"
#include "frontend/tracking/keyframe_pictures.h"
#include "frontend/tracking/local_landmarks.h"
#include "frontend/tracking/recovery.h"
#include "frontend/tracking/speedometer.h"
#include "frontend/tracking/stamps.h"
#include "frontend/tracking/stereo_offset.h"
#include "frontend/vision/motion.h"
#include "frontend/vision/rotation.h"
#include "proto/geometry/covariance.h"

namespace relmap::tracking {

// Estimates the standard deviation of a coordinate measured on level 0, from the residuals of the estimated motions.
class MeasurementNoise {
 public:
  double sigma() const { return sigma_; }  // pixels
  void learn(double variance_factor) {
    // Small steps, so that a pair with many moving things does not upset the estimate.
    const double factor = std::clamp(variance_factor, 0.25, 4.0);
    sigma_ = std::clamp(sigma_ * std::pow(factor, 0.5 * kRate), 0.08, 1.0);
  }

 private:
  static constexpr double kRate = 0.05;
  double sigma_ = 0.3;
};

namespace {

// Search radii around an expected position, as a share of the picture's width.
constexpr double kNearRadius = 0.016, kWideRadius = 0.04;
constexpr double kFarRadius = 0.22;            // among corners, when little is known of the motion
constexpr int kMinCoarse = 8;                  // inliers of a coarse pose, which the fine search confirms
constexpr double kCoarseSigma = 0.7;           // pixels of the level: measurements are whole pixels
constexpr double kMaxPredictionSeconds = 0.5;  // for which a velocity is trusted
constexpr double kSteady = 0.25;               // seconds for which a robot moves nearly as before
constexpr double kMinSeen = 0.3;               // share of the landmarks in view that must agree with a pose,
constexpr double kManySeen = 40;               // but so many suffice: they do not agree by chance
constexpr double kSureSeen = 0.7;              // share of the landmarks in view with which no other pose can be as good
constexpr double kRivalShare = 0.5;            // a pose with this share of the best one's inliers may be the right one
constexpr double kElsewhere = 22.5;            // chi-square with 6 degrees of freedom, 99.9 %: two poses differ
constexpr double kFewFound = 0.6;              // with a smaller share found, search again from the better pose,
constexpr int kMaxRounds = 8;                  // as long as that finds more
constexpr double kMinPictureCorrelation = 0.7;  // of small pictures, for their rotation to be trusted
constexpr double kRotationSigma = 0.008;        // radians; error of that rotation from near things
constexpr double kRecoveryEveryS = 0.5;         // descriptors are expensive

// The M-estimator assumes independent measurements, but errors of patches and landmarks persist from pair to pair. On
// drives with ground truth the variance of steps is larger than estimated by this factor.
constexpr double kCommonError = 2;
constexpr int kCorners = 700;  // to start tracks at, on level 0
constexpr int kRecoveryFeatures = 300;
constexpr double kUnsensedAfterS = 60;  // dead reckoning over a longer time is worthless

// Forward translations, as a share of the median depth of the landmarks, that are tried if the speed is not known.
constexpr std::array kParallaxes{0.04, 0.08, 0.13, -0.04};

// Adds its lifetime to a sum of milliseconds.
class Timed {
 public:
  explicit Timed(double& ms) : ms_(ms) {}
  ~Timed() { ms_ += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin_).count(); }
  Timed(const Timed&) = delete;
  Timed& operator=(const Timed&) = delete;

 private:
  double& ms_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

// The pose of a pair with the sightings behind it.
struct Tracked {
  SE3 T_keyframe_pair;
  Matrix6 covariance;
  double rms_px = 0, variance_factor = 1;
  std::size_t expected = 0;
  std::vector<Sighting> sightings;  // inliers
  std::vector<Sighting> disagree;   // found, but not in agreement with the motion
  bool one_eye = false;
  bool left = true;  // the sightings are the left eye's
};

std::vector<vision::PicturePoint> points_of(std::span<const Sighting> sightings) {
  std::vector<vision::PicturePoint> points;
  for (const Sighting& s : sightings)
    points.push_back({static_cast<float>(s.pixel.x()), static_cast<float>(s.pixel.y())});
  return points;
}

}  // namespace

struct StereoTracker::Impl {
  SessionHeader session;
  TrackerOptions options;
  const StereoCamera camera;
  vision::CornerDetector detector{{.wanted = kCorners}};
  Speedometer speedometer;
  MeasurementNoise noise;
  StereoOffset offset;
  DeadReckoning reckoning;
  std::optional<Gyro> gyro;
  PairReport report;

  LocalLandmarks landmarks;
  std::uint32_t next_sequence = 0;
  std::optional<std::int64_t> resumed_us;  // until the first pair after resume()
  SE3 T_odom_keyframe;
  std::size_t tracks_at_keyframe = 0;
  // The last keyframe, for recovery if the landmarks are lost; its descriptors are made when they are needed.
  std::shared_ptr<const Pair> keyframe_pair;
  Keyframe last_keyframe;
  std::vector<DescribedPoint> remembered;
  std::int64_t next_recovery_us = 0;
  std::int64_t min_apart_us = 0;  // between keyframes, as long as vision allows it

  std::shared_ptr<const Pair> previous;
  std::optional<std::int64_t> pair_us;
  SE3 T_keyframe_pair;
  Matrix6 pair_covariance = Matrix6::Zero();   // of T_keyframe_pair
  bool gyro_held = false;                      // the whole rotation since vision was lost is the gyro's
  std::optional<vision::MotionLimits> limits;  // for this pair's pose in the last keyframe's frame
  std::uint64_t pairs = 0;

  Impl(SessionHeader header, TrackerOptions given)
      : session(std::move(header)), options(given), camera(session.camera), landmarks(camera) {}

  // The pose of an eye in the left camera's frame.
  SE3 T_left_eye(bool left) const { return {Matrix3::Identity(), {left ? 0 : camera.baseline, 0, 0}}; }

  std::vector<std::vector<vision::Corner>> corners_of(const vision::Pyramid& eye) {
    const Timed timed(report.features_ms);
    return detector.detect(eye);
  }

  std::vector<vision::Correspondence> correspond(std::span<const Sighting> sightings, double sigma) const {
    std::vector<vision::Correspondence> correspondences;
    correspondences.reserve(sightings.size());
    for (const Sighting& s : sightings) {
      const Landmark& landmark = landmarks[s.landmark];
      correspondences.push_back({landmark.point, s.pixel, sigma * pixel_sigma(landmark.level), landmark.covariance});
    }
    return correspondences;
  }

  // The pose of one eye from its sightings. `limits` apply to the left eye and are moved to the right one if needed.
  std::optional<vision::Motion> solve(std::vector<Sighting>& sightings, double sigma, bool left,
                                      const SE3& T_keyframe_guess, int min_inliers) {
    const Timed timed(report.motion_ms);
    std::sort(sightings.begin(), sightings.end(), [](const Sighting& a, const Sighting& b) {
      return a.difference != b.difference ? a.difference < b.difference : a.landmark < b.landmark;
    });
    const auto correspondences = correspond(sightings, sigma);
    vision::MotionOptions motion_options;
    motion_options.seed = pairs;
    motion_options.min_inliers = min_inliers;
    motion_options.ordered = true;
    motion_options.limits = limits;
    if (limits) motion_options.limits->T_reference_camera = limits->T_reference_camera * T_left_eye(left);
    auto motion = vision::estimate_motion(correspondences, camera, motion_options, &T_keyframe_guess);
    if (!motion.ok()) return std::nullopt;
    return std::move(*motion);
  }

  // Tracks the pair with one eye (and the right one besides the left, if both see), starting from a guess of the pose.
  // `radius` is the search radius as a share of the picture's width; if `corners` are given, only these are searched.
  // If `other_than` is given, the coarse pose is estimated only from landmarks that are not inliers of it.
  std::optional<Tracked> track_from(const Pair& pair, bool left, const SE3& T_keyframe_guess, double radius,
                                    const std::vector<std::vector<vision::Corner>>* corners = nullptr,
                                    const Tracked* other_than = nullptr) {
    const vision::Pyramid& eye = left ? pair.left : pair.right;
    SE3 T_keyframe_eye = T_keyframe_guess * T_left_eye(left);
    std::vector<Sighting> sightings;
    std::optional<ExpectedPatches> expected;
    {
      const Timed timed(report.match_ms);
      expected.emplace(landmarks.all(), T_keyframe_eye.inverse(), camera, eye.levels());
      sightings =
          corners ? search_corners(*expected, T_keyframe_eye.inverse(), camera, eye, *corners, radius * camera.width)
                  : search_around(*expected, T_keyframe_eye.inverse(), camera, eye, radius * camera.width);
    }
    if (other_than) {
      std::vector<char> explained(landmarks.size(), 0);
      for (const Sighting& s : other_than->sightings) explained[s.landmark] = 1;
      std::erase_if(sightings, [&](const Sighting& s) { return explained[s.landmark]; });
    }
    if (const auto motion = solve(sightings, kCoarseSigma, left, T_keyframe_eye, kMinCoarse))
      T_keyframe_eye = motion->T_reference_camera;
    std::optional<Tracked> tracked;
    for (int round = 0; round < kMaxRounds; ++round) {
      std::size_t in_view = 0;
      {
        const Timed timed(report.match_ms);
        sightings = align_patches(*expected, T_keyframe_eye.inverse(), camera, eye, in_view);
        if (!left)
          for (Sighting& s : sightings) s.pixel.x() += offset.pixels();
        if (left && pair.sees_right())
          match_right(landmarks.all(), T_keyframe_eye.inverse(), camera, offset.pixels(), pair.left, pair.right,
                      sightings);
      }
      report.found = std::max(report.found, static_cast<int>(sightings.size()));
      const auto motion = solve(sightings, noise.sigma(), left, T_keyframe_eye, options.min_inliers);
      if (!motion) break;
      // A wrong pose also has matches by chance, but only for few of the landmarks in view.
      const double min_seen = std::min(kMinSeen * static_cast<double>(in_view), kManySeen);
      if (static_cast<double>(motion->inliers.size()) < min_seen) break;
      T_keyframe_eye = motion->T_reference_camera;
      Tracked next;
      next.T_keyframe_pair = T_keyframe_eye * T_left_eye(left).inverse();
      next.covariance = kCommonError * motion->covariance;
      if (!left) {
        const Matrix6 adjoint = T_left_eye(left).adjoint();
        next.covariance = (adjoint * next.covariance * adjoint.transpose()).eval();
      }
      next.rms_px = motion->rms_px;
      next.variance_factor = motion->variance_factor;
      next.expected = in_view;
      next.one_eye = !left || !pair.sees_right();
      next.left = left;
      std::vector<char> agrees(sightings.size(), 0);
      for (const std::uint32_t i : motion->inliers) agrees[i] = 1;
      for (std::size_t i = 0; i < sightings.size(); ++i)
        (agrees[i] ? next.sightings : next.disagree).push_back(sightings[i]);
      const bool enough = static_cast<double>(next.sightings.size()) >= kFewFound * static_cast<double>(in_view);
      const bool more = !tracked || next.sightings.size() > tracked->sightings.size();
      if (more) tracked = std::move(next);
      if (enough || !more) break;
    }
    return tracked;
  }

  // Finds the pose by descriptors, and refines it by patches if these are still visible.
  std::optional<Tracked> recover(const Pair& pair, std::int64_t time_us) {
    if (!keyframe_pair || time_us < next_recovery_us) return std::nullopt;
    next_recovery_us = time_us + std::llround(1e6 * kRecoveryEveryS);
    if (remembered.empty()) {
      last_keyframe.appearance = appearance_set(*keyframe_pair, last_keyframe, offset.pixels(), kRecoveryFeatures);
      remembered = described_points(last_keyframe, noise.sigma());
    }
    const auto recognised = recognise(remembered, pair.picture, camera, limits, pairs);
    if (!recognised.ok()) return std::nullopt;
    const vision::Motion& motion = recognised->motion;
    if (auto tracked = track_from(pair, true, motion.T_reference_camera, kNearRadius)) return tracked;
    if (!recognised->doubt.ok()) return std::nullopt;
    Tracked tracked;
    tracked.T_keyframe_pair = motion.T_reference_camera;
    tracked.covariance = kCommonError * motion.covariance;
    tracked.rms_px = motion.rms_px;
    tracked.one_eye = !pair.sees_right();
    return tracked;
  }

  // Searches the pose of the pair. `expected` says that T_expected comes from a recent velocity or from the robot: then
  // the first pose near it with many inliers is the right one. Otherwise repeating patterns (a chequerboard, a facade)
  // may also agree with a wrong pose, so all ways of searching are tried until nearly all landmarks are found.
  std::optional<Tracked> track(const Pair& pair, const SE3& T_expected, bool expected, bool motion_known,
                               std::int64_t time_us) {
    std::vector<Tracked> found;
    std::size_t best = 0;
    const auto enough = static_cast<std::size_t>(options.min_tracks) * 2 / 3;
    const auto done = [&](std::optional<Tracked> other) {
      if (other) {
        if (found.empty() || other->sightings.size() > found[best].sightings.size()) best = found.size();
        found.push_back(std::move(*other));
      }
      if (found.empty()) return false;
      const std::size_t seen = found[best].sightings.size();
      if (expected) return 2 * seen >= found[best].expected || seen >= enough;
      return static_cast<double>(seen) >= kSureSeen * static_cast<double>(found[best].expected);
    };
    if (!pair.sees_left() && !pair.sees_right()) return std::nullopt;
    const bool left = pair.sees_left();
    const auto look = [&] {
      if (done(track_from(pair, left, T_expected, kNearRadius))) return;
      if (done(track_from(pair, left, T_expected, kWideRadius))) return;
      // The speed is not known; the robot may have moved straight ahead.
      if (!motion_known) {
        for (const double parallax : kParallaxes) {
          const SE3 T = T_expected * SE3{Matrix3::Identity(), {0, 0, parallax * landmarks.median_depth()}};
          if (done(track_from(pair, left, T, kWideRadius))) return;
        }
      }
      const auto corners = corners_of(left ? pair.left : pair.right);
      if (done(track_from(pair, left, T_expected, kFarRadius, &corners))) return;
      if (motion_known && done(track_from(pair, left, T_keyframe_pair, kFarRadius, &corners))) return;
      if (!found.empty() && expected) return;
      if (left && done(recover(pair, time_us))) return;
      if (found.empty()) return;
      // Landmarks that the best pose does not explain may agree on another pose, or lead to a better one.
      const Tracked first = found[best];
      if (done(track_from(pair, left, T_expected, kFarRadius, &corners, &first))) return;
      done(track_from(pair, left, first.T_keyframe_pair, kWideRadius, nullptr, &first));
    };
    look();
    if (found.empty()) return std::nullopt;
    if (!expected && !done(std::nullopt)) widen_by_rivals(found, best);
    return std::move(found[best]);
  }

  // If other poses explain about as much, widens the covariance of the best one by its distance to them.
  void widen_by_rivals(std::vector<Tracked>& found, std::size_t best) {
    Tracked& chosen = found[best];
    const double min_inliers = kRivalShare * static_cast<double>(chosen.sightings.size());
    const Matrix6 own = chosen.covariance;
    const auto make_room = [&](const SE3& T_keyframe_rival, const Matrix6& covariance) {
      const Vector6 apart = (chosen.T_keyframe_pair.inverse() * T_keyframe_rival).log();
      if (mahalanobis_squared(apart, chosen.covariance + covariance) > kElsewhere)
        chosen.covariance += apart * apart.transpose();
    };
    for (std::size_t i = 0; i < found.size(); ++i)
      if (i != best && static_cast<double>(found[i].sightings.size()) >= min_inliers)
        make_room(found[i].T_keyframe_pair, found[i].covariance);
    // Landmarks of one age may agree on one pose, and those of another age on another.
    if (static_cast<double>(chosen.disagree.size()) >= min_inliers) {
      const SE3 T_left_eye = this->T_left_eye(chosen.left);
      const auto rival = solve(chosen.disagree, noise.sigma(), chosen.left, chosen.T_keyframe_pair * T_left_eye,
                               std::max(options.min_inliers, static_cast<int>(std::ceil(min_inliers))));
      if (rival) make_room(rival->T_reference_camera * T_left_eye.inverse(), own);
    }
  }

  // Limits of the poses that a robot can have reached that was expected to move by `step`.
  vision::MotionLimits reachable(const SE3& T_keyframe_expected, const DeadReckoning::Step& step, double dt) const {
    const double blind = dt + reckoning.stale_s();
    vision::MotionLimits reach{T_keyframe_expected, 0.02 + options.max_acceleration * blind * blind,
                               0.02 + 4 * std::sqrt(step.covariance(5, 5)) + 2 * std::sqrt(pair_covariance(5, 5))};
    if (!reckoning.knows_velocity() || blind > kMaxPredictionSeconds) reach.metres += options.max_speed * blind;
    if (!reckoning.knows_velocity()) reach.radians += options.max_turn_rate * blind;
    // In pictures, a sideways motion in front of something near looks like a rotation.
    if (report.rotation_correlation > 0)
      reach.radians += step.T_from_to.t.norm() / std::max(landmarks.median_depth(), 0.5);
    return reach;
  }

  // The motion expected since the last pair.
  DeadReckoning::Step expect(const Pair& pair, std::int64_t time_us, double dt, const SE3* given) {
    if (given) {
      DeadReckoning::Step step = reckoning.expect(dt);
      step.T_from_to = *given;
      report.R_previous_this = given->R;
      return step;
    }
    std::optional<Gyro::Turn> turn;
    if (gyro) turn = gyro->turn(*pair_us, time_us);
    gyro_held = gyro_held && turn.has_value();
    const bool seen = !turn && previous && previous->sees_left() && pair.sees_left();
    if (seen) {
      const Timed timed(report.rotation_ms);
      const Matrix3 guess =
          dt <= kMaxPredictionSeconds ? reckoning.expect(dt).T_from_to.R : Matrix3(Matrix3::Identity());
      if (const auto found = vision::align_rotation(previous->left, pair.left, camera, guess)) {
        report.rotation_correlation = found->correlation;
        if (found->correlation >= kMinPictureCorrelation)
          turn = Gyro::Turn{found->R_reference_current, std::hypot(found->sigma, kRotationSigma), 0};
      }
    }
    DeadReckoning::Step step = reckoning.expect(dt, turn ? &*turn : nullptr, seen && !turn);
    // After a gap another part of the scene may look like this one, so the rotation only guides the search, and its
    // covariance is that of no measurement.
    if (seen && dt > kMaxPredictionSeconds) step.covariance = reckoning.expect(dt, nullptr, true).covariance;
    report.R_previous_this = step.T_from_to.R;
    return step;
  }

  bool keyframe_due(const Tracked& tracked, std::int64_t time_us) const {
    if (time_us < last_keyframe.time_us + min_apart_us &&
        tracked.sightings.size() >= 2 * static_cast<std::size_t>(options.min_inliers))
      return false;
    const auto count = static_cast<double>(tracked.sightings.size());
    const double parallax = T_keyframe_pair.t.norm() / std::max(landmarks.median_depth(), 1e-3);
    // Keyframes state pixels of the left eye, so the right one alone makes none.
    if (!tracked.left) return false;
    // One eye cannot start new tracks, so keyframes of one eye are rare.
    if (tracked.one_eye) return parallax > 4 * options.parallax && count >= 2 * options.min_inliers;
    if (options.every_pair) return true;
    if (count < options.min_share * static_cast<double>(tracks_at_keyframe) || count < options.min_tracks)
      return T_keyframe_pair.t.norm() > 0.02 || rotation_angle(T_keyframe_pair.R) > 0.01 ||
             (count < 0.5 * options.min_tracks && count < options.min_share * static_cast<double>(tracks_at_keyframe));
    return parallax > options.parallax || rotation_angle(T_keyframe_pair.R) > options.rotation;
  }

  // Makes the pair the reference from which motion is measured.
  void set_reference(std::shared_ptr<const Pair> pair, std::size_t tracks) {
    T_odom_keyframe = (T_odom_keyframe * T_keyframe_pair).normalized();
    T_keyframe_pair = SE3();
    pair_covariance.setZero();
    tracks_at_keyframe = tracks;
    keyframe_pair = std::move(pair);
    remembered.clear();
    gyro_held = true;
  }

  void replenish(LocalLandmarks& into, const Pair& pair, std::span<const vision::PicturePoint> avoid,
                 std::vector<Sighting>& sightings) {
    if (!pair.sees_left() || !pair.sees_right()) return;
    const auto corners = corners_of(pair.left);
    const Timed timed(report.match_ms);
    into.replenish(pair, corners, avoid, options.tracks, noise.sigma(), offset.pixels(), sightings);
  }

  // New tracks keep away from the points to `avoid`.
  Keyframe make_keyframe(std::shared_ptr<const Pair> pair, std::vector<Sighting> sightings, MotionSource source,
                         const Matrix6& covariance, std::int64_t time_us,
                         std::span<const vision::PicturePoint> avoid = {}) {
    Keyframe keyframe;
    keyframe.session = session;
    keyframe.sequence = next_sequence++;
    keyframe.time_us = time_us;
    keyframe.source = source;
    keyframe.step_covariance = covariance;
    if (is_vision(source)) {
      const Timed timed(report.match_ms);
      if (source == MotionSource::kVision) offset.learn(correspond(sightings, noise.sigma()), T_keyframe_pair, camera);
      landmarks.rebase(T_keyframe_pair, *pair, noise.sigma(), sightings);
    } else if (sightings.empty()) {
      landmarks.clear();
    }
    if (is_vision(source) || sightings.empty()) replenish(landmarks, *pair, avoid, sightings);
    keyframe.tracks = landmarks.track_measurements(keyframe.sequence, sightings);
    if (source != MotionSource::kStart) {
      keyframe.driven_us = speedometer.driven_us();
      keyframe.standing_us = speedometer.standing_us();
    }
    speedometer.restart();
    set_reference(std::move(pair), keyframe.tracks.size());
    keyframe.T_odom_frame = T_odom_keyframe;
    last_keyframe = keyframe;
    report.keyframe = true;
    return keyframe;
  }

  static Matrix6 unsensed_covariance(double dt) { return DeadReckoning().expect(dt).covariance; }

  std::optional<Keyframe> first_pair(const std::shared_ptr<const Pair>& pair, std::int64_t time_us) {
    if (resumed_us && *resumed_us == time_us) {
      // This is the last keyframe's own pair: new landmarks start here and are published with the next keyframe.
      std::vector<Sighting> sightings;
      replenish(landmarks, *pair, {}, sightings);
      set_reference(pair, sightings.size());
      report.tracked = true;
      return std::nullopt;
    }
    report.tracked = !resumed_us;
    if (!resumed_us) return make_keyframe(pair, {}, MotionSource::kStart, Matrix6::Zero(), time_us);
    speedometer.restart();
    auto keyframe =
        make_keyframe(pair, {}, MotionSource::kUnsensed,
                      unsensed_covariance(std::min(seconds(time_us - *resumed_us), kUnsensedAfterS)), time_us);
    keyframe.standing_us = time_us - *resumed_us;
    return keyframe;
  }

  void take(const Tracked& tracked, std::int64_t time_us, double dt) {
    const SE3 T_previous_this = T_keyframe_pair.inverse() * tracked.T_keyframe_pair;
    if (reckoning.blind_s() == 0 && dt <= kMaxPredictionSeconds) {
      reckoning.sensed(T_previous_this, dt);
      if (gyro) {
        const double sigma = std::sqrt(tracked.covariance.diagonal().tail<3>().mean());
        gyro->correct(*pair_us, time_us, T_previous_this.R, std::max(sigma, 2e-4));
      }
    } else {
      reckoning.unsensed(dt);
      reckoning.found();
    }
    T_keyframe_pair = tracked.T_keyframe_pair;
    pair_covariance = tracked.covariance;
    gyro_held = true;
    if (tracked.sightings.size() >= 30) noise.learn(tracked.variance_factor);
  }

  void lose(const DeadReckoning::Step& step, double dt) {
    const Matrix6 adjoint = step.T_from_to.inverse().adjoint();
    pair_covariance = (adjoint * pair_covariance * adjoint.transpose()).eval() + step.covariance;
    T_keyframe_pair = T_keyframe_pair * step.T_from_to;
    reckoning.unsensed(dt);
  }

  void fill_report(const Tracked& tracked) {
    report.tracked = true;
    report.one_eye = tracked.one_eye;
    report.expected = static_cast<int>(tracked.expected);
    report.inliers = static_cast<int>(tracked.sightings.size());
    report.rms_px = tracked.rms_px;
    for (const Sighting& s : tracked.sightings)
      report.tracks.push_back(
          {static_cast<float>(s.pixel.x()), static_cast<float>(s.pixel.y()), landmarks[s.landmark].age, true});
    for (const vision::PicturePoint& p : points_of(tracked.disagree)) report.tracks.push_back({p.x, p.y, 0, false});
  }

  std::optional<Keyframe> next_pair(const std::shared_ptr<const Pair>& pair, std::int64_t time_us,
                                    const SE3* expected) {
    const double dt = seconds(time_us - *pair_us);
    const DeadReckoning::Step step = expect(*pair, time_us, dt, expected);
    const bool motion_known = expected || reckoning.knows_velocity();
    report.landmarks = static_cast<int>(landmarks.size());
    limits = reachable(T_keyframe_pair * step.T_from_to, step, dt);
    // After a gap the search starts without translation: the robot may as well have stopped.
    SE3 searched = step.T_from_to;
    if (!expected && dt > kMaxPredictionSeconds && reckoning.blind_s() == 0) searched.t.setZero();
    auto tracked =
        track(*pair, T_keyframe_pair * searched, expected || (motion_known && dt <= kSteady), motion_known, time_us);
    if (tracked) {
      fill_report(*tracked);
      take(*tracked, time_us, dt);
    } else {
      lose(step, dt);
    }
    speedometer.add(time_us, (T_odom_keyframe * T_keyframe_pair).t);
    if (tracked) {
      landmarks.note(tracked->sightings);
      if (!keyframe_due(*tracked, time_us)) return std::nullopt;
      return make_keyframe(pair, std::move(tracked->sightings),
                           tracked->one_eye ? MotionSource::kOneEye : MotionSource::kVision, pair_covariance, time_us,
                           points_of(tracked->disagree));
    }
    return start_anew(pair, time_us);
  }

  // Starts anew with a keyframe whose step is dead reckoning, if there is enough to see.
  std::optional<Keyframe> start_anew(const std::shared_ptr<const Pair>& pair, std::int64_t time_us) {
    if (reckoning.blind_s() < options.lost_s) return std::nullopt;
    LocalLandmarks fresh(camera);
    std::vector<Sighting> sightings;
    replenish(fresh, *pair, {}, sightings);
    if (sightings.size() < static_cast<std::size_t>(options.min_inliers)) return std::nullopt;
    report.started_anew = true;
    const MotionSource source = reckoning.blind_s() > kUnsensedAfterS ? MotionSource::kUnsensed
                                : gyro_held && gyro                   ? MotionSource::kGyro
                                                                      : MotionSource::kConstantVelocity;
    landmarks = std::move(fresh);
    auto keyframe = make_keyframe(
        pair, std::move(sightings), source,
        source == MotionSource::kUnsensed ? unsensed_covariance(kUnsensedAfterS) : pair_covariance, time_us);
    reckoning.found();
    return keyframe;
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
  impl_->last_keyframe = last;
}

void StereoTracker::use_imu(const ImuCalibration& calibration, const Matrix3& R_frame_camera) {
  impl_->gyro.emplace(calibration, R_frame_camera);
}

void StereoTracker::feed(std::span<const ImuSample> samples) {
  if (impl_->gyro) impl_->gyro->add(samples);
}

void StereoTracker::limit_keyframe_rate(double max_hz) {
  impl_->min_apart_us = max_hz > 0 ? std::llround(1e6 / std::max(max_hz, 1e-3)) : 0;
}

Result<std::optional<Keyframe>> StereoTracker::feed(std::shared_ptr<const Pair> pair, std::int64_t time_us,
                                                    const SE3* expected) {
  Impl& self = *impl_;
  if (pair->picture.width() != self.camera.width || pair->picture.height() != self.camera.height)
    return {Reason::BAD_SIZE, "a picture of " + std::to_string(pair->picture.width()) + " x " +
                                  std::to_string(pair->picture.height()) + " from a camera of " +
                                  std::to_string(self.camera.width) + " x " + std::to_string(self.camera.height)};
  const auto earlier = self.pair_us ? self.pair_us : self.resumed_us;
  const bool own_pair = !self.pair_us && self.resumed_us == time_us;
  if (earlier && time_us <= *earlier && !own_pair)
    return {Reason::TIME_BACKWARDS, std::to_string(time_us) + " us after " + std::to_string(*earlier) + " us"};

  const PairReport before = std::exchange(self.report, {});
  ++self.pairs;
  if (self.previous && pair->sees_left() && vision::same_picture(pair->picture, self.previous->picture)) {
    self.report = before;
    self.report.repeated = true;
    if (self.gyro) self.gyro->forget_before(*self.pair_us);
    self.report.keyframe = self.report.started_anew = false;
    return std::optional<Keyframe>();
  }
  std::optional<Keyframe> keyframe;
  if (self.pair_us) {
    keyframe = self.next_pair(pair, time_us, expected);
  } else {
    keyframe = self.first_pair(pair, time_us);
    self.speedometer.add(time_us, self.T_odom_keyframe.t);
  }
  self.previous = std::move(pair);
  self.pair_us = time_us;
  if (self.gyro) self.gyro->forget_before(time_us);
  self.report.offset_px = self.offset.pixels();
  self.report.speed = self.speedometer.speed();
  self.report.T_odom_frame = self.T_odom_keyframe * self.T_keyframe_pair;
  return keyframe;
}

const PairReport& StereoTracker::report() const { return impl_->report; }

}  // namespace relmap::tracking
