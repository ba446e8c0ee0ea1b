#include "frontend/tracking/tracker.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <vector>

#include "frontend/tracking/drift.h"
#include "tools/sim/picture_world.h"

namespace relmap {
namespace {

// A short drive down a rendered street; pairs are rendered when they are first asked for.
class Street {
 public:
  static Street& get() {
    static Street street;
    return street;
  }
  struct Pair {
    Image left, right;
    std::int64_t time_us;
    SE3 truth;
  };
  static constexpr std::size_t kPairs = 45;

  const StereoCamera& camera() const { return world_.options().camera; }
  const Pair& pair(std::size_t i) {
    if (!pairs_[i]) {
      const int frame = static_cast<int>(i);
      const StereoPictures pictures = world_.render(frame);
      pairs_[i] = Pair{copy(pictures.left), copy(pictures.right), world_.time_us(frame), world_.truth(frame)};
    }
    return *pairs_[i];
  }

 private:
  static PictureWorldOptions options() {
    PictureWorldOptions options;
    options.seed = 12;
    return options;
  }
  static Image copy(const GreyPicture& picture) {
    Image image(picture.width, picture.height);
    std::copy(picture.pixels.begin(), picture.pixels.end(), image.row(0));
    return image;
  }
  PictureWorld world_{options()};
  std::array<std::optional<Pair>, kPairs> pairs_;
};

SessionHeader header() {
  SessionHeader session;
  session.uuid.bytes[0] = 1;
  session.robot = "robot";
  session.name = "street";
  session.camera = Street::get().camera();
  return session;
}

TrackerOptions quick() {
  TrackerOptions options;
  options.appearance = 0;
  options.thumbnails = false;
  return options;
}

struct Fed {
  std::vector<Keyframe> keyframes;
  std::vector<PosePair> poses;
  int tracked = 0;
};

Fed feed(StereoTracker& tracker, std::size_t from, std::size_t to, std::size_t step = 1) {
  Fed fed;
  for (std::size_t i = from; i < to; i += step) {
    const auto& pair = Street::get().pair(i);
    auto keyframe = tracker.feed(pair.left, pair.right, pair.time_us);
    EXPECT_TRUE(keyframe.ok()) << keyframe.status().to_string();
    fed.tracked += tracker.report().tracked;
    fed.poses.push_back({pair.truth, tracker.report().T_odom_frame});
    if (keyframe.ok() && keyframe->has_value()) fed.keyframes.push_back(std::move(**keyframe));
  }
  return fed;
}

const Image& blank() {
  static const Image image = [] {
    Image grey(Street::get().camera().width, Street::get().camera().height);
    std::fill_n(grey.row(0), grey.width() * grey.height(), std::uint8_t{90});
    return grey;
  }();
  return image;
}

TEST(StereoTracker, FollowsADriveWithoutDrift) {
  StereoTracker tracker(header(), quick());
  const Fed fed = feed(tracker, 0, Street::kPairs);
  EXPECT_EQ(fed.tracked, static_cast<int>(fed.poses.size()) - 1);
  const Drift drift = measure_drift(fed.poses, 5);
  EXPECT_GT(drift.segments, 10u);
  EXPECT_LT(drift.translation, 0.006);
  EXPECT_LT(drift.rotation, 0.002);
}

TEST(StereoTracker, KeyframesAreSoundAndShareTracks) {
  StereoTracker tracker(header());
  const Fed fed = feed(tracker, 0, 30);
  ASSERT_GE(fed.keyframes.size(), 4u);
  std::set<TrackId> before;
  for (std::size_t i = 0; i < fed.keyframes.size(); ++i) {
    const Keyframe& keyframe = fed.keyframes[i];
    EXPECT_TRUE(check_keyframe(keyframe).ok()) << check_keyframe(keyframe).to_string();
    EXPECT_EQ(keyframe.sequence, i);
    EXPECT_EQ(keyframe.source, i == 0 ? MotionSource::kStart : MotionSource::kVision);
    EXPECT_GE(keyframe.tracks.size(), 100u);
    EXPECT_EQ(keyframe.appearance.size(), 300u);
    EXPECT_FALSE(keyframe.thumbnail.empty());
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
    std::size_t described = 0, deep = 0;
    for (const AppearanceFeature& feature : keyframe.appearance) {
      described += feature.track >= 0;
      deep += !std::isnan(feature.disparity);
    }
    EXPECT_EQ(described, keyframe.tracks.size());
    EXPECT_GT(deep, 200u);
    before = std::move(now);
  }
}

TEST(StereoTracker, SamePicturesSameBytes) {
  StereoTracker a(header(), quick()), b(header(), quick());
  const Fed first = feed(a, 0, 15), second = feed(b, 0, 15);
  ASSERT_EQ(first.keyframes.size(), second.keyframes.size());
  for (std::size_t i = 0; i < first.keyframes.size(); ++i)
    EXPECT_EQ(encode_keyframe(first.keyframes[i]), encode_keyframe(second.keyframes[i]));
}

TEST(StereoTracker, BridgesABlindMomentWithoutANewStart) {
  StereoTracker tracker(header(), quick());
  Fed fed = feed(tracker, 0, 10);
  const auto& dark = Street::get().pair(10);
  ASSERT_TRUE(tracker.feed(blank(), blank(), dark.time_us).ok());
  EXPECT_FALSE(tracker.report().tracked);
  const Fed after = feed(tracker, 11, 20);
  EXPECT_EQ(after.tracked, 9);
  for (const Keyframe& keyframe : after.keyframes) EXPECT_EQ(keyframe.source, MotionSource::kVision);
}

TEST(StereoTracker, StartsAgainByConstantVelocityWhenItWasBlindTooLong) {
  StereoTracker tracker(header(), quick());
  Fed fed = feed(tracker, 0, 10);
  for (std::size_t i = 10; i < 30; ++i) {
    const auto keyframe = tracker.feed(blank(), blank(), Street::get().pair(i).time_us);
    ASSERT_TRUE(keyframe.ok());
    EXPECT_FALSE(keyframe->has_value());  // nothing to start from
  }
  const Fed after = feed(tracker, 30, 40);
  ASSERT_GE(after.keyframes.size(), 2u);
  const Keyframe& bridge = after.keyframes.front();
  EXPECT_EQ(bridge.source, MotionSource::kConstantVelocity);
  EXPECT_TRUE(check_keyframe(bridge).ok()) << check_keyframe(bridge).to_string();
  EXPECT_EQ(after.keyframes[1].source, MotionSource::kVision);
  // The error of the bridge is within what its covariance says.
  const SE3 truth = Street::get().pair(9).truth.inverse() * Street::get().pair(30).truth;
  const SE3 estimate = fed.poses.back().estimate.inverse() * bridge.T_odom_frame;
  const Vector6 error = (estimate.inverse() * truth).log();
  EXPECT_LT(error.dot(bridge.step_covariance.ldlt().solve(error)), 16.8);  // chi2_6(0.99)
  EXPECT_GT(std::sqrt(bridge.step_covariance(2, 2)), 0.5);
}

TEST(StereoTracker, TakesLongStepsAndAHint) {
  StereoTracker tracker(header(), quick());
  const Fed fed = feed(tracker, 0, 45, 4);  // 0.8 m between pairs
  EXPECT_GE(fed.tracked, static_cast<int>(fed.poses.size()) - 2);

  StereoTracker hinted(header(), quick());
  feed(hinted, 0, 1);
  const auto &from = Street::get().pair(0), &to = Street::get().pair(6);
  const SE3 step = from.truth.inverse() * to.truth;
  ASSERT_TRUE(hinted.feed(to.left, to.right, to.time_us, &step).ok());
  EXPECT_TRUE(hinted.report().tracked);
  EXPECT_LT((hinted.report().T_odom_frame.t - step.t).norm(), 0.05);
}

// Half a minute later and metres on, where nobody expects it: found by descriptors, or honestly lost; never wrong
// (three metres on, this street has a facade like the one before).
TEST(StereoTracker, FindsItselfByDescriptorsAfterAGap) {
  TrackerOptions options = quick();
  options.appearance = 300;
  for (const std::size_t gap : {5u, 8u, 15u}) {
    StereoTracker tracker(header(), options);
    const Fed before = feed(tracker, 0, 3);
    const auto &from = Street::get().pair(2), &to = Street::get().pair(2 + gap);
    const auto keyframe = tracker.feed(to.left, to.right, from.time_us + 30'000'000);
    ASSERT_TRUE(keyframe.ok() && keyframe->has_value());
    if (gap == 5) {
      EXPECT_EQ((*keyframe)->source, MotionSource::kVision);
    }
    if ((*keyframe)->source != MotionSource::kVision) continue;
    const SE3 truth = from.truth.inverse() * to.truth;
    const SE3 estimate = before.poses.back().estimate.inverse() * (*keyframe)->T_odom_frame;
    EXPECT_LT((truth.t - estimate.t).norm(), 0.15) << gap;
  }
}

TEST(StereoTracker, StandsStillWithoutKeyframesAndWithoutDrift) {
  StereoTracker tracker(header(), quick());
  const auto& pair = Street::get().pair(0);
  ASSERT_TRUE(tracker.feed(pair.left, pair.right, 1'000'000).ok());
  for (int i = 1; i < 20; ++i) {
    const auto keyframe = tracker.feed(pair.left, pair.right, 1'000'000 + i * 100'000);
    ASSERT_TRUE(keyframe.ok());
    EXPECT_FALSE(keyframe->has_value());
  }
  EXPECT_LT(tracker.report().T_odom_frame.t.norm(), 0.01);
  EXPECT_LT(tracker.report().speed, 0.01);
}

TEST(StereoTracker, GoesOnAfterAnInterruption) {
  StereoTracker whole(header(), quick());
  const Fed before = feed(whole, 0, 15);
  const Keyframe last = before.keyframes.back();
  std::size_t own = 0;
  while (Street::get().pair(own).time_us != last.time_us) ++own;

  StereoTracker again(header(), quick());
  again.resume(last);
  const Fed after = feed(again, own, 30);
  ASSERT_GE(after.keyframes.size(), 2u);
  EXPECT_EQ(after.keyframes[0].sequence, last.sequence + 1);
  EXPECT_EQ(after.keyframes[0].source, MotionSource::kVision);
  EXPECT_TRUE(check_keyframe(after.keyframes[0]).ok());
  const SE3 truth = Street::get().pair(own).truth.inverse() * Street::get().pair(29).truth;
  const SE3 estimate = last.T_odom_frame.inverse() * after.poses.back().estimate;
  EXPECT_LT((truth.t - estimate.t).norm(), 0.05);

  // Not where it stopped: the robot may have been carried.
  StereoTracker elsewhere(header(), quick());
  elsewhere.resume(last);
  const Fed carried = feed(elsewhere, own + 5, own + 6);
  ASSERT_EQ(carried.keyframes.size(), 1u);
  EXPECT_EQ(carried.keyframes[0].source, MotionSource::kUnsensed);
  EXPECT_TRUE(check_keyframe(carried.keyframes[0]).ok());
}

TEST(StereoTracker, RefusesWhatItCannotUse) {
  StereoTracker tracker(header(), quick());
  const auto& pair = Street::get().pair(0);
  const Image small(100, 100);
  EXPECT_EQ(tracker.feed(small, pair.right, 1000).reason(), Reason::BAD_SIZE);
  ASSERT_TRUE(tracker.feed(pair.left, pair.right, 1000).ok());
  EXPECT_EQ(tracker.feed(pair.left, pair.right, 1000).reason(), Reason::TIME_BACKWARDS);
  EXPECT_EQ(tracker.feed(pair.left, pair.right, 900).reason(), Reason::TIME_BACKWARDS);
  EXPECT_TRUE(tracker.feed(pair.left, pair.right, 2000).ok());
}

}  // namespace
}  // namespace relmap
