#include "storage/format/digest_codec.h"

#include <gtest/gtest.h>

#include <cmath>

#include "storage/testing/digest_oracle.h"
#include "storage/testing/random_frames.h"

namespace relmap::storage {
namespace {

constexpr ChunkId kChunk{3, 9};

// A chunk with a frame in about every second slot, without numbers that are not finite.
ChunkDigest sample(RandomFrames& random) {
  ChunkDigest digests{kChunk, {}};
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if (random.below(2) == 0) continue;
    const FrameId id = frame_in(kChunk, slot);
    FrameHot hot = random.hot(id);
    if (random.below(3) > 0) hot.edges.insert(hot.edges.begin(), random.edge(id, 0));
    digests.frames.push_back(digest_of(id, hot));
  }
  return digests;
}

TEST(DigestCodec, GivesBackWhatWasStoredAndStoresItTheSameAgain) {
  RandomFrames random(1);
  std::size_t closures = 0;
  for (int round = 0; round < 100; ++round) {
    const ChunkDigest digests = sample(random);
    const Bytes record = digest_bytes(digests);
    ChunkDigest read = sample(random);  // whatever it held before
    ASSERT_TRUE(decode_digests(record, kChunk, read).ok());
    ASSERT_EQ(read.id, kChunk);
    ASSERT_EQ(read.frames.size(), digests.frames.size());
    for (std::size_t i = 0; i < read.frames.size(); ++i) {
      const FrameId id = frame_in(kChunk, digests.frames[i].slot);
      EXPECT_TRUE(agree(read.frames[i], as_stored(id, digests.frames[i])));
      EXPECT_EQ(read.frames[i].time_us, digests.frames[i].time_us);
      closures += read.frames[i].closures.size();
    }
    ChunkDigest again;
    ASSERT_TRUE(decode_digests(digest_bytes(read), kChunk, again).ok());
    for (std::size_t i = 0; i < read.frames.size(); ++i) EXPECT_TRUE(agree(read.frames[i], again.frames[i]));
  }
  EXPECT_GT(closures, 500u);
}

TEST(DigestCodec, KeepsThePrecisionThatItStates) {
  RandomFrames random(2);
  constexpr double kPose = 1.0 / (1 << 15);
  for (int round = 0; round < 20000; ++round) {
    const double scale = std::ldexp(1.0, static_cast<int>(random.below(40)) - 30);
    FrameDigest digest{.joined = true, .driven_s = static_cast<float>(std::abs(random.real()))};
    const Vector6 xi = random.transform().log();
    digest.T_previous_frame = SE3{so3_exp(xi.tail<3>() * std::min(scale, 3.0)), xi.head<3>() * scale};
    digest.translation_variance = static_cast<float>(scale * scale);
    const FrameDigest stored = as_stored({1, 0}, digest);
    const SE3 &given = digest.T_previous_frame, &kept = stored.T_previous_frame;
    EXPECT_LE((kept.t - given.t).cwiseAbs().maxCoeff(), kPose * given.t.cwiseAbs().maxCoeff());
    const double turn = so3_log(given.R).norm(), error = so3_log(given.R.transpose() * kept.R).norm();
    EXPECT_LE(error, std::min(4 * kPose * turn, 8e-5)) << turn;
    EXPECT_NEAR(stored.translation_variance, digest.translation_variance, digest.translation_variance / 256);
    if (std::isfinite(digest.driven_s)) {
      EXPECT_NEAR(stored.driven_s, digest.driven_s, digest.driven_s / 256);
    }
  }
}

TEST(DigestCodec, TakesWhatCannotBeAPose) {
  for (const double odd : {std::nan(""), std::numeric_limits<double>::infinity(), 1e300, 1e-300}) {
    FrameDigest digest{.joined = true};
    digest.T_previous_frame.t = {odd, 1, 0};
    digest.T_previous_frame.R(1, 2) = odd;
    digest.translation_variance = static_cast<float>(odd);
    const FrameDigest stored = as_stored({1, 0}, digest);
    EXPECT_TRUE(stored.T_previous_frame.t.allFinite());
    EXPECT_TRUE(stored.T_previous_frame.R.allFinite());
    EXPECT_TRUE(agree(stored, as_stored({1, 0}, stored)));
  }
}

TEST(DigestCodec, TellsDigestsApart) {
  RandomFrames random(3);
  const FrameId id{3, 577};
  FrameHot hot = random.hot(id);
  hot.edges = {random.edge(id, 0), random.edge(id, 1)};
  hot.edges[1].inliers = 100;
  hot.edges[1].T_ab.t = {1, 2, 3};
  const FrameDigest digest = as_stored(id, digest_of(id, hot));
  EXPECT_TRUE(agree(digest, digest));
  const auto differs = [&](auto change) {
    FrameDigest other = digest;
    change(other);
    EXPECT_FALSE(agree(digest, as_stored(id, other)));
  };
  differs([](FrameDigest& d) { ++d.time_us; });
  differs([](FrameDigest& d) { d.labelled = !d.labelled; });
  differs([](FrameDigest& d) { d.unmeasured = !d.unmeasured; });
  differs([](FrameDigest& d) { d.T_previous_frame.t *= 1.001; });
  differs([](FrameDigest& d) { d.T_previous_frame.R = so3_exp({0, 0, 0.001}) * d.T_previous_frame.R; });
  differs([](FrameDigest& d) { d.closures.clear(); });
  differs([](FrameDigest& d) { ++d.closures[0].inliers; });
  differs([](FrameDigest& d) { d.closures[0].T_ab.t.x() += 0.001; });
  differs([](FrameDigest& d) { ++d.closures[0].a.index; });
}

TEST(DigestCodec, EntriesAreCopiedAsTheyAre) {
  RandomFrames random(4);
  const ChunkDigest digests = sample(random);
  const Bytes record = digest_bytes(digests);
  const auto packed = unpack_digests(record, kChunk);
  ASSERT_TRUE(packed.ok());
  DigestWriter writer(kChunk, packed->time_us);
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
    if (!packed->entries[slot].empty()) writer.copy(slot, packed->entries[slot], packed->has_closures(slot));
  EXPECT_EQ(writer.finish(), record);
  EXPECT_TRUE(DigestWriter(kChunk, 5).empty());
}

TEST(DigestCodec, DamageIsFound) {
  RandomFrames random(5);
  Bytes record = digest_bytes(sample(random));
  ChunkDigest read;
  EXPECT_EQ(decode_digests(record, {3, 10}, read).reason(), Reason::CORRUPT);
  for (std::size_t size = 0; size < record.size(); ++size)
    EXPECT_FALSE(decode_digests(ByteSpan(record).first(size), kChunk, read).ok());
  for (std::size_t bit = 0; bit < 8 * record.size(); bit += 1 + random.below(20)) {
    record[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    EXPECT_FALSE(decode_digests(record, kChunk, read).ok()) << bit;
    record[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
  }
}

// What a map of a million frames takes: docs/storage-format.md.
TEST(DigestCodec, IsSmall) {
  RandomFrames random(6);
  ChunkDigest digests{kChunk, {}};
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    FrameDigest frame{.slot = slot, .time_us = 1'700'000'000'000'000 + slot * 400'000, .joined = true};
    frame.T_previous_frame = random.transform();
    frame.translation_variance = 1e-4F;
    digests.frames.push_back(frame);
  }
  const std::size_t frames = digest_bytes(digests).size();
  EXPECT_LE(frames, 31 * kFramesPerChunk);
  Edge closure = random.edge(frame_in(kChunk, 5), 1);
  closure.a = {1, 1234};
  closure.uniqueness.known = true;
  digests.frames[5].closures.push_back(digest_of(closure));
  EXPECT_LE(digest_bytes(digests).size() - frames, 70u);
}

}  // namespace
}  // namespace relmap::storage
