#include "storage/format/chunk_codec.h"

#include <gtest/gtest.h>

#include "storage/format/frame_codec.h"
#include "storage/testing/random_frames.h"

namespace relmap::storage {
namespace {

Bytes body_of(const FrameWarm& frame) {
  ByteWriter w;
  encode_warm(w, {3, 576}, frame);
  return w.take();
}

// A part of three frames, and the bodies in it.
struct Sample {
  std::vector<std::pair<std::uint32_t, Bytes>> bodies;
  Bytes bytes;
};
Sample sample(std::uint64_t seed) {
  RandomFrames random(seed);
  Sample s;
  PartWriter writer(Part::kWarm, {3, 9}, 17);
  for (const std::uint32_t slot : {0u, 5u, 63u}) {
    s.bodies.emplace_back(slot, body_of(random.warm()));
    writer.add(slot, s.bodies.back().second);
  }
  s.bytes = writer.finish();
  return s;
}

// True if the part opens and every body passes its checksum.
bool whole(ByteSpan bytes) {
  const auto reader = PartReader::open(bytes, Part::kWarm, {3, 9});
  if (!reader.ok()) return false;
  for (std::size_t i = 0; i < reader->size(); ++i)
    if (!reader->body(i).ok()) return false;
  return true;
}

TEST(ChunkCodec, GivesBackEachBodyUnderItsSlot) {
  const Sample s = sample(1);
  const auto reader = PartReader::open(s.bytes, Part::kWarm, {3, 9});
  ASSERT_TRUE(reader.ok()) << reader.status().to_string();
  EXPECT_EQ(reader->commit(), 17u);
  ASSERT_EQ(reader->size(), s.bodies.size());
  for (std::size_t i = 0; i < s.bodies.size(); ++i) {
    EXPECT_EQ(reader->slot(i), s.bodies[i].first);
    const ByteSpan body = reader->body(i).value();
    EXPECT_EQ(Bytes(body.begin(), body.end()), s.bodies[i].second);
  }
}

TEST(ChunkCodec, RefusesEveryTruncationAndTrailingBytes) {
  Sample s = sample(2);
  for (std::size_t size = 0; size < s.bytes.size(); ++size) EXPECT_FALSE(whole(ByteSpan(s.bytes).first(size))) << size;
  s.bytes.push_back(0);
  EXPECT_FALSE(whole(s.bytes));
}

TEST(ChunkCodec, RefusesEveryFlippedBit) {
  Sample s = sample(3);
  ASSERT_TRUE(whole(s.bytes));
  for (std::size_t bit = 0; bit < 8 * s.bytes.size(); ++bit) {
    s.bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    EXPECT_FALSE(whole(s.bytes)) << bit;
    s.bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
  }
}

TEST(ChunkCodec, DamageToOneFrameLeavesTheOthersReadable) {
  Sample s = sample(4);
  s.bytes.back() ^= 1;
  const auto reader = PartReader::open(s.bytes, Part::kWarm, {3, 9});
  ASSERT_TRUE(reader.ok());
  EXPECT_TRUE(reader->body(0).ok());
  EXPECT_TRUE(reader->body(1).ok());
  EXPECT_EQ(reader->body(2).reason(), Reason::CORRUPT);
}

TEST(ChunkCodec, RefusesAnotherPartOrChunkThanAskedFor) {
  const Sample s = sample(5);
  EXPECT_EQ(PartReader::open(s.bytes, Part::kHot, {3, 9}).reason(), Reason::CORRUPT);
  EXPECT_EQ(PartReader::open(s.bytes, Part::kWarm, {3, 8}).reason(), Reason::CORRUPT);
}

}  // namespace
}  // namespace relmap::storage
