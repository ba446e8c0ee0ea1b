#include "storage/frame_codec.h"

#include <gtest/gtest.h>

#include "storage/testing/random_frames.h"

namespace relmap {
namespace {

// Bytes are equal exactly if all fields are, NaN and -0 included, since encoding writes every field once.
template <typename Frame, typename Encode, typename Decode>
void expect_exact(const Frame& frame, Encode encode, Decode decode) {
  ByteWriter w;
  encode(w, frame);
  const auto decoded = decode(w.bytes());
  ASSERT_TRUE(decoded.has_value());
  ByteWriter again;
  encode(again, *decoded);
  EXPECT_EQ(w.bytes(), again.bytes());
}

template <typename Frame, typename Encode, typename Decode>
void expect_truncations_refused(const Frame& frame, Encode encode, Decode decode) {
  ByteWriter w;
  encode(w, frame);
  for (std::size_t size = 0; size < w.size(); ++size) EXPECT_FALSE(decode(ByteSpan(w.bytes()).first(size))) << size;
  w.put(std::uint8_t{0});
  EXPECT_FALSE(decode(w.bytes()));
}

TEST(FrameCodec, GivesBackEveryBitOfRandomFrames) {
  RandomFrames random(1);
  for (int i = 0; i < 200; ++i) {
    expect_exact(random.hot({1, 5}), encode_hot, decode_hot);
    expect_exact(random.warm(), encode_warm, decode_warm);
    expect_exact(random.cold(), encode_cold, decode_cold);
    expect_exact(random.cold().words, encode_words, decode_words);
  }
}

TEST(FrameCodec, RefusesTruncatedBodiesAndTrailingBytes) {
  RandomFrames random(2);
  for (int i = 0; i < 4; ++i) {
    expect_truncations_refused(random.hot({1, 5}), encode_hot, decode_hot);
    expect_truncations_refused(random.warm(), encode_warm, decode_warm);
    expect_truncations_refused(random.cold(), encode_cold, decode_cold);
    expect_truncations_refused(random.cold().words, encode_words, decode_words);
  }
}

TEST(FrameCodec, KeepsTheFieldsApart) {
  RandomFrames random(3);
  FrameHot frame = random.hot({2, 7});
  frame.edges = {random.edge({2, 7}, 0)};
  Edge& edge = frame.edges[0];
  edge.T_ab.R(0, 1) = 0.125;
  edge.covariance(2, 3) = 7;
  edge.prior_covariance(5, 0) = 8;
  edge.consistent_with = {{{3, 4}, 5}};
  edge.bound_frames = {{6, 7}};
  Landmark landmark;
  landmark.abr = {1, 2, 3};
  landmark.claims = {{{{1, 2}, 3}, {{4, 5}, 6}}};
  landmark.observers = {{1, 9}};
  frame.landmarks = {landmark, random.landmark()};
  frame.labels = {"dock", std::string("a\0b", 3)};
  ByteWriter w;
  encode_hot(w, frame);
  const auto got = decode_hot(w.bytes());
  ASSERT_TRUE(got);
  EXPECT_EQ(got->time_us, frame.time_us);
  EXPECT_EQ(got->journal_sequence, frame.journal_sequence);
  EXPECT_EQ(got->labels, frame.labels);
  EXPECT_EQ(got->incoming, frame.incoming);
  ASSERT_EQ(got->edges.size(), 1u);
  EXPECT_EQ(got->edges[0].T_ab.R(0, 1), 0.125);
  EXPECT_EQ(got->edges[0].covariance(2, 3), 7);
  EXPECT_EQ(got->edges[0].prior_covariance(5, 0), 8);
  EXPECT_EQ(got->edges[0].consistent_with, edge.consistent_with);
  EXPECT_EQ(got->edges[0].bound_frames, edge.bound_frames);
  ASSERT_EQ(got->landmarks.size(), 2u);
  EXPECT_EQ(got->landmarks[0].abr, landmark.abr);
  EXPECT_EQ(got->landmarks[0].claims[0].target, landmark.claims[0].target);
  EXPECT_EQ(got->landmarks[0].claims[0].closure, landmark.claims[0].closure);
  EXPECT_EQ(got->landmarks[0].observers, landmark.observers);
}

}  // namespace
}  // namespace relmap
