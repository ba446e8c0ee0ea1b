#include "frontend/tracking/tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "frontend/tracking/drift.h"
#include "frontend/tracking/keyframe_pictures.h"
#include "frontend/tracking/session_for_test.h"
#include "frontend/tracking/wall_for_test.h"
#include "proto/geometry/covariance.h"
#include "tools/sim/inertial.h"
#include "tools/sim/picture_world.h"

namespace relmap::tracking {
namespace {

constexpr double kChi2 = 22.5;  // chi2_6(0.999)

// A short drive down a rendered street; pairs are rendered when they are first asked for.
class Street {
 public:
  static Street& get() {
    static Street street;
    return street;
  }
  static constexpr std::size_t kPairs = 45;

  const sim::PictureWorld& world() const { return world_; }
  const StereoCamera& camera() const { return world_.options().camera; }
  std::int64_t time_us(std::size_t i) const { return world_.time_us(static_cast<int>(i)); }
  SE3 truth(std::size_t i) const { return world_.truth(static_cast<int>(i)); }
  SE3 step(std::size_t from, std::size_t to) const { return truth(from).inverse() * truth(to); }

  std::shared_ptr<const Pair> pair(std::size_t i) {
    auto& pair = pairs_[i];
    if (!pair) pair = prepare_pair(left(i, static_cast<unsigned>(i)), right(i, static_cast<unsigned>(i)));
    return pair;
  }
  // The same pose with other noise gives other pictures.
  vision::Image left(std::size_t i, unsigned noise) { return noisy(clean(i).left, 2 * noise); }
  vision::Image right(std::size_t i, unsigned noise) { return noisy(clean(i).right, 2 * noise + 1); }

 private:
  static sim::PictureWorldOptions options() {
    sim::PictureWorldOptions options;
    options.seed = 12;
    options.noise = 0;
    return options;
  }
  const sim::StereoPictures& clean(std::size_t i) {
    auto& pictures = clean_[i];
    if (pictures.left.pixels.empty()) pictures = world_.render(static_cast<int>(i));
    return pictures;
  }
  static vision::Image noisy(const sim::GreyPicture& picture, unsigned seed) {
    static const std::vector<float> table = [] {
      std::mt19937 random(5);
      std::normal_distribution<float> normal(0, 2);
      std::vector<float> values(1 << 12);
      for (float& value : values) value = normal(random);
      return values;
    }();
    std::mt19937 random(seed);
    vision::Image image(picture.width, picture.height);
    std::transform(picture.pixels.begin(), picture.pixels.end(), image.row(0), [&](std::uint8_t value) {
      return static_cast<std::uint8_t>(std::clamp(std::lround(value + table[random() >> 20]), 0L, 255L));
    });
    return image;
  }
  sim::PictureWorld world_{options()};
  std::map<std::size_t, sim::StereoPictures> clean_;
  std::map<std::size_t, std::shared_ptr<const Pair>> pairs_;
};

SessionHeader street_session() { return testing_session::session_of(Street::get().camera()); }

struct Fed {
  std::vector<Keyframe> keyframes;
  std::vector<PosePair> poses;
  int tracked = 0;
};

Fed feed(StereoTracker& tracker, std::size_t from, std::size_t to, std::size_t step = 1) {
  Fed fed;
  for (std::size_t i = from; i < to; i += step) {
    auto keyframe = tracker.feed(Street::get().pair(i), Street::get().time_us(i));
    EXPECT_TRUE(keyframe.ok()) << keyframe.status().to_string();
    fed.tracked += tracker.report().tracked;
    fed.poses.push_back({Street::get().truth(i), tracker.report().T_odom_frame});
    if (keyframe.ok() && keyframe->has_value()) fed.keyframes.push_back(std::move(**keyframe));
  }
  return fed;
}

std::size_t frame_at(std::int64_t time_us) {
  std::size_t frame = 0;
  while (Street::get().time_us(frame) != time_us) ++frame;
  return frame;
}

vision::Image dark() {
  vision::Image black(Street::get().camera().width, Street::get().camera().height);
  std::fill_n(black.row(0), black.width() * black.height(), std::uint8_t{3});
  return black;
}
std::shared_ptr<const Pair> dark_pair() { return prepare_pair(dark(), dark()); }

// Normalised estimation error squared (NEES) of the step from one keyframe to the next.
double nees(const Keyframe& from, const Keyframe& to) {
  const SE3 truth = Street::get().step(frame_at(from.time_us), frame_at(to.time_us));
  const SE3 estimate = from.T_odom_frame.inverse() * to.T_odom_frame;
  const Vector6 error = (estimate.inverse() * truth).log();
  return mahalanobis_squared(error, to.step_covariance);
}

double rotation_error(const SE3& estimate, const SE3& truth) {
  return rotation_angle(estimate.R.transpose() * truth.R);
}

TEST(StereoTracker, FollowsADriveWithoutDrift) {
  StereoTracker tracker(street_session());
  const Fed fed = feed(tracker, 0, Street::kPairs);
  EXPECT_EQ(fed.tracked, static_cast<int>(fed.poses.size()));
  const Drift drift = measure_drift(fed.poses, 5);
  EXPECT_GT(drift.segments, 10u);
  EXPECT_LT(drift.translation, 0.006);
  EXPECT_LT(drift.rotation, 0.002);
}

TEST(StereoTracker, KeyframesAreSoundAndShareTracks) {
  StereoTracker tracker(street_session());
  const Fed fed = feed(tracker, 0, 30);
  ASSERT_GE(fed.keyframes.size(), 4u);
  std::set<TrackId> before;
  for (std::size_t i = 0; i < fed.keyframes.size(); ++i) {
    const Keyframe& keyframe = fed.keyframes[i];
    EXPECT_TRUE(check_keyframe(keyframe).ok()) << check_keyframe(keyframe).to_string();
    EXPECT_EQ(keyframe.sequence, i);
    EXPECT_EQ(keyframe.source, i == 0 ? MotionSource::kStart : MotionSource::kVision);
    EXPECT_GE(keyframe.tracks.size(), 100u);
    EXPECT_LE(keyframe.tracks.size(), 150u);
    std::set<TrackId> now;
    std::size_t shared = 0, stereo = 0;
    for (std::size_t t = 0; t < keyframe.tracks.size(); ++t) {
      const TrackMeasurement& track = keyframe.tracks[t];
      if (track.track.sequence == keyframe.sequence) {
        EXPECT_EQ(track.track.index, t);
      }
      now.insert(track.track);
      shared += before.count(track.track);
      stereo += !is_mono(track.pixel());
    }
    if (i > 0) {
      EXPECT_GE(shared, 50u);
      const double metres = (fed.keyframes[i - 1].T_odom_frame.t - keyframe.T_odom_frame.t).norm();
      EXPECT_LT(metres, 1.3);
      EXPECT_EQ(keyframe.driven_us + keyframe.standing_us, keyframe.time_us - fed.keyframes[i - 1].time_us);
      EXPECT_GT(keyframe.driven_us, keyframe.standing_us);
    }
    EXPECT_GT(stereo, 0.8 * static_cast<double>(keyframe.tracks.size()));
    before = std::move(now);
  }
}

TEST(StereoTracker, KeyframesCanBeGivenAppearanceAndPicture) {
  StereoTracker tracker(street_session());
  const Fed fed = feed(tracker, 0, 15);
  ASSERT_GE(fed.keyframes.size(), 2u);
  for (Keyframe keyframe : fed.keyframes) {
    EXPECT_TRUE(keyframe.appearance.empty());
    EXPECT_TRUE(keyframe.picture.empty());
    const auto pair = Street::get().pair(frame_at(keyframe.time_us));
    keyframe.appearance = appearance_set(*pair, keyframe, 0, 300);
    keyframe.picture = keyframe_picture(pair->picture, KeyframePicture::kWhole);
    EXPECT_TRUE(check_keyframe(keyframe).ok()) << check_keyframe(keyframe).to_string();
    EXPECT_EQ(keyframe.appearance.size(), 300u);
    EXPECT_FALSE(keyframe.picture.empty());
    std::size_t described = 0, deep = 0;
    for (const AppearanceFeature& feature : keyframe.appearance) {
      described += feature.track >= 0;
      deep += !std::isnan(feature.disparity);
    }
    EXPECT_EQ(described, keyframe.tracks.size());
    EXPECT_GT(deep, 200u);
  }
}

TEST(StereoTracker, SamePicturesSameBytes) {
  StereoTracker a(street_session()), b(street_session());
  const Fed first = feed(a, 0, 15), second = feed(b, 0, 15);
  ASSERT_EQ(first.keyframes.size(), second.keyframes.size());
  for (std::size_t i = 0; i < first.keyframes.size(); ++i)
    EXPECT_EQ(encode_keyframe(first.keyframes[i]), encode_keyframe(second.keyframes[i]));
}

TEST(StereoTracker, BridgesAShortLossOfVisionWithoutANewStart) {
  StereoTracker tracker(street_session());
  feed(tracker, 0, 10);
  ASSERT_TRUE(tracker.feed(dark_pair(), Street::get().time_us(10)).ok());
  EXPECT_FALSE(tracker.report().tracked);
  const Fed after = feed(tracker, 11, 20);
  EXPECT_EQ(after.tracked, 9);
  for (const Keyframe& keyframe : after.keyframes) EXPECT_EQ(keyframe.source, MotionSource::kVision);
}

TEST(StereoTracker, BridgesFiveDroppedPairsByVision) {
  StereoTracker tracker(street_session());
  const Fed before = feed(tracker, 0, 10);
  const Fed after = feed(tracker, 15, 20);
  EXPECT_EQ(after.tracked, 5);
  for (const Keyframe& keyframe : after.keyframes) EXPECT_EQ(keyframe.source, MotionSource::kVision);
  const SE3 estimate = before.poses.back().estimate.inverse() * after.poses.back().estimate;
  const SE3 truth = Street::get().step(9, 19);
  EXPECT_LT((estimate.t - truth.t).norm(), 0.03);
  EXPECT_LT(rotation_error(estimate, truth), 0.005);
}

TEST(StereoTracker, LeavesOutAPairGivenTwiceWithoutHarmToTheNextPrediction) {
  StereoTracker doubled(street_session()), whole(street_session());
  feed(doubled, 0, 10);
  const SE3 before = doubled.report().T_odom_frame;
  const auto again = doubled.feed(Street::get().pair(9), Street::get().time_us(10));
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(again->has_value());
  EXPECT_TRUE(doubled.report().repeated);
  EXPECT_TRUE(doubled.report().tracked);
  EXPECT_EQ(doubled.report().T_odom_frame.t, before.t);
  const Fed after = feed(doubled, 11, 14);
  EXPECT_EQ(after.tracked, 3);
  EXPECT_FALSE(doubled.report().repeated);

  // The same as if pair 10 had been missing.
  feed(whole, 0, 10);
  const Fed same = feed(whole, 11, 14);
  for (std::size_t i = 0; i < after.poses.size(); ++i)
    EXPECT_LT((after.poses[i].estimate.t - same.poses[i].estimate.t).norm(), 0.005);
  EXPECT_LT((before.inverse() * after.poses[0].estimate).t.norm(), 1.2 * Street::get().step(9, 11).t.norm());
  EXPECT_LT((Street::get().step(9, 13).t - (before.inverse() * after.poses.back().estimate).t).norm(), 0.02);
}

TEST(StereoTracker, StartsAgainByConstantVelocityWhenItWasBlindTooLong) {
  StereoTracker tracker(street_session());
  const Fed before = feed(tracker, 0, 10);
  for (std::size_t i = 10; i < 35; ++i) {
    const auto keyframe = tracker.feed(dark_pair(), Street::get().time_us(i));
    ASSERT_TRUE(keyframe.ok());
    EXPECT_FALSE(keyframe->has_value());  // nothing to start from
  }
  const Fed after = feed(tracker, 35, 45);
  ASSERT_GE(after.keyframes.size(), 2u);
  const Keyframe& bridge = after.keyframes.front();
  EXPECT_EQ(bridge.source, MotionSource::kConstantVelocity);
  EXPECT_TRUE(check_keyframe(bridge).ok()) << check_keyframe(bridge).to_string();
  EXPECT_EQ(after.keyframes[1].source, MotionSource::kVision);
  // The error of the bridge is within what its covariance says.
  EXPECT_LT(nees(before.keyframes.back(), bridge), 16.8);  // chi2_6(0.99)
  EXPECT_GT(std::sqrt(bridge.step_covariance(2, 2)), 0.5);
}

TEST(StereoTracker, HoldsItsRotationByTheGyroThroughThreeSecondsOfBlack) {
  const sim::PictureWorld& world = Street::get().world();
  sim::InertialOptions unit;
  unit.calibration.R_camera_imu = so3_exp({0.3, -0.8, 1.2});
  const std::vector<ImuSample> samples = sim::simulate_inertial(world, unit);
  for (const std::size_t first : {40u, 225u}) {
    const std::size_t last = first + 20;  // before it is black
    StereoTracker tracker(street_session());
    tracker.use_imu(unit.calibration, Matrix3::Identity());
    auto sample = samples.begin();
    const auto feed_gyro = [&](std::size_t frame) {
      const auto until = std::find_if(
          sample, samples.end(), [&](const ImuSample& s) { return s.time_us > Street::get().time_us(frame) + 20'000; });
      tracker.feed(std::span(sample, until));
      sample = until;
    };
    std::vector<Keyframe> keyframes;
    for (std::size_t i = first; i <= last + 33; ++i) {
      feed_gyro(i);
      const bool black = i > last && i <= last + 30;
      auto keyframe = tracker.feed(black ? dark_pair() : Street::get().pair(i), Street::get().time_us(i));
      ASSERT_TRUE(keyframe.ok());
      EXPECT_EQ(tracker.report().tracked, !black && i != last + 31) << i;
      if (keyframe->has_value()) keyframes.push_back(std::move(**keyframe));
    }
    const auto bridge = std::find_if(keyframes.begin(), keyframes.end(),
                                     [](const Keyframe& k) { return k.source == MotionSource::kGyro; });
    ASSERT_NE(bridge, keyframes.end());
    EXPECT_EQ(frame_at(bridge->time_us), last + 31);
    EXPECT_TRUE(check_keyframe(*bridge).ok()) << check_keyframe(*bridge).to_string();
    const Keyframe& from = *std::prev(bridge);
    const SE3 truth = Street::get().step(frame_at(from.time_us), frame_at(bridge->time_us));
    const SE3 estimate = from.T_odom_frame.inverse() * bridge->T_odom_frame;
    EXPECT_GT(rotation_angle(truth.R), 0.2);  // there was a turn to hold
    EXPECT_LT(rotation_error(estimate, truth), 0.5 * M_PI / 180);
    EXPECT_LT(nees(from, *bridge), kChi2);
  }
}

TEST(StereoTracker, TheCovarianceOfABridgeCoversItsError) {
  for (const std::size_t from : {5u, 25u, 80u, 160u, 225u}) {
    StereoTracker tracker(street_session());
    const Fed before = feed(tracker, from, from + 8);
    for (std::size_t i = from + 8; i < from + 33; ++i) tracker.feed(dark_pair(), Street::get().time_us(i)).value();
    const Fed after = feed(tracker, from + 33, from + 36);
    ASSERT_FALSE(after.keyframes.empty()) << from;
    EXPECT_EQ(after.keyframes.front().source, MotionSource::kConstantVelocity) << from;
    EXPECT_LT(nees(before.keyframes.back(), after.keyframes.front()), kChi2) << from;
  }
}

TEST(StereoTracker, GoesOnWithTheLeftEyeWhenTheRightIsDark) {
  StereoTracker tracker(street_session());
  const Fed before = feed(tracker, 0, 10);
  for (std::size_t i = 10; i < 22; ++i) {
    const auto keyframe = tracker.feed(prepare_pair(Street::get().left(i, 0), dark()), Street::get().time_us(i));
    ASSERT_TRUE(keyframe.ok());
    EXPECT_TRUE(tracker.report().tracked) << i;
    EXPECT_TRUE(tracker.report().one_eye) << i;
  }
  const SE3 estimate = before.poses.back().estimate.inverse() * tracker.report().T_odom_frame;
  EXPECT_LT((estimate.t - Street::get().step(9, 21).t).norm(), 0.05);
  const Fed after = feed(tracker, 22, 30);
  EXPECT_EQ(after.tracked, 8);
  EXPECT_FALSE(tracker.report().one_eye);
  ASSERT_FALSE(after.keyframes.empty());
  for (const Keyframe& keyframe : after.keyframes) EXPECT_EQ(keyframe.source, MotionSource::kVision);
}

TEST(StereoTracker, EveryPairBecomesAKeyframeIfAsked) {
  TrackerOptions all;
  all.every_pair = true;
  StereoTracker tracker(street_session(), all);
  EXPECT_EQ(feed(tracker, 0, 12).keyframes.size(), 12u);
}

TEST(StereoTracker, LimitsTheRateOfKeyframesIfAsked) {
  StereoTracker often(street_session()), rare(street_session());
  rare.limit_keyframe_rate(0.5);
  const std::size_t many = feed(often, 0, 30).keyframes.size();
  const Fed fed = feed(rare, 0, 30);
  EXPECT_EQ(fed.tracked, 30);
  EXPECT_LT(fed.keyframes.size(), many);
  for (std::size_t i = 0; i < fed.keyframes.size(); ++i) {
    const Keyframe& keyframe = fed.keyframes[i];
    EXPECT_TRUE(check_keyframe(keyframe).ok()) << check_keyframe(keyframe).to_string();
    EXPECT_EQ(keyframe.sequence, i);
    if (i == 0) continue;
    EXPECT_EQ(keyframe.source, MotionSource::kVision);
    EXPECT_LT(nees(fed.keyframes[i - 1], keyframe), kChi2);
  }
  rare.limit_keyframe_rate(0);
  EXPECT_GE(feed(rare, 30, Street::kPairs).keyframes.size(), 2u);
}

TEST(StereoTracker, KeyframesOfOneEyeSaySo) {
  TrackerOptions often;
  often.parallax = 0.025;
  StereoTracker tracker(street_session(), often);
  Keyframe last = feed(tracker, 0, 10).keyframes.back();
  std::size_t keyframes = 0;
  for (std::size_t i = 10; i < 22; ++i) {
    auto keyframe = tracker.feed(prepare_pair(Street::get().left(i, 0), dark()), Street::get().time_us(i));
    ASSERT_TRUE(keyframe.ok());
    if (!keyframe->has_value()) continue;
    ++keyframes;
    EXPECT_EQ((*keyframe)->source, MotionSource::kOneEye);
    EXPECT_TRUE(check_keyframe(**keyframe).ok()) << check_keyframe(**keyframe).to_string();
    for (const TrackMeasurement& track : (*keyframe)->tracks) {
      EXPECT_TRUE(is_mono(track.pixel()));
      EXPECT_LT(track.track.sequence, (*keyframe)->sequence);  // one eye starts none
    }
    EXPECT_LT(nees(last, **keyframe), kChi2);
    last = std::move(**keyframe);
  }
  EXPECT_GE(keyframes, 1u);
}

TEST(StereoTracker, GoesOnWithTheRightEyeWhenTheLeftIsDark) {
  StereoTracker tracker(street_session());
  const Fed before = feed(tracker, 0, 10);
  for (std::size_t i = 10; i < 16; ++i) {
    const auto keyframe = tracker.feed(prepare_pair(dark(), Street::get().right(i, 0)), Street::get().time_us(i));
    ASSERT_TRUE(keyframe.ok());
    EXPECT_FALSE(keyframe->has_value());  // the left eye's pixels are what keyframes state
    EXPECT_TRUE(tracker.report().tracked) << i;
    EXPECT_TRUE(tracker.report().one_eye) << i;
  }
  const SE3 estimate = before.poses.back().estimate.inverse() * tracker.report().T_odom_frame;
  EXPECT_LT((estimate.t - Street::get().step(9, 15).t).norm(), 0.05);
  const Fed after = feed(tracker, 16, 24);
  EXPECT_EQ(after.tracked, 8);
  for (const Keyframe& keyframe : after.keyframes) EXPECT_EQ(keyframe.source, MotionSource::kVision);
}

TEST(StereoTracker, RefusesAPairFromAnotherPlaceAndGoesOn) {
  for (const std::size_t elsewhere : {150u, 260u, 370u}) {
    StereoTracker tracker(street_session());
    const Fed before = feed(tracker, 0, 6);
    ASSERT_TRUE(tracker.feed(Street::get().pair(elsewhere), Street::get().time_us(6)).ok());
    EXPECT_FALSE(tracker.report().tracked) << elsewhere;
    const Fed after = feed(tracker, 7, 12);
    EXPECT_EQ(after.tracked, 5) << elsewhere;
    for (const Keyframe& keyframe : after.keyframes) EXPECT_EQ(keyframe.source, MotionSource::kVision);
    const SE3 estimate = before.poses.back().estimate.inverse() * after.poses.back().estimate;
    EXPECT_LT((estimate.t - Street::get().step(5, 11).t).norm(), 0.03) << elsewhere;
  }
}

TEST(StereoTracker, RefusesAMotionThatTheRobotCannotMake) {
  TrackerOptions slow;
  slow.max_speed = 2;
  for (const bool in_time : {false, true}) {
    StereoTracker tracker(street_session(), slow);
    feed(tracker, 0, 1);
    const std::int64_t later_us = in_time ? 1'000'000 : 100'000;  // 0.6 m further on
    ASSERT_TRUE(tracker.feed(Street::get().pair(3), Street::get().time_us(0) + later_us).ok());
    EXPECT_EQ(tracker.report().tracked, in_time);
  }
  // Nor does it stop or jump from one pair to the next.
  StereoTracker driving(street_session());
  feed(driving, 0, 10);
  ASSERT_TRUE(driving.feed(Street::get().pair(13), Street::get().time_us(10)).ok());
  EXPECT_FALSE(driving.report().tracked);
  EXPECT_EQ(feed(driving, 11, 16).tracked, 5);
}

TEST(StereoTracker, TracksLongStepsAndUsesAHint) {
  StereoTracker tracker(street_session());
  const Fed fed = feed(tracker, 0, 45, 4);  // 0.8 m between pairs
  EXPECT_GE(fed.tracked, static_cast<int>(fed.poses.size()) - 2);

  StereoTracker hinted(street_session());
  feed(hinted, 0, 1);
  const SE3 step = Street::get().step(0, 6);
  ASSERT_TRUE(hinted.feed(Street::get().pair(6), Street::get().time_us(6), &step).ok());
  EXPECT_TRUE(hinted.report().tracked);
  EXPECT_LT((hinted.report().T_odom_frame.t - step.t).norm(), 0.05);
}

// Half a minute later and metres further, where it is not expected, the tracker recovers by descriptors or says that it
// is lost; it is never wrong (three metres further, this street has a facade like the one before).
TEST(StereoTracker, RecoversByDescriptorsAfterAGap) {
  for (const std::size_t gap : {5u, 8u, 15u}) {
    StereoTracker tracker(street_session());
    const Fed before = feed(tracker, 0, 3);
    const auto keyframe = tracker.feed(Street::get().pair(2 + gap), Street::get().time_us(2) + 30'000'000);
    ASSERT_TRUE(keyframe.ok() && keyframe->has_value());
    if (gap == 5) {
      EXPECT_EQ((*keyframe)->source, MotionSource::kVision);
    }
    if ((*keyframe)->source != MotionSource::kVision) continue;
    const SE3 truth = Street::get().step(2, 2 + gap);
    const SE3 estimate = before.poses.back().estimate.inverse() * (*keyframe)->T_odom_frame;
    EXPECT_LT((truth.t - estimate.t).norm(), 0.15) << gap;
  }
}

// Tracks a step from a view of `first` to a view of `second`, five seconds later.
Keyframe after_a_gap(const testing_wall::Wall& first, const testing_wall::Wall& second, const SE3& T_wall_second) {
  SessionHeader session = street_session();
  session.camera = testing_wall::kCamera;
  TrackerOptions options;
  options.every_pair = true;
  StereoTracker tracker(session, options);
  EXPECT_TRUE(tracker.feed(first.seen(SE3(), 1), 1'000'000).ok());
  const auto keyframe = tracker.feed(second.seen(T_wall_second, 2), 6'000'000);
  EXPECT_TRUE(keyframe.ok() && keyframe->has_value());
  return keyframe.ok() && keyframe->has_value() ? **keyframe : Keyframe();
}

double nees_of(const Keyframe& keyframe, const SE3& truth) {
  const Vector6 error = (keyframe.T_odom_frame.inverse() * truth).log();
  return mahalanobis_squared(error, keyframe.step_covariance);
}

// The middle of the wall repeats every 24 cm, as a chequerboard does, and the robot has moved by 20 cm: most of the
// landmarks near their old position suggest that it has moved by 4 cm the other way.
TEST(StereoTracker, IsNotDeceivedByAPatternThatRepeatsAfterAGap) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const testing_wall::Wall wall(seed, [](const Vector2& p) {
      return std::abs(p.x()) < 0.8 ? Vector2(p.x() - 0.24 * std::floor(p.x() / 0.24), p.y()) : p;
    });
    const SE3 truth{Matrix3::Identity(), {0.2, 0, 0}};
    const Keyframe keyframe = after_a_gap(wall, wall, truth);
    EXPECT_EQ(keyframe.source, MotionSource::kVision) << seed;
    EXPECT_LT((keyframe.T_odom_frame.t - truth.t).norm(), 0.02) << seed;
    EXPECT_LT(nees_of(keyframe, truth), kChi2) << seed;
  }
}

// Half of the picture says that the robot stood still, the other half that it moved by 30 cm, as when a gate opens in
// front of it. The two cannot be told apart, so the covariance must cover both.
TEST(StereoTracker, TheCovarianceCoversTwoPosesThatHalfThePictureSupportsEach) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const testing_wall::Wall before(seed);
    const testing_wall::Wall after(seed, [](const Vector2& p) { return p.x() < 0 ? Vector2(p.x() + 0.3, p.y()) : p; });
    const Keyframe keyframe = after_a_gap(before, after, SE3());
    for (const double moved : {0.0, 0.3}) {
      const double error = moved - keyframe.T_odom_frame.t.x();
      EXPECT_LT(error * error, 9 * keyframe.step_covariance(0, 0)) << seed << ": " << moved << " m";
    }
  }
}

// Two seconds of darkness before a bend: some thirty wrong matches once gave a pose among the points themselves, where
// each point is so near that it might appear anywhere.
TEST(StereoTracker, RejectsPosesAmongThePointsThemselves) {
  StereoTracker tracker(street_session());
  const Fed before = feed(tracker, 240, 248);
  for (std::size_t i = 248; i < 268; ++i) tracker.feed(dark_pair(), Street::get().time_us(i)).value();
  const Fed after = feed(tracker, 268, 270);
  ASSERT_FALSE(after.keyframes.empty());
  EXPECT_EQ(after.keyframes.front().source, MotionSource::kVision);
  EXPECT_LT(nees(before.keyframes.back(), after.keyframes.front()), kChi2);
  EXPECT_LT(after.keyframes.front().step_covariance(2, 2), 0.2 * 0.2);
}

TEST(StereoTracker, StandsStillWithoutKeyframesAndWithoutDrift) {
  StereoTracker tracker(street_session());
  for (unsigned i = 0; i < 20; ++i) {
    const auto keyframe =
        tracker.feed(prepare_pair(Street::get().left(0, i), Street::get().right(0, i)), 1'000'000 + i * 100'000);
    ASSERT_TRUE(keyframe.ok());
    EXPECT_EQ(keyframe->has_value(), i == 0);
    EXPECT_TRUE(tracker.report().tracked);
    EXPECT_FALSE(tracker.report().repeated);
  }
  EXPECT_LT(tracker.report().T_odom_frame.t.norm(), 0.01);
  EXPECT_LT(tracker.report().speed, 0.01);
}

// The robot moves at 8 m/s, sees nothing for two seconds, and then stands: the old speed must not be trusted for ever.
TEST(StereoTracker, FindsAChangedSpeedAfterDarkness) {
  StereoTracker tracker(street_session());
  std::int64_t time_us = 1'000'000;
  for (std::size_t i = 0; i <= 20; i += 2, time_us += 50'000)
    ASSERT_TRUE(tracker.feed(Street::get().pair(i), time_us).ok());
  EXPECT_TRUE(tracker.report().tracked);
  for (int i = 0; i < 40; ++i, time_us += 50'000) ASSERT_TRUE(tracker.feed(dark_pair(), time_us).ok());
  int keyframes = 0, tracked = 0;
  for (unsigned i = 0; i < 30; ++i, time_us += 50'000) {
    const auto keyframe = tracker.feed(prepare_pair(Street::get().left(44, i), Street::get().right(44, i)), time_us);
    ASSERT_TRUE(keyframe.ok());
    keyframes += keyframe->has_value();
    tracked += tracker.report().tracked;
  }
  EXPECT_LE(keyframes, 2);
  EXPECT_GE(tracked, 27);
  EXPECT_LT(tracker.report().speed, 0.05);
}

TEST(StereoTracker, GoesOnAfterAnInterruption) {
  StereoTracker whole(street_session());
  const Fed before = feed(whole, 0, 15);
  const Keyframe last = before.keyframes.back();
  const std::size_t own = frame_at(last.time_us);

  StereoTracker again(street_session());
  again.resume(last);
  const Fed after = feed(again, own, 30);
  ASSERT_GE(after.keyframes.size(), 2u);
  EXPECT_EQ(after.keyframes[0].sequence, last.sequence + 1);
  EXPECT_EQ(after.keyframes[0].source, MotionSource::kVision);
  EXPECT_TRUE(check_keyframe(after.keyframes[0]).ok());
  const SE3 estimate = last.T_odom_frame.inverse() * after.poses.back().estimate;
  EXPECT_LT((Street::get().step(own, 29).t - estimate.t).norm(), 0.05);

  // The robot is not where it stopped; it may have been carried.
  StereoTracker elsewhere(street_session());
  elsewhere.resume(last);
  const Fed carried = feed(elsewhere, own + 5, own + 6);
  ASSERT_EQ(carried.keyframes.size(), 1u);
  EXPECT_EQ(carried.keyframes[0].source, MotionSource::kUnsensed);
  EXPECT_TRUE(check_keyframe(carried.keyframes[0]).ok());
}

TEST(StereoTracker, RefusesWhatItCannotUse) {
  StereoTracker tracker(street_session());
  const auto pair = Street::get().pair(0);
  EXPECT_EQ(tracker.feed(prepare_pair(vision::Image(100, 100), pair->picture), 1000).reason(), Reason::BAD_SIZE);
  ASSERT_TRUE(tracker.feed(pair, 1000).ok());
  EXPECT_EQ(tracker.feed(pair, 1000).reason(), Reason::TIME_BACKWARDS);
  EXPECT_EQ(tracker.feed(pair, 900).reason(), Reason::TIME_BACKWARDS);
  EXPECT_TRUE(tracker.feed(pair, 2000).ok());
}

}  // namespace
}  // namespace relmap::tracking
