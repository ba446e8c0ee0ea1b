#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <string>

#include "proto/keyframe/keyframe.h"
#include "proto/keyframe/keyframe_samples.h"

namespace relmap {
namespace {

struct BadKeyframe {
  const char* name;
  Reason reason;
  std::function<void(Keyframe&)> spoil;
};

std::string bad_keyframe_name(const ::testing::TestParamInfo<BadKeyframe>& bad) { return bad.param.name; }

class RefusedKeyframe : public ::testing::TestWithParam<BadKeyframe> {};

TEST_P(RefusedKeyframe, IsRefusedWithItsReason) {
  Keyframe k = sample_keyframe();
  ASSERT_EQ(check_keyframe(k).to_string(), "OK");
  GetParam().spoil(k);
  const Status status = check_keyframe(k);
  EXPECT_EQ(status.reason(), GetParam().reason) << status.to_string();
  EXPECT_FALSE(status.message().empty());
}

constexpr double kInf = std::numeric_limits<double>::infinity();

INSTANTIATE_TEST_SUITE_P(
    Check, RefusedKeyframe,
    ::testing::Values(
        BadKeyframe{"NilUuid", Reason::BAD_NAME, [](Keyframe& k) { k.session.uuid = {}; }},
        BadKeyframe{"NoRobot", Reason::BAD_NAME, [](Keyframe& k) { k.session.robot.clear(); }},
        BadKeyframe{"LongName", Reason::BAD_NAME, [](Keyframe& k) { k.session.name.assign(65, 'a'); }},
        BadKeyframe{"NameNotUtf8", Reason::BAD_NAME, [](Keyframe& k) { k.session.name = "\xc3("; }},
        BadKeyframe{"Camera", Reason::IMPLAUSIBLE_CALIBRATION, [](Keyframe& k) { k.session.camera.f = 1; }},
        BadKeyframe{"CameraNaN", Reason::IMPLAUSIBLE_CALIBRATION, [](Keyframe& k) { k.session.camera.cx = kNaN; }},
        BadKeyframe{"Tracks", Reason::BAD_SIZE, [](Keyframe& k) { k.tracks.resize(kMaxTracks + 1); }},
        BadKeyframe{"Features", Reason::BAD_SIZE, [](Keyframe& k) { k.appearance.resize(kMaxAppearance + 1); }},
        BadKeyframe{"Picture", Reason::BAD_SIZE,
                    [](Keyframe& k) { k.picture.assign(kMaxKeyframePictureBytes + 1, 0xff); }},
        BadKeyframe{"NoJpeg", Reason::NOT_A_PICTURE, [](Keyframe& k) { k.picture = {0x89, 'P', 'N', 'G'}; }},
        BadKeyframe{"TimeNegative", Reason::BAD_DURATION, [](Keyframe& k) { k.time_us = -1; }},
        BadKeyframe{"TimeAbsurd", Reason::BAD_DURATION, [](Keyframe& k) { k.time_us = kMaxTimeUs + 1; }},
        BadKeyframe{"DrivenNegative", Reason::BAD_DURATION, [](Keyframe& k) { k.driven_us = -1; }},
        BadKeyframe{"StandingNegative", Reason::BAD_DURATION, [](Keyframe& k) { k.standing_us = -1; }},
        BadKeyframe{"PoseNaN", Reason::NOT_FINITE, [](Keyframe& k) { k.T_odom_frame.t.x() = kNaN; }},
        BadKeyframe{"RotationNaN", Reason::NOT_FINITE, [](Keyframe& k) { k.T_odom_frame.R(1, 1) = kNaN; }},
        BadKeyframe{"RotationScaled", Reason::BAD_ROTATION, [](Keyframe& k) { k.T_odom_frame.R *= 1.01; }},
        BadKeyframe{"RotationMirrored", Reason::BAD_ROTATION, [](Keyframe& k) { k.T_odom_frame.R *= -1; }},
        BadKeyframe{"PoseFarAway", Reason::BAD_MOTION, [](Keyframe& k) { k.T_odom_frame.t.y() = -1.1e7; }},
        BadKeyframe{"CovarianceInfinite", Reason::NOT_FINITE, [](Keyframe& k) { k.step_covariance(2, 3) = kInf; }},
        BadKeyframe{"CovarianceZero", Reason::BAD_COVARIANCE, [](Keyframe& k) { k.step_covariance.setZero(); }},
        BadKeyframe{"CovarianceAskew", Reason::BAD_COVARIANCE, [](Keyframe& k) { k.step_covariance(0, 1) += 1e-3; }},
        BadKeyframe{"CovarianceIndefinite", Reason::BAD_COVARIANCE,
                    [](Keyframe& k) {
                      k.step_covariance.setIdentity();
                      k.step_covariance(0, 1) = k.step_covariance(1, 0) = 1.5;
                    }},
        BadKeyframe{"StartWithAStep", Reason::BAD_COVARIANCE, [](Keyframe& k) { k.source = MotionSource::kStart; }},
        BadKeyframe{"TrackNaN", Reason::NOT_FINITE, [](Keyframe& k) { k.tracks[0].v = kNaN; }},
        BadKeyframe{"TrackRightInfinite", Reason::NOT_FINITE,
                    [](Keyframe& k) { k.tracks[0].u_right = -static_cast<float>(kInf); }},
        BadKeyframe{"TrackFromTheFuture", Reason::BAD_TRACK,
                    [](Keyframe& k) { k.tracks[0].track.sequence = k.sequence + 1; }},
        BadKeyframe{"TrackTwice", Reason::BAD_TRACK, [](Keyframe& k) { k.tracks.push_back(k.tracks[0]); }},
        BadKeyframe{"TrackLevel", Reason::BAD_TRACK, [](Keyframe& k) { k.tracks[0].level = kMaxPyramidLevel + 1; }},
        BadKeyframe{"TrackOutside", Reason::OUTSIDE_PICTURE, [](Keyframe& k) { k.tracks[0].u_left = 512; }},
        BadKeyframe{"TrackBelow", Reason::OUTSIDE_PICTURE, [](Keyframe& k) { k.tracks[0].v = 384; }},
        BadKeyframe{"TrackBehind", Reason::OUTSIDE_PICTURE,
                    [](Keyframe& k) { k.tracks[0].u_right = k.tracks[0].u_left + 0.1f; }},
        BadKeyframe{"TrackRightOutside", Reason::OUTSIDE_PICTURE, [](Keyframe& k) { k.tracks[0].u_right = -1; }},
        BadKeyframe{"TracksOfOneCamera", Reason::NOT_STEREO,
                    [](Keyframe& k) {
                      k.session.camera.baseline = 0;
                      for (TrackMeasurement& track : k.tracks) track.u_right = kNaN;
                    }},
        BadKeyframe{"FeatureNaN", Reason::NOT_FINITE, [](Keyframe& k) { k.appearance[0].angle = kNaN; }},
        BadKeyframe{"FeatureOutside", Reason::OUTSIDE_PICTURE, [](Keyframe& k) { k.appearance[0].u = -1; }},
        BadKeyframe{"FeatureDisparity", Reason::OUTSIDE_PICTURE, [](Keyframe& k) { k.appearance[0].disparity = -1; }},
        BadKeyframe{"FeatureScale", Reason::BAD_SIZE, [](Keyframe& k) { k.appearance[0].scale = 0; }},
        BadKeyframe{"FeatureDisparityFromMono", Reason::NOT_STEREO,
                    [](Keyframe& k) {
                      k.session.camera.baseline = 0;
                      k.tracks.clear();
                      for (AppearanceFeature& feature : k.appearance) feature.track = -1;
                      k.appearance[0].disparity = 1;
                    }},
        BadKeyframe{"FeatureTrack", Reason::BAD_TRACK,
                    [](Keyframe& k) { k.appearance[0].track = static_cast<std::int16_t>(k.tracks.size()); }},
        BadKeyframe{"FeatureTrackNegative", Reason::BAD_TRACK, [](Keyframe& k) { k.appearance[0].track = -2; }}),
    bad_keyframe_name);

// Offset of the pose's quaternion (w, x, y, z) when robot and name have one letter each.
constexpr std::size_t kQuaternion = 8 + 16 + 3 + 3 + 4 * 8 + 2 * 4 + 4 + 8;

Reason reason_with_w(const Keyframe& k, double w) {
  Bytes bytes = encode_keyframe(k);
  std::memcpy(bytes.data() + kQuaternion, &w, sizeof w);
  const auto decoded = decode_keyframe(bytes);
  return decoded.ok() ? check_keyframe(*decoded).reason() : decoded.reason();
}

TEST(KeyframeCheck, RefusesBytesWhoseQuaternionIsNoRotation) {
  Keyframe k = sample_keyframe();
  k.session.robot = k.session.name = "a";
  k.T_odom_frame.R.setIdentity();
  EXPECT_EQ(reason_with_w(k, 1 + 1e-9), Reason::OK);
  EXPECT_EQ(reason_with_w(k, 1.01), Reason::BAD_ROTATION);
  EXPECT_EQ(reason_with_w(k, 0), Reason::BAD_ROTATION);
  EXPECT_EQ(reason_with_w(k, kNaN), Reason::NOT_FINITE);
}

TEST(KeyframeCheck, EncodingDoesNotHideABadPose) {
  Keyframe k = sample_keyframe();
  k.T_odom_frame.R *= 1.01;
  EXPECT_EQ(check_keyframe(*decode_keyframe(encode_keyframe(k))).reason(), Reason::BAD_ROTATION);
  k.T_odom_frame.R(0, 0) = kNaN;
  EXPECT_EQ(check_keyframe(*decode_keyframe(encode_keyframe(k))).reason(), Reason::NOT_FINITE);
}

}  // namespace
}  // namespace relmap
