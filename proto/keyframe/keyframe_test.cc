#include "proto/keyframe/keyframe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "proto/base/crc32c.h"
#include "proto/keyframe/extension_codec.h"
#include "proto/keyframe/keyframe_samples.h"

namespace relmap {
namespace {

TEST(KeyframeBytes, DecodeGivesBackEveryField) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const Keyframe k = KeyframeSampler(seed).keyframe();
    const auto decoded = decode_keyframe(encode_keyframe(k));
    ASSERT_TRUE(decoded.ok()) << decoded.status().to_string();
    EXPECT_EQ(decoded->session, k.session);
    EXPECT_EQ(decoded->sequence, k.sequence);
    EXPECT_EQ(decoded->time_us, k.time_us);
    EXPECT_LT((decoded->T_odom_frame.R - k.T_odom_frame.R).cwiseAbs().maxCoeff(), 1e-13);
    EXPECT_EQ(decoded->T_odom_frame.t, k.T_odom_frame.t);
    EXPECT_EQ(decoded->step_covariance, k.step_covariance);
    EXPECT_EQ(decoded->source, k.source);
    EXPECT_EQ(decoded->driven_us, k.driven_us);
    EXPECT_EQ(decoded->standing_us, k.standing_us);
    ASSERT_EQ(decoded->tracks.size(), k.tracks.size());
    for (std::size_t i = 0; i < k.tracks.size(); ++i) {
      const TrackMeasurement &a = decoded->tracks[i], &b = k.tracks[i];
      EXPECT_EQ(a.track, b.track);
      EXPECT_EQ(a.u_left, b.u_left);
      EXPECT_EQ(a.v, b.v);
      EXPECT_THAT(a.u_right, ::testing::NanSensitiveFloatEq(b.u_right));
      EXPECT_EQ(a.level, b.level);
    }
    ASSERT_EQ(decoded->appearance.size(), k.appearance.size());
    for (std::size_t i = 0; i < k.appearance.size(); ++i) {
      const AppearanceFeature &a = decoded->appearance[i], &b = k.appearance[i];
      EXPECT_EQ(a.u, b.u);
      EXPECT_EQ(a.v, b.v);
      EXPECT_THAT(a.disparity, ::testing::NanSensitiveFloatEq(b.disparity));
      EXPECT_EQ(a.scale, b.scale);
      EXPECT_EQ(a.angle, b.angle);
      EXPECT_EQ(a.track, b.track);
      EXPECT_EQ(a.descriptor, b.descriptor);
    }
    EXPECT_EQ(decoded->picture, k.picture);
    EXPECT_EQ(decoded->unknown, k.unknown);
    EXPECT_EQ(check_keyframe(*decoded).to_string(), "OK");
  }
}

TEST(KeyframeBytes, EncodingWhatWasDecodedGivesTheSameBytes) {
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    const Bytes bytes = encode_keyframe(KeyframeSampler(seed).keyframe());
    EXPECT_EQ(encode_keyframe(*decode_keyframe(bytes)), bytes) << "seed " << seed;
  }
}

TEST(KeyframeBytes, AnyNaNForAMissingRightEyeGivesTheSameBytes) {
  Keyframe k = sample_keyframe();
  k.tracks[0].u_right = kNaN;
  const Bytes bytes = encode_keyframe(k);
  k.tracks[0].u_right = -std::numeric_limits<float>::signaling_NaN();
  EXPECT_EQ(encode_keyframe(k), bytes);
}

TEST(KeyframeBytes, EveryTruncationIsNamed) {
  Keyframe k = sample_keyframe();
  for (const Extensions& unknown : {Extensions(), Extensions{{1000, {1, 2, 3}}, {2000, {}}}}) {
    k.session.unknown = k.unknown = unknown;
    const Bytes bytes = encode_keyframe(k);
    for (std::size_t size = 0; size < bytes.size(); ++size)
      ASSERT_EQ(decode_keyframe(ByteSpan(bytes).first(size)).reason(), Reason::TRUNCATED) << size;
  }
}

// So that older daemons accept keyframes without extensions.
TEST(KeyframeBytes, AreOfVersion2OnlyIfThereAreExtensions) {
  Keyframe k = sample_keyframe();
  const Bytes first = encode_keyframe(k);
  EXPECT_EQ(first[4], 1);
  k.session.unknown = {{1000, {1}}};
  Bytes second = encode_keyframe(k);
  EXPECT_EQ(second[4], 2);
  EXPECT_EQ(Bytes(second.begin() + 6, second.begin() + static_cast<std::ptrdiff_t>(first.size())),
            Bytes(first.begin() + 6, first.end()));
  EXPECT_EQ(decode_keyframe(second)->session.unknown, k.session.unknown);
  second.resize(first.size());  // a keyframe has only one encoding
  second.insert(second.end(), 4, 0);
  EXPECT_EQ(decode_keyframe(second).reason(), Reason::CORRUPT);
}

TEST(KeyframeBytes, HoldTheRawCalibrationOfTheSession) {
  Keyframe k = sample_keyframe();
  k.session.raw = sample_raw_calibration(3);
  const Bytes bytes = encode_keyframe(k);
  EXPECT_EQ(bytes[4], 2);
  EXPECT_EQ(decode_keyframe(bytes)->session, k.session);
  EXPECT_TRUE(check_keyframe(k).ok());
  k.session.raw->rectified = true;
  EXPECT_EQ(check_keyframe(k).reason(), Reason::IMPLAUSIBLE_CALIBRATION);
  k.session.raw = sample_raw_calibration(3);
  k.session.raw->left.fx = -1;
  EXPECT_EQ(check_keyframe(k).reason(), Reason::IMPLAUSIBLE_CALIBRATION);

  constexpr std::uint32_t kRawCalibration = 21;
  k.session.raw.reset();
  k.session.unknown = {{kRawCalibration, Bytes(7)}};
  EXPECT_EQ(decode_keyframe(encode_keyframe(k)).reason(), Reason::CORRUPT);
}

TEST(KeyframeBytes, WithTooManyUnknownExtensionsAreRefused) {
  Keyframe k = sample_keyframe();
  k.unknown = {{5, Bytes(5000, 1)}};
  EXPECT_EQ(decode_keyframe(encode_keyframe(k)).reason(), Reason::BAD_SIZE);
  EXPECT_EQ(check_keyframe(k).reason(), Reason::BAD_SIZE);
  k.unknown = {{5, {}}, {5, {}}};
  EXPECT_EQ(decode_keyframe(encode_keyframe(k)).reason(), Reason::CORRUPT);
  EXPECT_EQ(check_keyframe(k).reason(), Reason::CORRUPT);
}

TEST(KeyframeBytes, BytesAfterTheEndAreCorrupt) {
  Bytes bytes = encode_keyframe(sample_keyframe());
  bytes.push_back(0);
  EXPECT_EQ(decode_keyframe(bytes).reason(), Reason::CORRUPT);
}

TEST(KeyframeBytes, AnotherVersionIsRefusedByName) {
  Bytes bytes = encode_keyframe(sample_keyframe());
  bytes[4] = 3;
  EXPECT_EQ(decode_keyframe(bytes).reason(), Reason::UNKNOWN_PROTOCOL_VERSION);
}

TEST(KeyframeBytes, ForeignBytesUnknownFlagsAndSourcesAreCorrupt) {
  for (const std::size_t offset : {0u, 6u, 7u}) {
    Bytes bytes = encode_keyframe(sample_keyframe());
    bytes[offset] = 0xf0;
    EXPECT_EQ(decode_keyframe(bytes).reason(), Reason::CORRUPT) << "byte " << offset;
  }
}

TEST(KeyframeBytes, MoreThanTheLimitIsABadSize) {
  EXPECT_EQ(decode_keyframe(Bytes(kMaxKeyframeBytes + 1)).reason(), Reason::BAD_SIZE);
  Keyframe k = sample_keyframe();
  k.tracks.clear();
  k.appearance.clear();
  k.picture.clear();
  for (const std::size_t from_end : {6u, 4u, 2u}) {  // the three counts are the last fields
    Bytes bytes = encode_keyframe(k);
    bytes[bytes.size() - from_end] = 0xff;
    bytes[bytes.size() - from_end + 1] = 0xff;
    EXPECT_EQ(decode_keyframe(bytes).reason(), Reason::BAD_SIZE);
  }
}

TEST(KeyframeBytes, TheLargestKeyframeFits) {
  Keyframe k = sample_keyframe();
  k.session.robot = k.session.name = std::string(kMaxNameBytes, 'r');
  k.tracks.resize(kMaxTracks);
  k.appearance.resize(kMaxAppearance);
  k.picture.assign(kMaxKeyframePictureBytes, 0xff);
  k.session.unknown = k.unknown = {{1000, Bytes(kMaxExtensionBytes - 10, 1)}};
  const Bytes bytes = encode_keyframe(k);
  EXPECT_LE(bytes.size(), kMaxKeyframeBytes);
  EXPECT_TRUE(decode_keyframe(bytes).ok());
}

// Keyframes are on disks and in logs, so this checksum may only change together with kKeyframeVersion.
TEST(KeyframeBytes, LayoutIsFrozen) {
  Keyframe k;
  k.session.uuid = *SessionUuid::parse("00112233-4455-6677-8899-aabbccddeeff");
  k.session.robot = "r";
  k.session.name = "s";
  k.session.camera = {400, 256, 192, 0.12, 512, 384};
  k.sequence = 5;
  k.time_us = 1'700'000'000'000'000;
  k.source = MotionSource::kVision;
  k.step_covariance = Matrix6::Identity();
  k.tracks.push_back({{4, 2}, 100.5f, 50.25f, kNaN, 1});
  k.appearance.push_back({10, 20, kNaN, 8, 0.5f, 0, {}});
  const Bytes bytes = encode_keyframe(k);
  EXPECT_EQ(bytes.size(), 499u);
  EXPECT_EQ(crc32c(bytes), 3218155920u);
}

}  // namespace
}  // namespace relmap
